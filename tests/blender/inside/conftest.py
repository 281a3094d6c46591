"""Tests here run in Blender, a process for all, each in a Blender as new; pytest itself never imports them.

A test is given its arguments as any other: fixtures from outside, made by `conftest.py` in plain Python, and
`monkeypatch` of the process that it runs in. Marked `own_process` it has a process to itself, where nothing
of the extension has been imported.
"""

import ast
import inspect
import shutil
import types

import pytest

from mu_addon.design.parameters import load_preset
from mu_addon.meshing.settings import MeshSettings
from mu_addon.studies.unit_ranking import UnitStudy

from ...made_once import made_once
from ...studies.bent_motion import write_bent_run
from ...studies.diagnosis_data import weighed_blocks
from ...studies.made_up import place
from ..filming import ANGLES, film, pressures
from ..session import Blender, needs_bpy

INSIDE = "monkeypatch"


class InBlender(pytest.Module):
    """A file of tests as read: importing it takes bpy."""

    def _getobj(self):
        tree = ast.parse(self.path.read_text(encoding="utf-8"))
        module = types.ModuleType(f"{__package__}.{self.path.stem}", ast.get_docstring(tree))
        module.pytestmark = needs_bpy
        for node in tree.body:
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test_"):
                setattr(module, node.name, stand_in(module.__name__, node))
        return module


def stand_in(module, node):
    """A test that has the one of the same name run in Blender, with its marks and its fixtures."""

    def test(blender, request, tmp_path, **given):
        if "tmp_path" in names:
            given["tmp_path"] = tmp_path
        blender(module, node.name, request, folder=tmp_path, **given)

    names = [argument.arg for argument in node.args.args if argument.arg != INSIDE]
    outside = dict.fromkeys(["blender", "request", "tmp_path", *names])
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    test.__signature__ = inspect.Signature([inspect.Parameter(name, kind) for name in outside])
    test.__name__, test.__doc__ = node.name, ast.get_docstring(node)
    for decorator in reversed(node.decorator_list):
        test = eval(ast.unparse(decorator), {"pytest": pytest})(test)
    return test


def pytest_pycollect_makemodule(module_path, parent):
    return InBlender.from_parent(parent, path=module_path)


@pytest.fixture(scope="session")
def blenders(tmp_path_factory):
    """The Blender of a Python, started once: to start one and load the solver takes seconds."""
    started = {}

    def of(python):
        if python not in started:
            started[python] = Blender(python, tmp_path_factory.mktemp("blender"))
        return started[python]

    yield of
    for one in started.values():
        one.close()


@pytest.fixture(scope="module")
def blender(each_bpy, blenders, tmp_path_factory):
    """Runs a function of a module in the Blender of all tests, or in one of its own."""
    shared = blenders(each_bpy)

    def run(module, name, request, **given):
        if request.node.get_closest_marker("own_process") is None:
            return shared.call(module, name, **given)
        own = Blender(each_bpy, tmp_path_factory.mktemp("blender"))
        try:
            return own.call(module, name, registered=None, **given)
        finally:
            own.close()

    return run


# A coarse ranking, with one path of the whole lattice beside the ten of the anchors.
PLACE = {
    "mesh": MeshSettings(refine=0.2),
    "times": 7,
    "stations": 51,
    "mesh_check": False,
    "all_paths": True,
    "paths": "graph",
    "longest_cells": 2.0,
    "checks": 2,
}


@pytest.fixture(scope="session")
def placed(tmp_path_factory, with_light):
    """A finished study, whose motion is made up; whoever writes into it takes `study`."""

    def make(folder):
        place(with_light(folder), UnitStudy(unit=load_preset("mu-0.75x"), workers=1, **PLACE))

    return made_once(tmp_path_factory, "placed", make)


@pytest.fixture
def study(placed, tmp_path):
    """A copy of a finished study of `place`."""
    return shutil.copytree(
        placed, tmp_path / "study", ignore=shutil.ignore_patterns("cache", "played"), dirs_exist_ok=True
    )


@pytest.fixture(scope="session")
def finished_runs(tmp_path_factory):
    """Home folder of three runs: on the default mesh, on a coarse one, and the motion of a thicker wall."""
    home = tmp_path_factory.mktemp("finished") / "home"
    write_bent_run(home, 1000, full=True)
    write_bent_run(home, 2000)
    write_bent_run(home, 3000, wall_mm=1.1, more=0.8, ranked=False)
    return home


@pytest.fixture
def home(finished_runs, tmp_path):
    """A copy of `finished_runs`."""
    return shutil.copytree(finished_runs, tmp_path / "home")


@pytest.fixture
def blocks(tmp_path):
    """Measured data of weighed blocks, overcured by 0.09 mm; not diagnosed."""
    return weighed_blocks(tmp_path / "data", 0.09)


@pytest.fixture
def filmed(tmp_path):
    """Pictures of a bench in clip/, its pressure.csv; the true pixels of the markers and the angles."""
    truth = film(tmp_path / "clip", ANGLES)
    pressures(tmp_path, ANGLES)
    return truth, ANGLES
