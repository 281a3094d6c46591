"""Whatever docs/engineering/extend.md says is one file is added by the one that it shows."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "engineering" / "extend.md").read_text(encoding="utf-8")
UNIT = "format = 1\n[chambers]\ncount = 3\n"
GENT = UNIT + '[wall]\nlaw = "gent"\ngent_limit = 5\n'


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the program with the page's files."""
    folder = tmp_path_factory.mktemp("copy")
    for name in ("mu_addon", "headless", "assets", "tests/fem", "tests/evidence"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "tests" / "__init__.py", folder / "tests")
    for name, place in (
        ("gent.py", "mu_addon/fem/laws"),
        ("vacuum_gain.py", "mu_addon/evidence/effects"),
        ("matlab.py", "mu_addon/lab_files/formats"),
        ("cross.toml", "assets/lattices"),
    ):
        text = re.search(rf"`{name}`:\n\n```\n(.*?)\n```\n", PAGE, re.DOTALL)[1]
        (folder / place / name).write_text(text, encoding="utf-8")
    ring = re.search(r"## Add a study.*?```python\n(.*?)\n\n\ncontext = ", PAGE, re.DOTALL)[1]
    (folder / "mu_addon/studies/ring.py").write_text(ring.replace("from mu_addon.", "from .."))
    (folder / "gent.toml").write_text(GENT)
    return folder


