"""A setting is stated once: no option, property, node or field of a job repeats its default."""

import argparse
import ast
from pathlib import Path

import pytest

import mu_addon
from mu_addon.chain import settings as chain
from mu_addon.cli.main import parser
from mu_addon.design import settings as design
from mu_addon.design.quantity import Description
from mu_addon.meshing import settings as mesh
from mu_addon.optimization import settings as search
from mu_addon.usecases.export import settings as export
from mu_addon.usecases.graph.chain_nodes import chain_nodes
from mu_addon.usecases.graph.optimize_nodes import optimize_nodes
from mu_addon.usecases.graph.study_nodes import study_nodes
from mu_addon.usecases.graph.sweep_nodes import sweep_nodes
from mu_addon.usecases.grip import settings as grip
from mu_addon.usecases.homogenize import settings as lattice
from mu_addon.usecases.parameter_study import settings as sweep
from mu_addon.usecases.simulate_and_place import settings as study

ROOT = Path(mu_addon.__file__).parent
STUDY = (mesh, study)
WHERE = {
    "cli/options.py": STUDY,
    "cli/chain.py": (chain,),
    "cli/export.py": (export,),
    "cli/grip.py": (mesh, design, grip),
    "cli/homogenize.py": (lattice,),
    "cli/optimize.py": (search,),
    "cli/sweep.py": (sweep,),
    "cli/place.py": STUDY,
    "cli/simulate.py": STUDY,
    "blender/gripper/properties.py": (mesh, design, grip),
    "blender/obstacles/operators.py": (design,),
    "blender/obstacles/state.py": (design,),
    "blender/unit/properties.py": STUDY,
    "blender/optimize/properties.py": (search,),
    "chain/learning.py": (chain,),
    "design/rigid_body.py": (design,),
    "meshing/settings.py": (mesh,),
    "optimization/search.py": (search,),
    "optimization/design_file.py": (search,),
    "usecases/homogenize/job.py": (lattice,),
    "usecases/simulate_and_place/job.py": (*STUDY, design),
    "usecases/chain/job.py": (chain,),
    "usecases/diagnose/job.py": (mesh,),
    "usecases/diagnose/design_experiments.py": (mesh,),
    "usecases/export/job.py": (export,),
    "usecases/grip/grasp.py": (grip,),
    "usecases/grip/job.py": (mesh, design, grip),
    "usecases/graph/chain_nodes.py": (mesh, chain),
    "usecases/graph/sweep_nodes.py": (mesh, sweep),
    "usecases/graph/optimize_nodes.py": (search,),
    "usecases/optimize/job.py": (search,),
    "usecases/parameter_study/plan.py": (sweep,),
    "usecases/parameter_study/run.py": (sweep,),
}


def every(modules):
    """Names of the settings of some modules."""
    return {d.name for module in modules for d in vars(module).values() if isinstance(d, Description)}


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


@pytest.mark.parametrize("file", WHERE)
def test_no_default_is_stated_twice(file):
    assert restated((ROOT / file).read_text(encoding="utf-8"), every(WHERE[file])) == set()


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
    assert restated(source, every([mesh])) == {"self_contact"}


def options(command):
    commands = next(a for a in parser()._actions if isinstance(a, argparse._SubParsersAction))
    return {action.dest: action for action in commands.choices[command]._actions}


@pytest.mark.parametrize(
    ("command", "d"),
    [
        *(("place", d) for d in (mesh.ORDER, mesh.REFINE, study.TIMES, study.STATIONS)),
        *(("place", d) for d in (study.WORKERS, study.CHECKS, study.PATHS)),
        *(("homogenize", d) for d in (lattice.CELLS, lattice.FRICTION, lattice.STRAIN, lattice.REFINE)),
        *(("sweep", d) for d in (sweep.WORKERS, sweep.ADD)),
        ("optimize", search.WORKERS),
        *(("grip", d) for d in (grip.DENSITY, design.FRICTION, grip.BEYOND, design.QUALITY)),
        ("export", export.QUALITY),
    ],
)
def test_an_option_has_default_and_text_of_its_setting(command, d):
    action = options(command)[d.name]
    assert action.default == d.default
    shown = f"{d.default:g}" if d.type is float else d.default
    shown = f"{shown} {d.unit}" if d.unit else shown
    assert action.help.lower() == f"{d.text} (default: {shown}).".lower()


def test_nodes_have_the_settings_themselves():
    nodes = {n.kind: n for n in (*study_nodes(), *sweep_nodes(), *optimize_nodes(), *chain_nodes())}
    for kind, d in (
        ("simulate", study.TIMES),
        ("simulate", mesh.STUDY_SELF_CONTACT),
        ("place", study.MESH_CHECK),
        ("sweep", mesh.ORDER),
        ("homogenize", lattice.REFINE),
        ("sweep", sweep.POINTS),
        ("grip", grip.DENSITY),
        ("export", export.QUALITY),
        ("chain", chain.TIP_MASS),
        ("sweep", sweep.MEMORY),
        ("optimize", search.WORKERS),
    ):
        assert nodes[kind].setting(d.name).description is d
