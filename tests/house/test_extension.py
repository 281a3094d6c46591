"""The Blender extension: Blender's tool accepts it, it holds what ships, and it registers twice."""

import importlib.util
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
needs_bpy = pytest.mark.skipif(importlib.util.find_spec("bpy") is None, reason="bpy is not installed")


@pytest.fixture(scope="module")
def archive(tmp_path_factory):
    out = tmp_path_factory.mktemp("extension")
    done = subprocess.run(
        [sys.executable, ROOT / ".ci" / "extension.py", out], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Success parsing TOML" in done.stdout
    (path,) = out.glob("*.zip")
    return path


@needs_bpy
def test_archive_holds_what_ships(archive):
    names = zipfile.ZipFile(archive).namelist()
    assert {"blender_manifest.toml", "__init__.py", "LICENSE", "errors.py", "report/report.css"} <= set(names)
    for name in names:
        assert not name.startswith(("tests/", "docs/", "benchmarks/", "."))
        assert "__pycache__" not in name


@needs_bpy
def test_blender_refuses_a_bad_manifest(tmp_path):
    sys.path.insert(0, str(ROOT / ".ci"))
    try:
        import extension
    finally:
        sys.path.pop(0)
    source = tmp_path / "mu_addon"
    extension.stage(source)
    manifest = source / "blender_manifest.toml"
    manifest.write_text(manifest.read_text().replace('tagline = "', 'tagline = "' + "x" * 64))
    tool = extension.blender_ext()
    done = subprocess.run(
        [sys.executable, tool, "validate", source], capture_output=True, text=True, check=False
    )
    assert done.returncode != 0
    assert "tagline" in done.stdout + done.stderr


def test_without_bpy_it_says_what_to_do_before_any_work(tmp_path):
    out = tmp_path / "out"
    # Without site-packages there is no bpy, as after a plain `pip install -e .`.
    done = subprocess.run(
        [sys.executable, "-S", ROOT / ".ci" / "extension.py", out],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 2
    assert "bpy==" in done.stderr
    assert "--install" in done.stderr or "use python3.11" in done.stderr
    assert not out.exists()


INSTALL = """
import sys
import bpy

bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.extensions.package_install_files(filepath=sys.argv[1], repo="user_default", enable_on_install=True)
name = "bl_ext.user_default.mu_addon"
assert name in bpy.context.preferences.addons, list(bpy.context.preferences.addons.keys())
module = sys.modules[name]
for _ in range(2):
    module.unregister()
    module.register()
from bl_ext.user_default.mu_addon.design.parameters import load_preset
assert load_preset("mu-1.0x").dimensions.cell == 12.5
assert "mu_addon" not in sys.modules, "the core was imported under a second name"
print("registered")
"""


@needs_bpy
def test_installs_and_registers_twice(archive, tmp_path):
    done = subprocess.run(
        [sys.executable, "-c", INSTALL, archive],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={"PATH": "", "HOME": str(tmp_path), "BLENDER_USER_RESOURCES": str(tmp_path / "blender")},
    )
    assert "registered" in done.stdout, done.stdout + done.stderr