def ran(copy, *words, status=0):
    """What a command says in the copy."""
    environment = {**os.environ, "PYTHONPATH": str(copy)}
    done = subprocess.run(
        [sys.executable, *words], cwd=copy, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == status, done.stderr
    return done.stdout + done.stderr


LAW = """
import json
import numpy as np
from mu_addon.design.parameters import Unit, read_unit
from mu_addon.fem.laws import Gent
from mu_addon.fem.wall_law import wall_layers
from mu_addon.materials import incompressible
from mu_addon.materials.library import parse_material
from tests.fem.test_laws import ROWS, test_stress_and_tangent_are_derivatives

test_stress_and_tangent_are_derivatives(Gent)
unit = read_unit("gent.toml")
(layer,) = wall_layers(unit.wall, np.arange(2), 2.0, 0.0)
resin = parse_material('''
format = 1
name = "rubber"
[law]
name = "Gent"
parameters = { mu_MPa = 0.8, Jm = 7.0, kappa_MPa = 80.0 }
confidence = "assumed"
source = "a test"
ranges = { uniaxial = [1.0, 1.5] }
''').in_unit(Unit())
stress = incompressible(Gent, np.array([0.8, 10.0, 80.0]), "uniaxial", np.array([1.5, 2.0, 3.0]))
wall = resin.wall
print(json.dumps([layer.law.name, *layer.parameters[1], wall.names, wall.gent_limit, *stress]))
"""


def test_a_law_is_one_file(copy):
    name, mu, Jm, kappa, names, limit, *stress = json.loads(ran(copy, "-c", LAW).splitlines()[-1])
    assert (name, mu, Jm, kappa) == ("Gent", pytest.approx(1.0), 5.0, pytest.approx(2 / 3))
    assert (names, limit) == (["law", "gent_limit"], 7.0)
    # P = mu Jm/(Jm + 3 - I1) (l - 1/l^2).
    closed = [0.8 * 10 / (13 - s * s - 2 / s) * (s - s**-2) for s in (1.5, 2.0, 3.0)]
    assert stress == pytest.approx(closed)
    (copy / "bad.toml").write_text(GENT.replace("= 5", "= 0.5"))
    words = ran(copy, "headless/run.py", "design", "--unit", "bad.toml", "--out", "bad", status=2)
    assert "bad.toml, line 6, [wall] gent_limit" in words
    assert "choose 1 to 10000" in words


@pytest.mark.nightly("test_a_law_is_one_file")
def test_a_wall_of_that_law_bends_less(copy):
    (copy / "plain.toml").write_text(UNIT)
    (copy / "p.csv").write_text("time_s,pressure_kPa\n0,0\n1,40\n")
    shared = ("--protocol", "p.csv", "--times", "2", "--refine", "0.35", "--no-report")
    angles = []
    for name in ("gent", "plain"):
        ran(copy, "headless/run.py", "simulate", "--unit", f"{name}.toml", "--out", name, *shared)
        angles.append(float((copy / name / "angle.csv").read_text().split(",")[-1]))
    assert angles == pytest.approx([8.65, 8.74], abs=0.01)


EFFECT = """
import json
import numpy as np
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.diagnose.words import to_do
from tests.evidence import analytic

random, made = np.random.default_rng(4), []
for period, name in ((20.0, "slow"), (9.0, "fast")):
    t, p = analytic.triangle(0.25, period, 2, -20.0, 30.0)
    angle = analytic.channels(p)[0] + random.normal(0.0, 0.1, len(t))
    made.append(analytic.experiment(name, t, np.where(p < 0, 1.15 * p, p), {"angle_deg": angle}))
found = diagnose(made, analytic.simulator(made))
print(json.dumps([found.names, found.intervals["vacuum_gain.gain"], to_do(found)]))
"""


def test_an_effect_is_one_file(copy):
    names, (low, high), remedy = json.loads(ran(copy, "-c", EFFECT).splitlines()[-1])
    assert names == ["vacuum_gain"]
    assert low < 0.15 < high
    assert remedy == "Have the gauge calibrated below zero."


KIND = """
import attrs
from mu_addon.design.lattice_kinds import names
from mu_addon.design.parameters import Unit, read_unit
from mu_addon.design.strut_cell import relative_density, strut_cell
shipped, own = Unit().evolve(kind="cross", seats=False), read_unit("out/unit.toml")
same = attrs.evolve(shipped.dimensions.kind, name="custom") == own.dimensions.kind
print(names(), own.lattice.kind, same, round(relative_density(strut_cell(own)), 4))
"""


def test_a_lattice_kind_is_one_file(copy, tmp_path):
    """Shipped, and named by a unit, whose folder is complete without it."""
    shutil.copy(copy / "assets" / "lattices" / "cross.toml", tmp_path)
    unit = tmp_path / "unit.toml"
    unit.write_text(UNIT + '[lattice]\nkind = "cross.toml"\n[waveguide]\nseats = false\n')
    ran(copy, "headless/run.py", "design", "--unit", str(unit), "--out", "out", "--no-report")
    shutil.rmtree(tmp_path)
    names = "('body-centred', 'body-centred-straight', 'cross', 'custom')"
    assert ran(copy, "-c", KIND) == f"{names} custom True 0.0545\n"


FORMAT = """
from pathlib import Path
import numpy as np
from scipy.io import savemat
from mu_addon.lab_files import understand

pull = 0.1 * np.arange(30)
savemat("pull.mat", {"displacement_mm": pull, "force_N": 2.0 * pull})
answers = {"kind": "coupon", "mode": "uniaxial", "section_mm": "12.5x3", "length_mm": "40"}
(proposal,) = understand([Path("pull.mat")], answers).proposals
print(abs(proposal.columns["force_N"] - 2.0 * pull).max())
"""


def test_a_format_is_one_file(copy):
    assert float(ran(copy, "-c", FORMAT)) < 1e-12


def test_a_study_is_one_file(copy):
    """It has a command, a node, a report, and is resumed."""
    line = ("headless/run.py", "ring", "--wall", "1.2", "--out", "ring")
    assert "The ring has 1.24 mN/mm." in ran(copy, *line)
    assert (copy / "ring" / "curve.csv").read_text().startswith("point,force_N\n1,")
    assert "ring" in ran(copy, "headless/run.py", "--help")
    shutil.rmtree(copy / "ring" / "cache")
    assert "The ring has 1.24 mN/mm." in ran(copy, "headless/run.py", "resume", "ring")
    nodes = "from mu_addon.nodes.definitions import definitions as made"
    assert ran(copy, "-c", f"{nodes}; print(made()['ring'].settings[0].name)") == "radius_mm\n"
