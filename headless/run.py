"""The command line of mu_addon, in plain Python or inside Blender.

python headless/run.py place --preset mu-1.0x --out out
blender -b -P headless/run.py -- place --preset mu-1.0x --out out
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

# Before anything loads BLAS: its threads spin while they wait for each other on the many small systems here.
# A verdict on a beam took 7.8 s with two and 2.5 s with one.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

ROOT = Path(__file__).resolve().parent.parent


def arguments() -> list[str]:
    """What follows `--` when Blender runs this file, everything otherwise."""
    if "bpy" in sys.modules and "--" in sys.argv:
        return sys.argv[sys.argv.index("--") + 1 :]
    # Blender without arguments for us would hand over its own.
    return [] if "bpy" in sys.modules and not sys.argv[0].endswith("run.py") else sys.argv[1:]


if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))
    from mu_addon.cli.main import main

    sys.exit(main(arguments()))
