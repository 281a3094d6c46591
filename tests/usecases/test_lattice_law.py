"""A study whose lattice has a law of its own: another motion, kept apart, and warned of beyond its range."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.homogenize.effective_file import read_effective
from mu_addon.meshing.settings import MeshSettings
from mu_addon.run.context import RunContext, run_to_end
from mu_addon.run.progress import Progress
from mu_addon.usecases.simulate_and_place.job import Job
from mu_addon.usecases.simulate_and_place.study import Study

from ..homogenize.lattice_laws import body_centred

JOB = Job(
    unit=load_preset("mu-1.0x"),
    protocol=Protocol(np.arange(3.0), np.array([0.0, -10.0, 20.0])),
    mesh=MeshSettings(refine=0.4, order=1),
    times=3,
    workers=1,
)


def simulated(folder, lattice):
    progress = Progress([])
    with run_to_end(progress) as context:
        study = Study.open(attrs.evolve(JOB, lattice=lattice), folder, context)
        study.make_mesh()
        study.simulate()
    assert context.status == 0
    return study


def test_the_lattices_law_decides_the_motion_and_is_kept_with_it(tmp_path):
    own = simulated(tmp_path, None)
    angle = own.context.summary["angle_deg"]["20"]
    assert "lattice" not in (tmp_path / "study.toml").read_text()
    before = (tmp_path / "study.toml").read_text(), (tmp_path / "angle.csv").read_text()

    study = simulated(tmp_path, body_centred())
    summary = study.context.summary
    # As stiff along an axis, but three times stiffer in shear: it bends less.
    assert 0.3 * angle < summary["angle_deg"]["20"] < 0.9 * angle
    assert 'lattice = "effective.toml"' in (tmp_path / "study.toml").read_text()
    assert read_effective(tmp_path / "effective.toml") == body_centred()
    stale = tmp_path / "stale"
    assert before == ((stale / "study.toml").read_text(), (stale / "angle.csv").read_text())
    stretch = summary["lattice_stretch"]
    assert stretch["0"]["least"] == stretch["0"]["largest"] == 1
    assert 0.5 < stretch["20"]["least"] < 0.95 < 1.05 < stretch["20"]["largest"] < 2
    beyond = any(s["share_beyond_fit"] for s in stretch.values())
    assert beyond == any("was fitted from 0.6 to 1.4" in text for text in study.warnings)

    # The same law, fitted in a narrower range, is another input, and is left; the motion is the same.
    narrow = attrs.evolve(body_centred(), stretch=(0.97, 1.02))
    text = (tmp_path / "study.toml").read_text()
    again = simulated(tmp_path, narrow)
    assert (stale / "study.toml").read_text() == text
    assert read_effective(stale / "effective.toml") == body_centred()
    assert again.context.summary["angle_deg"] == summary["angle_deg"]
    (warning,) = (text for text in again.warnings if "fitted" in text)
    assert "was fitted from 0.97 to 1.02" in warning
    least = min(s["least"] for s in stretch.values())
    assert f"from {least:.2f} to" in warning
    assert again.context.summary["lattice_stretch"]["20"]["share_beyond_fit"] > 0.1

    # And back to the unit's own modulus.
    simulated(tmp_path, None)
    assert not (tmp_path / "effective.toml").exists()
    assert before == ((tmp_path / "study.toml").read_text(), (tmp_path / "angle.csv").read_text())


def test_a_law_of_another_cell_is_warned_of(tmp_path):
    """Written by hand, the law has an offset of 0.1 mm, which the unit has not."""
    same = attrs.evolve(body_centred(), cell={"kind": "body-centred", "size_mm": 12.5})
    other = attrs.evolve(same, cell={"kind": "octet", "size_mm": 12.5, "offset_xy_mm": 0.1})
    warnings = []
    for lattice in (same, other):
        progress = Progress([])
        folder = tmp_path / str(len(warnings))
        study = Study.open(attrs.evolve(JOB, lattice=lattice), folder, RunContext(progress))
        warnings.append([text for text in study.warnings if "another cell" in text])
    assert warnings[0] == []
    assert "kind octet (unit: body-centred), offset_xy_mm 0.1 (unit: 0.0)" in warnings[1][0]


def test_another_law_is_another_entry_of_the_cache():
    mesh = simulated_mesh()
    laws = [None, body_centred(), attrs.evolve(body_centred(), shear_MPa=0.05)]
    assert len({attrs.evolve(JOB, lattice=law).materials(mesh).hash() for law in laws}) == 3
    assert len({attrs.evolve(JOB, lattice=law).text() for law in laws}) == 3


def simulated_mesh():
    from mu_addon.meshing.homogenised_unit import mesh_unit

    return mesh_unit(JOB.unit, JOB.mesh)


def test_a_file_of_the_law_that_is_there_already_is_no_obstacle_but_another_is(tmp_path):
    law = body_centred()
    (tmp_path / "effective.toml").write_text(law.text())
    progress = Progress([])
    Study.open(attrs.evolve(JOB, lattice=law), tmp_path, RunContext(progress))
    other = tmp_path / "other"
    other.mkdir()
    (other / "effective.toml").write_text("not yours")
    with pytest.raises(InputError, match=r"unknown file: effective\.toml"):
        Study.open(attrs.evolve(JOB, lattice=law), other, RunContext(progress))
    assert (other / "effective.toml").read_text() == "not yours"
