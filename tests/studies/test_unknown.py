"""Unknown parameters of a unit's design in a diagnosis."""

import csv
import json
from pathlib import Path

import attrs
import numpy as np
import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.diagnose.unknown import read_unknown
from mu_addon.errors import InputError
from mu_addon.evidence import unit_fem, unit_plan
from mu_addon.evidence.unit_run import Result
from mu_addon.evidence.unit_settings import UnitSettings
from mu_addon.measured import read_folder
from mu_addon.meshing.settings import MeshSettings
from mu_addon.studies.diagnose import EFFECTS, SIZES, Diagnose

from ..evidence.hollow_finger import finger
from .unit_runs import ended

PAPER = Path(__file__).parents[2] / "assets" / "examples" / "paper-bending"
UNIT = load_preset("mu-1.0x")
TEXT = """designs = 8

[[freedom]]
parameter = "chambers.wall_mm"
low = 0.4
high = 0.9

[[freedom]]
parameter = "lattice.cells_y_plus"
values = [2, 3]
"""
WALL_MM, CELLS = 0.52, 3


def angles(unit, pressures):
    """A closed form in place of the simulation: 60 and -70 degrees where `WALL_MM` and `CELLS` are drawn."""
    size = WALL_MM / unit.chambers.wall_mm * (0.5 + 0.5 * (unit.lattice.cells_y_plus - 2))
    return size * np.where(pressures > 0, 60.0 / 50.0, 70.0 / 20.0) * pressures


@pytest.fixture
def closed_form(monkeypatch):
    def run(case, cache=None):
        at = np.array(case.pressures_kPa)
        values = np.zeros((case.rows, len(at)))
        values[0] = angles(case.body.unit, at)
        # An outline that moves with the angle.
        values[2:] = np.abs(at)
        return Result(values)

    monkeypatch.setattr(unit_fem, "run", run)
    # No mesh of a unit is solved on.
    monkeypatch.setattr(unit_plan, "mesh_printed", finger)


def written(folder):
    """Ends of ranges that the closed form has, as the paper's folder."""
    folder.mkdir()
    for path in PAPER.iterdir():
        text = path.read_text()
        for printed in ("-50.0,", "-65.0,"):
            text = text.replace(printed, "-70.0,")
        for printed in ("50.0,45.0,", "50.0,50.0,", "50.0,55.0,"):
            text = text.replace(printed, "50.0,60.0,")
        (folder / path.name).write_text(text)
    return folder


def diagnosed(folder, out):
    """The summary of a diagnosis in which the parameters of TEXT are unknown."""
    mesh = MeshSettings(refine=0.2)
    settings = UnitSettings(mesh, mesh, pressures=7, margin=0.0, effects=(), workers=1)
    unknown = read_unknown(TEXT, "unknown.toml", UNIT)
    study = Diagnose(data=read_folder(folder), unit=UNIT, settings=settings, unknown=unknown)
    context, messages = ended(study, out, report=False)
    assert context.status == 0, messages[-1]
    return json.loads((out / "summary.json").read_text())


def test_a_shape_that_nobody_measured_is_found_and_no_cause_named(tmp_path, closed_form):
    summary = diagnosed(written(tmp_path / "data"), tmp_path / "out")
    assert summary["verdict"] == "none"
    found = summary["unknown"]
    best = found["fitted"][0]
    assert best["values"]["cells_y_plus"] == CELLS
    assert best["values"]["wall_mm"] * best["modulus"] == pytest.approx(WALL_MM, rel=0.03)
    assert best["misfit"] < 1.0
    assert found["readings"] == 6
    assert best["predicted"]["1x, -20 kPa"] == pytest.approx(-70.0, abs=2.5)
    assert best["predicted"]["1x, 50 kPa"] == pytest.approx(60.0, abs=2.5)
    low, high = found["intervals"]["wall_mm"]
    assert 0.4 <= low < best["values"]["wall_mm"] < high <= 0.9
    # Where it fits best, the unit was simulated: another wall than those of the sequence.
    assert len(found["simulated"]) > 8
    rows = list(csv.DictReader((tmp_path / "out" / "shapes.csv").open()))
    assert {row["of"] for row in rows} == {"fit", "simulation"}
    assert len(rows) == len(found["fitted"]) + len(found["simulated"])
    assert "of the unknown parameters" in summary["remarks"][-1]


