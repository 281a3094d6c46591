"""Two runs' motions, point by point: of known bending, on one mesh and on two."""

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError
from mu_addon.report.motion_files import MODEL_A, read_motion
from mu_addon.simulate_and_place.run_difference import difference

from .bent_motion import ANGLES, PRESSURES, bent, write_bent_motion

UNIT = load_preset("mu-0.75x").evolve(count=3)


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Three runs: some bending on a coarse mesh; 1.2 times as much on it, and on another mesh."""
    top = tmp_path_factory.mktemp("runs")
    write_bent_motion(top / "own", unit=UNIT)
    write_bent_motion(top / "more", 1.2 * ANGLES, unit=UNIT)
    write_bent_motion(top / "finer", 1.2 * ANGLES, unit=UNIT, refine=0.35)
    return {name: read_motion(top / name) for name in ("own", "more", "finer")}


def expected(motion, skin):
    """Distance (s, v) of the two bendings at the surface's own points."""
    moved = [skin.of_nodes(bent(motion.mesh, 1.2 * a) - bent(motion.mesh, a)) for a in ANGLES]
    return np.linalg.norm(moved, axis=2)


@pytest.mark.parametrize("region", ["membrane", "lattice"])
def test_on_one_mesh_it_is_that_of_the_nodes(runs, region):
    own, more = runs["own"], runs["more"]
    skin = own.skin(region, cut=False)
    found = difference(own, MODEL_A, skin, more, MODEL_A)
    assert found.unknown == 0.0
    assert np.allclose(found.distance_mm, expected(own, skin), atol=1e-4)
    assert found.distance_mm.max() > 3.0
    assert not difference(own, MODEL_A, skin, own, MODEL_A).distance_mm.any()


def test_a_motion_that_lacks_states_is_compared_with_none(runs):
    own = runs["own"]
    partial = attrs.evolve(own, reached=np.array(PRESSURES) < 30.0)
    for one, other in ((own, partial), (partial, own)):
        with pytest.raises(InputError, match="not whole: 5 of 7 pressures so far"):
            difference(one, MODEL_A, own.skin("membrane", cut=False), other, MODEL_A)


@pytest.mark.parametrize("region", ["membrane", "lattice"])
def test_on_two_meshes_points_of_one_go_along_with_the_other(runs, region):
    own, finer = runs["own"], runs["finer"]
    skin = own.skin(region, cut=False)
    found = difference(own, MODEL_A, skin, finer, MODEL_A)
    exact = expected(own, skin)
    assert found.unknown < 0.01
    # Sections stay plane and elements straight: between nodes they cut across the arc.
    known = ~np.isnan(found.distance_mm)
    error = np.abs(found.distance_mm - exact)[known]
    assert np.percentile(error, 99) < 0.03 * exact.max()
    assert not found.distance_mm[PRESSURES == 0.0][:, known[0]].any()


def test_what_cannot_be_compared_is_said(runs, tmp_path):
    own = runs["own"]
    skin = own.skin("membrane", cut=False)
    write_bent_motion(tmp_path / "fewer", ANGLES[1:], PRESSURES[1:], unit=UNIT)
    with pytest.raises(InputError, match="different pressures"):
        difference(own, MODEL_A, skin, read_motion(tmp_path / "fewer"), MODEL_A)
    write_bent_motion(tmp_path / "larger", unit=UNIT.evolve(scale=1.5))
    with pytest.raises(InputError, match="of their surface"):
        difference(read_motion(tmp_path / "larger"), MODEL_A, skin_of(tmp_path / "larger"), own, MODEL_A)
    # A motion with memory has more states than pressures: its sample at 20 kPa is not that on the way back.
    folded = attrs.evolve(own, state=np.array([0, 1, 2, 3, 2, 1, 0]))
    with pytest.raises(InputError, match="depends on its history"):
        difference(folded, MODEL_A, skin, own, MODEL_A)
    twice = attrs.evolve(own, state=own.state[::-1].copy())
    assert difference(twice, MODEL_A, skin, own, MODEL_A).distance_mm.max() > 3.0


def skin_of(folder):
    return read_motion(folder).skin("lattice", cut=False)
