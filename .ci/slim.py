"""Wheels without what no module imports: tests, examples, manuals, headers, sources of compiled code.

A slimmed wheel is made from the pinned one and no other: every file that stays is the same to the byte, but
for the list of files (RECORD), the build tag in WHEEL, and libraries for Linux: all without what no loader
reads (elf.py), cvxopt's without ATLAS, of which OpenBLAS has every name, Warp's without CUDA (warp_cpu.py),
gmsh's without its window (gmsh_window.py). Of modules only those are left out that their package does without
where it is built so: cvxopt's four, which its own build leaves out unless asked, and Pillow's AVIF. Another
extension that bundles the whole wheel gets it (BUILD); licences stay. `sbom.cdx.json` names the wheel that it
was made from, with its SHA-256, and what was left out or replaced.

Large files are compressed by LZMA, which takes a third less than deflate: Blender builds its Python with it
on every system.
"""

from __future__ import annotations

import base64
import csv
import hashlib
import io
import zipfile
from collections.abc import Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import NamedTuple

import elf

_ASKED_FOR = ("dsdp", "fftw", "glpk", "gsl")
_DOUBLED = "cvxopt.libs/libsatlas-*", "cvxopt.libs/libopenblas*"
"""A library whose every name the second has, too, which is loaded first: the loader takes it from there."""
PARTS = {
    "contourpy": (),
    # With the libraries that no other module asks for.
    "cvxopt": (
        *(f"cvxopt/{name}.*" for name in _ASKED_FOR),
        *(f"cvxopt.libs/lib{name}*" for name in (*_ASKED_FOR, "gmp-")),
        _DOUBLED[0],
    ),
    # Every compiled module has its source in Python beside it, which takes its place.
    "fonttools": tuple(f"fontTools/*.{ending}" for ending in ("c", "pyx", "pxd", "so", "pyd")),
    "gmsh": (
        "gmsh-*.data/data/share/doc/*",
        "gmsh-*.data/data/include/*",
        "gmsh-*.data/data/lib/gmsh.jl",
    ),
    "ipctk": ("ipc/*.cpp", "ipc/*.hpp", "ipc/*.tpp"),
    "kiwisolver": (),
    "manifold3d": (),
    "matplotlib": ("*/tests/*", "matplotlib/mpl-data/sample_data/*"),
    "pillow": ("PIL/_avif.*", "pillow.libs/libavif-*", "PIL/.dylibs/libavif.*"),
    "pymetis": (),
    "python_calamine": (),
    "pytetwild": (),
    "scipy": ("*/tests/*", "*.pyx", "*.pxd"),
    "warp_lang": ("warp/tests/*", "warp/examples/*", "warp/native/*.cpp", "warp/native/*.cu"),
}
"""The wheels that are made anew, and what is left out of each; `*` stands for folders, too."""
LEGAL = ("licen", "copying", "notice", "credits")
"""A file with one of these in its name stays."""
SMALL = 4096
"""Bytes of a file below which deflate compresses as well as LZMA."""
BUILD = "0slim"
"""Build tag in the name of a slimmed wheel: of two wheels of one version, Blender takes the one without."""


class Slimmed(NamedTuple):
    """A wheel that was slimmed: its name, the wheel it was made from, what was left out and replaced,
    and how many of its libraries are without what no loader reads."""

    name: str
    original: str
    sha256: str
    patterns: tuple[str, ...]
    files: int
    bytes: int
    replaced: tuple[str, ...] = ()
    shortened: int = 0


def slimmed_name(name: str) -> str:
    """Name of the wheel that is made from one of that name; the same where nothing is left out of it."""
    package, *rest = name.split("-", 2)
    return "-".join([package, rest[0], BUILD, rest[1]]) if package.lower() in PARTS else name


def slim(
    wheel: Path, folder: Path, replaced: Mapping[str, bytes] | None = None
) -> tuple[Path, Slimmed | None]:
    """Make the slimmed wheel of a pinned one in `folder`; the wheel itself and None where it stays whole.

    replaced: other content of files, by name. Equal wheels give equal bytes. Raises RuntimeError where a
    library asks for one that is left out.
    """
    replaced = replaced or {}
    patterns = PARTS.get(wheel.name.split("-")[0].lower())
    if patterns is None:
        return wheel, None
    folder.mkdir(parents=True, exist_ok=True)
    made = folder / slimmed_name(wheel.name)
    beside = made.with_suffix(".part")
    with zipfile.ZipFile(wheel) as source, zipfile.ZipFile(beside, "w") as target:
        left_out = [i for i in source.infolist() if _left_out(i.filename, patterns)]
        names = {i.filename for i in left_out}
        shortened = _shortened(source, names, replaced)
        changed = {**replaced, **shortened, **_changed(source, names, {**replaced, **shortened})}
        for info in source.infolist():
            if info.filename not in names:
                content = changed.get(info.filename) or source.read(info)
                method = zipfile.ZIP_LZMA if len(content) > SMALL else zipfile.ZIP_DEFLATED
                target.writestr(info, content, method)
    beside.replace(made)
    digest = hashlib.sha256(wheel.read_bytes()).hexdigest()
    size = sum(i.file_size for i in left_out)
    told = patterns, len(left_out), size, tuple(replaced), len(shortened)
    return made, Slimmed(made.name, wheel.name, digest, *told)


