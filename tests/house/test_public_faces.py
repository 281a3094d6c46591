"""Public faces of the packages: every name resolves, mypy sees the same names, and nothing heavy loads."""

import ast
import importlib
import subprocess
import sys
import zipfile
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
PACKAGES += ("chain", "optimization", "body", "sensing")
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
    checked = {alias.name for node in imports for alias in node.names}
    assert checked == set(importlib.import_module(f"mu_addon.{package}").__all__)
    modules = {path.stem for path in (FOLDER / package).iterdir()}
    assert not checked & modules, "a module of that name would take its place"


def test_a_face_works_from_a_zip_too(tmp_path):
    with zipfile.ZipFile(tmp_path / "packed.zip", "w") as packed:
        for file in ("__init__.py", "lazy.py", "errors.py", "arrays.py", *_python_files("measured")):
            packed.write(FOLDER / file, f"mu_addon/{file}")
    code = "from mu_addon import measured; print(measured.__file__, measured.__all__, measured.Remark)"
    command = [sys.executable, "-I", "-c", f"import sys; sys.path.insert(0, {packed.filename!r}); {code}"]
    said = subprocess.check_output(command, text=True)
    assert "packed.zip" in said
    assert "read_folder" in said


def _python_files(package):
    return [path.relative_to(FOLDER) for path in (FOLDER / package).rglob("*.py")]


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