def test_a_shape_that_finds_no_equilibrium_is_not_told_as_what_fits_best(tmp_path, closed_form, monkeypatch):
    reached = unit_fem.run

    def snaps(case, cache=None):
        # Walls thinner than those of the data and a tenth more find no state at the last pressure.
        thin = (
            case.body.unit.chambers.wall_mm < 1.1 * WALL_MM and case.body.unit.lattice.cells_y_plus == CELLS
        )
        result = reached(case, cache)
        return (
            Result(np.where(np.arange(result.values.shape[1]) < 2, np.nan, result.values)) if thin else result
        )

    monkeypatch.setattr(unit_fem, "run", snaps)
    found = diagnosed(written(tmp_path / "data"), tmp_path / "out")["unknown"]
    best = found["fitted"][0]
    assert best["fails"]
    assert best["values"]["wall_mm"] < 1.1 * WALL_MM
    assert "better found no equilibrium at some pressure when simulated" in found["words"]
    told = min((*found["fitted"], *found["simulated"]), key=lambda s: (s["fails"], s["misfit"]))
    assert f"wall mm {told['values']['wall_mm']:.3g} " in found["words"]


def simulating(study):
    return study.simulating(study.self_contact, study.settings, study.unknown, study.unit)


def test_a_run_with_unknown_parameters_is_read_again(tmp_path):
    unknown = read_unknown(TEXT, "unknown.toml", UNIT)
    job = Diagnose(data=read_folder(PAPER), unit=UNIT, unknown=unknown)
    assert len(simulating(job).designs.units) in (8, 9)
    for name, text in job.texts().items():
        (tmp_path / name).write_text(text)
    again = Diagnose.read(tmp_path)
    assert again.texts() == job.texts()
    assert simulating(again).designs.units == simulating(job).designs.units
    # No cause is named: no effect of the unit is simulated, nor told.
    assert not simulating(job).effects
    told, known = job.expected(), attrs.evolve(job, unknown=None).expected()
    assert told[EFFECTS] < 1.0 < known[EFFECTS]
    assert (SIZES in told, SIZES in known) == (False, True)


@pytest.mark.parametrize(
    ("old", "new", "what"),
    [
        ("designs = 8", "design = 8", "unknown key"),
        ("designs = 8", "designs = 2", "designs = 2"),
        ('"chambers.wall_mm"', '"material.membrane_modulus_kPa"', "not a range"),
        ('"chambers.wall_mm"', '"print.offset_xy_mm"', "not a range|is not fitted"),
        ("high = 0.9", "high = 0.8", "out of 0.4 to 0.8"),
        (
            '"lattice.cells_y_plus"\nvalues = [2, 3]',
            '"lattice.kind"\nvalues = ["body-centred"]',
            "is not fitted",
        ),
    ],
)
def test_a_file_that_cannot_be_used_is_refused_by_place(old, new, what):
    with pytest.raises(InputError, match=what):
        read_unknown(TEXT.replace(old, new), "unknown.toml", UNIT)


def test_the_shipped_file_of_the_papers_shape_is_of_the_preset():
    text = (PAPER / "unknown.toml").read_text()
    designs = read_unknown(text, "unknown.toml", UNIT).designs(UNIT)
    assert len(designs.units) == 9
    assert {u.chambers.wall_mm for u in designs.units} >= {0.4, 0.9}


@pytest.mark.nightly("test_a_shape_that_nobody_measured_is_found_and_no_cause_named")
def test_no_cause_is_named_while_dimensions_are_unknown(tmp_path, closed_form):
    folder = written(tmp_path / "data")
    for path in folder.glob("*_0.75x.csv"):
        path.write_text(path.read_text().replace("-70.0,", "-35.0,").replace("50.0,60.0,", "50.0,30.0,"))
    summary = diagnosed(folder, tmp_path / "out")
    assert summary["verdict"] == "unexplained"
    assert any("no cause is named while dimensions are unknown" in r for r in summary["remarks"])
