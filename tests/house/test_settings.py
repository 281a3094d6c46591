"""A setting is stated once: no option, property, node or field of a job repeats its default."""

import argparse
import ast
import importlib
from functools import cache
from pathlib import Path

import pytest

import mu_addon
from mu_addon import studies as declared
from mu_addon.chain import settings as chain
from mu_addon.cli.main import parser
from mu_addon.design import settings as design
from mu_addon.design.quantity import Description
from mu_addon.fem import device
from mu_addon.grasp import settings as grip
from mu_addon.meshing import settings as mesh
from mu_addon.nodes.definitions import definitions
from mu_addon.optimization import settings as search
from mu_addon.placement import settings as path
from mu_addon.simulate_and_place import settings as study
from mu_addon.studies.parameter_study import settings as sweep

ROOT = Path(mu_addon.__file__).parent
# Modules with settings.
STATED = [
    *(p for p in ROOT.rglob("*settings.py") if "blender" not in p.parts),
    ROOT / "fem" / "device.py",
]
# The same word for something else, or a zero that is none's default.
OTHERWISE = {
    "blender/optimize/properties.py": {"points"},  # of a curve that is wanted
    "blender/sensor/properties.py": {"seconds"},  # of a plot
    "chain/chain.py": {"tip_mass_g"},  # no load
    "chain/joint_learning.py": {"bend_deg"},  # of a joint
    "evidence/parameter.py": {"experiment"},  # that shows an effect
    "evidence/prediction/specimen.py": {"strain"},
    "evidence/prediction/unit_pressure.py": {"orientation_deg"},
    "evidence/unit_body.py": {"self_contact", "orientation_deg", "device"},  # the plain unit, on the CPU
    "graph/evaluation.py": {"seconds"},  # that a node took
    "measured/experiment.py": {"orientation_deg", "specimen"},
    "optimization/unit_body.py": {"self_contact"},
    "sensing/calibration.py": {"dark"},  # subtracted already
    "studies/unit_motion.py": {"self_contact"},  # of a call, which may be quick
    "studies/parameter_study/point.py": {"memory_MB", "seconds"},  # that a study took
    "nodes/studies.py": {"protocol"},
}


def settings_of(file):
    """Settings that a module states or imports."""
    module = importlib.import_module(".".join(("mu_addon", *file.relative_to(ROOT).with_suffix("").parts)))
    return [d for d in vars(module).values() if isinstance(d, Description)]


@cache
def every():
    """Names of all settings."""
    inputs = (one for name in declared.STUDIES for one in declared.study(name).inputs().values())
    given = (d for one in inputs if one.kind == "setting" for d in one.descriptions)
    return {d.name for d in (*(d for file in STATED for d in settings_of(file)), *given)}


def restated(source, names):
    """Names among `names` that a source gives a literal default."""
    found = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Call):
            name = _text(node.args[0]).removeprefix("--").replace("-", "_") if node.args else ""
            if name in names and _function(node) in ("add_argument", "setting") and _has_literal(node):
                found.add(name)
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            calls = [n for n in (node.annotation, node.value) if isinstance(n, ast.Call)]
            if node.target.id in names and (_is_literal(node.value) or any(map(_has_literal, calls))):
                found.add(node.target.id)
    return found


def _text(node):
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def _function(call):
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def _has_literal(call):
    given = [k.value for k in call.keywords if k.arg == "default"]
    given += call.args[1:2] if _function(call) == "setting" else []
    return any(map(_is_literal, given))


def _is_literal(value):
    """Whether it is a value; None stands for what is left out."""
    return isinstance(value, ast.Constant) and value.value is not None


def test_no_default_is_stated_twice():
    found = {}
    for file in ROOT.rglob("*.py"):
        name = file.relative_to(ROOT).as_posix()
        again = restated(file.read_text(encoding="utf-8"), every()) - OTHERWISE.get(name, set())
        if again:
            found[name] = again
    assert found == {}


def test_what_is_otherwise_is_still_there():
    for name, words in OTHERWISE.items():
        assert restated((ROOT / name).read_text(encoding="utf-8"), every()) >= words, name


@pytest.mark.parametrize(
    "source",
    [
        'command.add_argument("--self-contact", default=False)',
        'setting("self_contact", True, "keep them apart")',
        "class A:\n    self_contact: BoolProperty(default=True)",
        "class A:\n    self_contact: bool = attrs.field(default=True)",
        "class A:\n    self_contact: bool = False",
    ],
)
def test_the_search_finds_each_way_to_restate_one(source):
    assert restated(source, every()) == {"self_contact"}


def options(command):
    commands = next(a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {action.dest: action for action in commands.choices[command]._actions}


@pytest.mark.parametrize(
    ("command", "d"),
    [
        *(("place", d) for d in (mesh.REFINE, study.TIMES, study.STATIONS)),
        *(("place", d) for d in (study.WORKERS, study.CHECKS, study.PATHS)),
        *(("place", d) for d in (path.SHORTEST, path.LONGEST, path.BEND, device.DEVICE)),
        *(("sweep", d) for d in (sweep.WORKERS, sweep.ADD)),
        ("optimize", search.WORKERS),
        *(("grip", d) for d in (grip.DENSITY, design.FRICTION, grip.BEYOND, design.QUALITY)),
        ("export", design.FINE),
    ],
)
def test_an_option_has_default_and_text_of_its_setting(command, d):
    action = options(command)[d.name]
    assert action.default == d.default
    shown = f"{d.default:g}" if d.type is float else d.default
    shown = f"{shown} {d.unit}" if d.unit else shown
    assert action.help.lower() == f"{d.text} (default: {shown}).".lower()


def test_nodes_have_the_settings_themselves():
    for kind, d in (
        ("simulate", study.TIMES),
        ("simulate", mesh.SELF_CONTACT),
        ("place", study.MESH_CHECK),
        ("place", study.ALL_PATHS),
        ("sweep", sweep.POINTS),
        ("grip", grip.DENSITY),
        ("export", design.FINE),
        ("chain", chain.TIP_MASS),
        ("sweep", sweep.MEMORY),
        ("optimize", search.WORKERS),
    ):
        assert definitions()[kind].setting(d.name).description is d
