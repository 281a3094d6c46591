"""Build the sample .blend files: the extension's own sample scenes, saved by the bpy wheel.

    python .ci/sample.py FOLDER

FOLDER gets sample.blend, the overview, and sample-NAME.blend for each task, framed when opened; and a copy
of the measured data that one of them shows.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))
DATA = "paper-moduli"


def main(arguments: list[str]) -> int:
    """Write the scenes; the exit status."""
    import bpy

    import mu_addon

    if len(arguments) != 1:
        sys.stderr.write("usage: python .ci/sample.py FOLDER\n")
        return 2
    folder = Path(arguments[0]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copytree(ROOT / "assets" / "examples" / DATA, folder / DATA, dirs_exist_ok=True)
    from mu_addon.blender.assets.sample import SCENES

    for name in SCENES:
        bpy.ops.wm.read_factory_settings(use_empty=True)
        mu_addon.register()
        bpy.ops.mu.millimetres()
        bpy.ops.mu.sample(scene=name)
        for obj in bpy.data.objects:
            if obj.mu_evidence.folder:
                # Beside the file, wherever that goes.
                obj.mu_evidence.folder = f"//{DATA}"
        file = folder / ("sample.blend" if name == "overview" else f"sample-{name}.blend")
        bpy.ops.wm.save_as_mainfile(filepath=str(file), compress=True, check_existing=False)
        mu_addon.unregister()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
