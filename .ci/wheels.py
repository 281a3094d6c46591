"""The wheels that the extension's archives hold, each pinned by its SHA-256 in wheels.csv.

    python .ci/wheels.py    pin them anew after a change of the dependencies in pyproject.toml

pip chooses them, dependencies included, without downloading any: the digests are those of its index. What is
downloaded later has to have them, and so has what a built archive holds.
"""

from __future__ import annotations

import csv
import hashlib
import io
import json
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import gmsh_window
import warp_cpu
from slim import differences, slimmed_name

ROOT = Path(__file__).resolve().parents[1]
TABLE = Path(__file__).with_name("wheels.csv")
BLENDERS = {"3.11": ("4.5.0", "5.1.0"), "3.13": ("5.1.0", ""), "3.14": ("5.1.0", "")}
"""The first Blender that has a Python, and the first that has it no more: 3.11 is in Blender 4.5 and 5.0,
3.13 in 5.1 and 5.2, 3.14 in those that Linux distributions build with their own."""
PYTHONS = tuple(BLENDERS)
PLATFORMS = {
    "linux-x64": [f"manylinux_2_{minor}_x86_64" for minor in (28, 27, 24, 17)] + ["manylinux2014_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": [f"macosx_{major}_0_arm64" for major in (15, 14, 13, 12, 11)],
}
LEFT_OUT = ("numpy", "Pygments", "markdown-it-py", "mdurl", "tzdata")
"""numpy is Blender's own; the others are asked for by packages that import them for what is never done here:
coloured listings and Markdown in a terminal (rich, for meshio), names of time zones (dateutil, for
matplotlib)."""
UNAVAILABLE = {"windows-x64": ("pymetis",)}
"""No wheel for a platform; without METIS systems are ordered by minimum degree."""


class Wheel(NamedTuple):
    """One wheel of one platform and Python: package, version, file name and SHA-256."""

    platform: str
    python: str
    name: str
    version: str
    file: str
    sha256: str


def requirements(platform: str) -> list[str]:
    """What the core needs at run time on a platform, pinned as in pyproject.toml."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    left_out = LEFT_OUT + UNAVAILABLE.get(platform, ())
    return [r for r in project["dependencies"] if not r.startswith(left_out)]


def pinned() -> list[Wheel]:
    """Every wheel of wheels.csv."""
    with TABLE.open(newline="", encoding="utf-8") as stream:
        return [Wheel(**row) for row in csv.DictReader(stream)]


def download(folder: Path, platform: str, python: str) -> list[Path]:
    """The pinned wheels of one platform and Python, by pip, which refuses any other content.

    Raises CalledProcessError.
    """
    wanted = [w for w in pinned() if (w.platform, w.python) == (platform, python)]
    found = folder / platform / python
    found.mkdir(parents=True, exist_ok=True)
    listed = found / "requirements.txt"
    listed.write_text("".join(f"{w.name}=={w.version} --hash=sha256:{w.sha256}\n" for w in wanted))
    pip = [*_pip("download", platform, python), "--dest", str(found), "--no-deps", "--require-hashes"]
    subprocess.run([*pip, "-r", str(listed)], check=True)
    return [found / w.file for w in wanted]


def _pip(command: str, platform: str, python: str) -> list[str]:
    """pip's `command` for wheels of a platform and Python that may be another's."""
    tags = [option for tag in [*PLATFORMS[platform], "any"] for option in ("--platform", tag)]
    abis = [option for abi in (f"cp{python.replace('.', '')}", "abi3", "none") for option in ("--abi", abi)]
    kind = ["--only-binary=:all:", "--implementation", "cp", "--python-version", python, *abis, *tags]
    return [sys.executable, "-m", "pip", command, "--quiet", *kind]


def replaced(wheel: Wheel, cuda: bool = False) -> dict[str, str]:
    """SHA-256 of each file of a wheel that the build replaces, by name: two libraries for Linux."""
    if (wheel.platform, wheel.name) == ("linux-x64", "gmsh"):
        return {gmsh_window.FILE: gmsh_window.SHA256}
    if (wheel.platform, wheel.name) == ("linux-x64", "warp-lang") and not cuda:
        return {warp_cpu.FILE: warp_cpu.SHA256}
    return {}


def not_as_pinned(archive: Path, wheels: Iterable[Wheel], folder: Path, cuda: bool = False) -> list[str]:
    """What is wrong with the wheels of a built archive: other content, one too many, one that is missing.

    folder: of the downloads; a slimmed wheel is compared file by file with the pinned one that lies there.
    cuda: whether Warp's wheel keeps its library with CUDA.
    """
    expected = {f"wheels/{slimmed_name(w.file)}": w for w in wheels}
    with zipfile.ZipFile(archive) as package:
        found = {n for n in package.namelist() if n.startswith("wheels/") and not n.endswith("/")}
        wrong = [f"{name} is not pinned in {TABLE.name}" for name in sorted(found - expected.keys())]
        wrong += [f"{name} is missing" for name in sorted(expected.keys() - found)]
        for name in sorted(found & expected.keys()):
            pin, content = expected[name], package.read(name)
            if name != f"wheels/{pin.file}":
                original = (folder / pin.platform / pin.python / pin.file).read_bytes()
                with (
                    zipfile.ZipFile(io.BytesIO(content)) as made,
                    zipfile.ZipFile(folder / pin.platform / pin.python / pin.file) as source,
                ):
                    wrong += [f"{name}: {what}" for what in differences(made, source, replaced(pin, cuda))]
                content = original
            if hashlib.sha256(content).hexdigest() != pin.sha256:
                wrong.append(f"{name} has another SHA-256 than pinned")
    return wrong


def _chosen(platform: str, python: str) -> list[Wheel]:
    """The wheels that pip would install now; raises CalledProcessError."""
    with tempfile.TemporaryDirectory() as scratch:
        report = Path(scratch) / "report.json"
        options = ["--dry-run", "--ignore-installed", "--target", scratch, "--report", str(report)]
        subprocess.run([*_pip("install", platform, python), *options, *requirements(platform)], check=True)
        installed = json.loads(report.read_text(encoding="utf-8"))["install"]
    return [
        Wheel(
            platform,
            python,
            item["metadata"]["name"],
            item["metadata"]["version"],
            item["download_info"]["url"].rpartition("/")[2],
            item["download_info"]["archive_info"]["hashes"]["sha256"],
        )
        for item in installed
        if item["metadata"]["name"] not in LEFT_OUT
    ]


def main() -> int:
    """Write wheels.csv anew."""
    wheels = [w for platform in PLATFORMS for python in PYTHONS for w in _chosen(platform, python)]
    with TABLE.open("w", newline="", encoding="utf-8") as stream:
        rows = csv.writer(stream, lineterminator="\n")
        rows.writerow(Wheel._fields)
        rows.writerows(sorted(wheels))
    return 0


if __name__ == "__main__":
    sys.exit(main())