def differences(
    made: zipfile.ZipFile, original: zipfile.ZipFile, replaced: Mapping[str, str] | None = None
) -> list[str]:
    """What a slimmed wheel has otherwise than PARTS says: a file too many or too few, other content.

    replaced: SHA-256 of each file that is another than in the original, by name.
    """
    replaced = replaced or {}
    package = Path(str(original.filename)).name.split("-")[0].lower()
    expected = {n for n in original.namelist() if not _left_out(n, PARTS.get(package, ()))}
    names = set(made.namelist())
    gone = set(original.namelist()) - expected
    wrong = [f"{name} was added" for name in sorted(names - expected)]
    wrong += [f"{name} was lost" for name in sorted(expected - names)]
    own = _own(original)
    for name in sorted(names & replaced.keys()):
        if hashlib.sha256(made.read(name)).hexdigest() != replaced[name]:
            wrong.append(f"{name} has another SHA-256 than pinned")
    for name in sorted(names & expected - set(own) - replaced.keys()):
        if made.read(name) != elf.loaded(_without(original, name, original.read(name), gone)):
            wrong.append(f"{name} was changed")
    return wrong


def _left_out(name: str, patterns: tuple[str, ...]) -> bool:
    if any(word in name.rpartition("/")[2].lower() for word in LEGAL):
        return False
    return any(fnmatchcase(name, pattern) for pattern in patterns)


def _shortened(
    source: zipfile.ZipFile, left_out: set[str], replaced: Mapping[str, bytes]
) -> dict[str, bytes]:
    """Libraries without what no loader reads, by name, where that makes them smaller.

    Raises RuntimeError where one that stays asks for one that is left out.
    """
    made = {}
    for name in source.namelist():
        if ".so" not in name or name in left_out or name in replaced:
            continue
        content = source.read(name)
        shorter = elf.loaded(_without(source, name, content, left_out))
        if shorter != content:
            made[name] = shorter
    return made


def _without(source: zipfile.ZipFile, name: str, content: bytes, left_out: set[str]) -> bytes:
    """A library that asks for none of those left out: one of them may go whose names another has, too."""
    asked = set(elf.libraries(content))
    gone = {one for one in left_out if one.rpartition("/")[2] in asked}
    if not gone:
        return content
    doubled, other = ({one for one in source.namelist() if fnmatchcase(one, pattern)} for pattern in _DOUBLED)
    if gone <= doubled:
        wanted = {symbol.name for symbol in elf.symbols(content) if not symbol.defined}
        lost, there = (set[str]().union(*(elf.exported(source.read(x)) for x in y)) for y in (gone, other))
    if not gone <= doubled or wanted & lost - there:
        raise RuntimeError(f"{name} asks for {min(gone)}, which is left out (slim.py)")
    return elf.struck(content, {one.rpartition("/")[2] for one in gone})


def _own(package: zipfile.ZipFile) -> tuple[str, str]:
    """Names of a wheel's own RECORD and WHEEL."""
    (record,) = (n for n in package.namelist() if n.count("/") == 1 and n.endswith(".dist-info/RECORD"))
    return record, record.removesuffix("RECORD") + "WHEEL"


def _changed(source: zipfile.ZipFile, left_out: set[str], replaced: Mapping[str, bytes]) -> dict[str, bytes]:
    """RECORD without what is left out and with what is replaced, and WHEEL with the build tag."""
    record, wheel = _own(source)
    lines = source.read(wheel).decode().rstrip("\n").splitlines()
    tagged = (
        "\n".join([*(x for x in lines if not x.startswith("Build:")), f"Build: {BUILD}"]) + "\n"
    ).encode()
    new = {**replaced, wheel: tagged}
    rows = io.StringIO()
    write = csv.writer(rows, lineterminator="\n").writerow
    for row in csv.reader(io.StringIO(source.read(record).decode())):
        if row and row[0] in new:
            content = new[row[0]]
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            write([row[0], f"sha256={digest}", len(content)])
        elif row and row[0] not in left_out:
            write(row)
    return {record: rows.getvalue().encode(), wheel: tagged}
