"""Tests here run in Blender, a process a file, each in a Blender as new; pytest itself never imports them.

A test is given its arguments as any other: fixtures from outside, made by `conftest.py` in plain Python, and
`monkeypatch` of the process that it runs in. Marked `own_process` it has a process to itself, where nothing
of the extension has been imported.
"""

import ast
import inspect
import types

import pytest

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


@pytest.fixture(scope="module")
def blender(each_bpy, tmp_path_factory):
    """Runs a function of a module in this file's Blender, or in one of its own."""
    shared = Blender(each_bpy, tmp_path_factory.mktemp("blender"))

    def run(module, name, request, **given):
        if request.node.get_closest_marker("own_process") is None:
            return shared.call(module, name, **given)
        own = Blender(each_bpy, tmp_path_factory.mktemp("blender"))
        try:
            return own.call(module, name, registered=None, **given)
        finally:
            own.close()

    yield run
    shared.close()
