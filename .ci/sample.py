"""Build the sample .blend: the extension's own sample scene, saved by the bpy wheel.

python .ci/sample.py FILE.blend
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))


def main(arguments: list[str]) -> int:
    """Write the scene; the exit status."""
    import bpy

    import mu_addon

    if len(arguments) != 1:
        sys.stderr.write("usage: python .ci/sample.py FILE.blend\n")
        return 2
    bpy.ops.wm.read_factory_settings(use_empty=True)
    mu_addon.register()
    bpy.ops.mu.millimetres()
    bpy.ops.mu.sample()
    bpy.ops.wm.save_as_mainfile(filepath=str(Path(arguments[0]).resolve()), compress=True)
    mu_addon.unregister()
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
