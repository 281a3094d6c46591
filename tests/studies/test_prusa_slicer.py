"""PrusaSlicer reads the exported files as one closed body of the manifest's size and volume.

`--info` writes a section for each file, one `name = value` a line; the numbers of what it had to mend stand
there only where it mended something.
"""

import json
import shutil
import subprocess

import pytest

from mu_addon.cli.main import main
from mu_addon.design.assets import asset_names
from mu_addon.design.parameters import load_preset
from mu_addon.errors import InputError

SLICER = next(filter(None, map(shutil.which, ("prusa-slicer", "PrusaSlicer", "prusa-slicer-console"))), None)
MENDED = ("open_edges", "degenerate_facets", "edges_fixed", "facets_removed", "facets_reversed")
MENDED += ("facets_added", "backwards_edges")


def units():
    """Names of the presets that are single units."""
    found = []
    for name in asset_names("presets"):
        try:
            found.append(load_preset(name).name)
        except InputError:
            continue
    return found


def read_info(text):
    """Sections of PrusaSlicer's `--info` by file name, each a dictionary of its values as text."""
    found = {}
    for line in text.splitlines():
        if line.startswith("[") and line.rstrip().endswith("]"):
            section = found.setdefault(line.strip()[1:-1], {})
        elif found and " = " in line:
            name, value = line.split("=", 1)
            section[name.strip()] = value.strip()
    return found


def complaints(info):
    """What PrusaSlicer says against a file."""
    mended = [f"{name} = {info[name]}" for name in MENDED if float(info.get(name, 0)) > 0]
    one = [] if info.get("number_of_parts") == "1" else [f"{info.get('number_of_parts')} parts"]
    return mended + one + ([] if info.get("manifold") == "yes" else ["no manifold"])


@pytest.mark.nightly(
    "tests/studies/test_export.py::test_both_packages_are_read_by_the_consortiums_own_library"
)
@pytest.mark.skipif(SLICER is None, reason="PrusaSlicer is not installed")
@pytest.mark.parametrize("preset", units())
def test_it_opens_the_files_of_every_preset_as_one_body(preset, tmp_path):
    out = tmp_path / "out"
    arguments = ["--preset", preset, "--path", "alpha4", "--formats", "stl", "3mf", "--out", str(out)]
    assert main(["export", *arguments]) == 0
    manifest = json.loads((out / "manifest.json").read_text())
    low, high = manifest["solid"]["bounding_box_mm"]
    for name in ("unit.stl", "unit.3mf"):
        done = subprocess.run(
            [SLICER, "--info", str(out / name)], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        (info,) = read_info(done.stdout).values()
        assert complaints(info) == [], name
        assert float(info["volume"]) == pytest.approx(manifest["solid"]["volume_mm3"], rel=1e-4)
        assert int(info["number_of_facets"]) == manifest["solid"]["triangles"]
        for axis, a, b in zip("xyz", low, high, strict=True):
            assert float(info[f"size_{axis}"]) == pytest.approx(b - a, abs=2e-3)
