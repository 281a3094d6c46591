"""Build the Blender extension, with Blender's own tool as it ships in the bpy wheel.

    python .ci/extension.py FOLDER            check it and write its .zip, without wheels
    python .ci/extension.py FOLDER --bundle   one .zip a platform and Python with its wheels inside, and
                                              index.json: FOLDER can then be hosted as it is
    python .ci/extension.py FOLDER --bundle --cuda   the same with CUDA in Warp, for a folder of its own
    python .ci/extension.py FOLDER --install  install bpy into this Python first, where it is missing

The tool needs bpy, which a plain `pip install -e .` leaves out: without it this says so before any work.
Beside them it puts sample.blend and sample-NAME.blend, the sample scenes.

Blender wants the manifest beside the package's `__init__.py`; the checkout keeps them apart so that the core
is an ordinary package. What ships is copied together first. Wheels come from pip, each with the SHA-256 that
wheels.csv pins, and are kept in FOLDER/wheels; large ones are slimmed (slim.py). numpy is never among them:
Blender has its own and a second one would replace it. For Linux, Warp's library is compiled without its CUDA
part, 114 MB of the archive (warp_cpu.py), and gmsh's asks for no library of its window (gmsh_window.py).
sbom.cdx.json in the archive lists what it holds.
"""

from __future__ import annotations

import argparse
import importlib.util
import shutil
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

import gmsh_window
import warp_cpu
from bill import write_bill
from slim import Slimmed, slim
from wheels import BLENDERS, PLATFORMS, PYTHONS, Wheel, download, not_as_pinned, pinned, replaced

ROOT = Path(__file__).resolve().parents[1]


def blender_ext() -> Path | None:
    """Blender's own extension tool as shipped in the bpy wheel, or None where bpy is not installed."""
    spec = importlib.util.find_spec("bpy")
    if spec is None or spec.origin is None:
        return None
    # __init__.py lies in the version's scripts/modules/bpy in some wheels, at the package's top in others.
    for folder in Path(spec.origin).parents:
        for pattern in (
            "*/scripts/addons_core/bl_pkg/cli/blender_ext.py",
            "addons_core/bl_pkg/cli/blender_ext.py",
        ):
            found = next(folder.glob(pattern), None)
            if found is not None:
                return found
        if folder.name == "site-packages":
            break
    return None


def missing_bpy(folder: Path) -> str:
    """What to do where bpy is not installed: one command."""
    name, marker = bpy_requirement()
    lack = f"{name} is not installed here, and Blender's extension tool comes with it"
    if not wheels_fit():
        return f"{lack}; its wheels are for Python {marker}, which this is not: use python{marker}"
    return f"{lack} (some 330 MB); install it and build: python .ci/extension.py {folder} --install"


def bpy_requirement() -> tuple[str, str]:
    """bpy as pyproject.toml pins it, and the Python that its wheels are for."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (line,) = (r for r in project["optional-dependencies"]["blender"] if r.startswith("bpy"))
    name, _, marker = line.partition(";")
    return name.strip(), marker.split("'")[1]


def wheels_fit() -> bool:
    """Whether bpy's wheels are for this Python."""
    return f"{sys.version_info.major}.{sys.version_info.minor}" == bpy_requirement()[1]


def install_bpy() -> bool:
    """Install the checkout with bpy into this Python; whether it worked. pip says what went wrong."""
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "-e", f"{ROOT}[blender]"]
    done = subprocess.run(pip, check=False).returncode == 0
    importlib.invalidate_caches()
    return done


