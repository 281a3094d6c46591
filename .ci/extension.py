"""Build the Blender extension: `python .ci/extension.py FOLDER` checks it and writes its .zip into FOLDER.

Blender wants the manifest beside the package's `__init__.py`; the checkout keeps them apart so that the core
is an ordinary package. What ships is copied together first. Needs the bpy wheel, for its `blender_ext.py`.
"""

from __future__ import annotations

import importlib.util
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def blender_ext() -> Path | None:
    """Blender's own extension tool as shipped in the bpy wheel, or None where bpy is not installed."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        return None
    return next(Path(spec.origin).parent.glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py"), None)


def stage(folder: Path) -> None:
    """Copy what ships into `folder`, which must not exist yet."""
    shutil.copytree(ROOT / "mu_addon", folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("blender_manifest.toml", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    if (ROOT / "assets").is_dir():
        shutil.copytree(ROOT / "assets", folder / "assets")


def main(out: Path) -> int:
    """Stage, validate and build into `out`; the exit status of the first step that fails."""
    tool = blender_ext()
    if tool is None:
        sys.stderr.write("bpy is not installed here: pip install -e '.[blender]' with Python 3.11\n")
        return 2
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch) / "mu_addon"
        stage(source)
        for arguments in (
            ["validate", str(source)],
            ["build", "--source-dir", str(source), "--output-dir", str(out)],
        ):
            status = subprocess.run([sys.executable, str(tool), *arguments], check=False).returncode
            if status:
                return status
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1] if len(sys.argv) > 1 else "out")))
