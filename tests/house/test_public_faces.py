"""Public faces of the packages: every name resolves, mypy sees the same names, and nothing heavy loads."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import mu_addon

PACKAGES = (
    "design",
    "evidence",
    "fem",
    "graph",
    "homogenize",
    "materials",
    "measured",
    "meshing",
    "placement",
    "report",
)
PACKAGES += ("chain", "optimization", "resolved", "sensing")
HEAVY = ("bpy", "gmsh", "matplotlib", "meshio", "scipy", "trimesh", "warp")
FOLDER = Path(mu_addon.__file__).parent


@pytest.mark.parametrize("package", PACKAGES)
def test_every_name_of_a_public_face_resolves(package):
    face = importlib.import_module(f"mu_addon.{package}")
    assert face.__doc__
    assert set(face.__all__) <= set(dir(face))
    for name in face.__all__:
        assert getattr(face, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        face.nothing  # noqa: B018


@pytest.mark.parametrize("package", PACKAGES)
def test_the_type_checker_sees_the_same_names(package):
    tree = ast.parse((FOLDER / package / "__init__.py").read_text())
    imports = [n for n in ast.walk(tree) if isinstance(n, ast.ImportFrom) and n.level == 1]
    checked = {(node.module, alias.name) for node in imports for alias in node.names}
    [table] = [node for node in ast.walk(tree) if isinstance(node, ast.Dict)]
    offered = ast.literal_eval(table)
    assert checked == {(module, name) for module, names in offered.items() for name in names.split()}
    modules = {path.stem for path in (FOLDER / package).iterdir()}
    assert not {name for _, name in checked} & modules, "a module of that name would take its place"


def test_packages_and_help_load_nothing_heavy():
    names = ", ".join(f"mu_addon.{package}" for package in PACKAGES)
    code = f"import sys, {names}; print([m for m in {HEAVY} if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"
    code = (
        "import sys\nfrom mu_addon.cli.main import main\n"
        "try:\n    main(['--help'])\nexcept SystemExit:\n    pass\n"
        f"print([m for m in {HEAVY} if m in sys.modules])"
    )
    assert subprocess.check_output([sys.executable, "-c", code], text=True).splitlines()[-1] == "[]"