def stage(folder: Path) -> None:
    """Copy what ships into `folder`, which must not exist yet."""
    shutil.copytree(ROOT / "mu_addon", folder, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("blender_manifest.toml", "LICENSE"):
        shutil.copy(ROOT / name, folder)
    if (ROOT / "assets").is_dir():
        shutil.copytree(ROOT / "assets", folder / "assets")


def bundle(source: Path, wheels: list[Path], platform: str, python: str) -> None:
    """Put wheels into a staged extension, and name them, platform and Blender's versions in its manifest."""
    (source / "wheels").mkdir()
    for wheel in wheels:
        shutil.copy(wheel, source / "wheels")
    listed = "".join(f'  "./wheels/{name}",\n' for name in sorted(wheel.name for wheel in wheels))
    first, end = BLENDERS[python]
    manifest = source / "blender_manifest.toml"
    head, permissions, rest = manifest.read_text(encoding="utf-8").partition("[permissions]")
    lines = [
        f'blender_version_min = "{first}"' if line.startswith("blender_version_min") else line
        for line in head.splitlines()
    ]
    lines += [f'blender_version_max = "{end}"'] if end else []
    head = "\n".join([*lines, f'platforms = ["{platform}"]', f"wheels = [\n{listed}]"])
    manifest.write_text(f"{head}\n\n{permissions}{rest}", encoding="utf-8")


def made_anew(file: str, wheel: Path, folder: Path) -> bytes:
    """The library that takes the place of a wheel's own; raises RuntimeError where it is not as pinned."""
    if file == gmsh_window.FILE:
        return gmsh_window.library(wheel)
    return warp_cpu.library(wheel, folder / "warp")


def build(tool: Path, out: Path, platform: str | None = None, python: str = "", cuda: bool = False) -> int:
    """Stage, validate and build one .zip into `out`; the exit status of the first step that fails."""
    slimmed = []
    with tempfile.TemporaryDirectory() as scratch:
        source = Path(scratch) / "mu_addon"
        stage(source)
        target = ["--output-dir", str(out)]
        if platform is not None:
            wanted = [w for w in pinned() if (w.platform, w.python) == (platform, python)]

            def made(pin: Wheel, wheel: Path) -> tuple[Path, Slimmed | None]:
                new = {name: made_anew(name, wheel, out / "wheels") for name in replaced(pin, cuda)}
                return slim(wheel, out / "wheels" / platform / python / "slim", new)

            # LZMA takes a core a wheel, and leaves Python's lock to others. Warp's, the last, takes longest.
            wheels = download(out / "wheels", platform, python)
            with ThreadPoolExecutor() as pool:
                found = [*pool.map(made, wanted[::-1], wheels[::-1])]
            slimmed = [change for _, change in found if change]
            bundle(source, [wheel for wheel, _ in found], platform, python)
            version = tomllib.loads((source / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
            archive = (
                out
                / f"mu_addon-{version}-{platform}-py{python.replace('.', '')}{'-cuda' if cuda else ''}.zip"
            )
            target = ["--output-filepath", str(archive)]
        write_bill(source, slimmed)
        for arguments in (["validate", str(source)], ["build", "--source-dir", str(source), *target]):
            status = subprocess.run([sys.executable, str(tool), *arguments], check=False).returncode
            if status:
                return status
    if platform is not None:
        wrong = not_as_pinned(archive, wanted, out / "wheels", cuda)
        if wrong:
            archive.unlink()
            sys.stderr.write("\n".join(wrong) + "\n")
            return 1
    return 0


def main(arguments: list[str]) -> int:
    """Build what is asked for; the exit status of the first step that fails."""
    parser = argparse.ArgumentParser(description="Build the Blender extension.")
    parser.add_argument("folder", nargs="?", type=Path, default=Path("out"))
    parser.add_argument(
        "--bundle", action="store_true", help="one .zip a platform and Python, wheels inside, and index.json"
    )
    parser.add_argument("--platform", nargs="+", choices=PLATFORMS, default=list(PLATFORMS))
    parser.add_argument("--python", nargs="+", choices=PYTHONS, default=list(PYTHONS))
    parser.add_argument("--cuda", action="store_true", help="keep the CUDA part of Warp's library for Linux")
    parser.add_argument("--install", action="store_true", help="install bpy first, where it is missing")
    options = parser.parse_args(arguments)
    tool = blender_ext()
    if tool is None and options.install and wheels_fit():
        tool = blender_ext() if install_bpy() else None
    if tool is None:
        sys.stderr.write(missing_bpy(options.folder) + "\n")
        return 2
    out = options.folder.resolve()
    out.mkdir(parents=True, exist_ok=True)
    sample = [sys.executable, str(ROOT / ".ci" / "sample.py"), str(out)]
    if subprocess.run(sample, check=False).returncode:
        sys.stderr.write("the sample scenes could not be built\n")
        return 1
    if not options.bundle:
        return build(tool, out)
    for platform, python in product(options.platform, options.python):
        try:
            status = build(tool, out, platform, python, options.cuda)
        except subprocess.CalledProcessError as error:
            sys.stderr.write(f"the wheels of {platform} could not be got as pinned: {error}\n")
            status = 1
        except RuntimeError as error:
            sys.stderr.write(f"{error}\n")
            status = 1
        if status:
            return status
    index = [sys.executable, str(tool), "server-generate", "--repo-dir", str(out)]
    return subprocess.run(index, check=False).returncode


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
