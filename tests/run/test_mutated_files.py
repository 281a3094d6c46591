"""Files of every kind that is read, damaged at random: each is read or refused, and nothing else happens.

The corpus is one sound file of each kind, and in fuzz.zip what a fuzzer found to reach other code
(`python -m benchmarks.fuzz`). `MUTANTS=2000 python -m pytest tests/run/test_mutated_files.py` draws so many
of each; the same numbers give the same files, and `MUTANTS_SEED=2` others.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mu_addon.design.body import read_body
from mu_addon.design.gripper import load_gripper
from mu_addon.design.parameters import load_preset
from mu_addon.design.printing.printer import load_printer
from mu_addon.design.surface import stl_bytes, stl_surface
from mu_addon.errors import InputError
from mu_addon.fem.protocol import Protocol
from mu_addon.files import read_npz, write_npz
from mu_addon.graph.tree_file import read_tree
from mu_addon.grasp import read_phases, shipped_phases
from mu_addon.lab_files.tracked_table import read_pixels
from mu_addon.measured.folder import read_folder
from mu_addon.run.folder import keep_inputs
from mu_addon.sensing.recording import read_recording
from mu_addon.studies.check import Check
from mu_addon.studies.grip import Grip
from mu_addon.studies.homogenize import Homogenize
from mu_addon.studies.inputs import ResinInput
from mu_addon.studies.starting import kind_of
from mu_addon.studies.unit_ranking import UnitStudy

from ..design.test_surface_reading import CORNERS, obj, ply, stl
from .test_reading import READERS

COUNT = int(os.environ.get("MUTANTS", "15"))
SEED = os.environ.get("MUTANTS_SEED", "")
DATA = Path(__file__).parents[1] / "data"
FUZZED = DATA / "fuzz.zip"
STL = stl_bytes(CORNERS.reshape(-1, 3), np.arange(CORNERS.size // 3).reshape(-1, 3))
# Pieces that no sound file has, put in the place of a number or a word, or anywhere.
NASTY = [
    b"nan", b"-inf", b"1e999", b"-1", b"0", b"1e-320", b"9" * 400, b"0x" + b"f" * 400, b"true", b'""', b"[]",
    b"{}", b"[" * 300, b'"', b"'''", b"\0", b"\xff", b"\xef\xbb\xbf", b"\r", b"\n\n", b"\xe2\x80\xae",
    b"\x1b[2J", b",,,", b"1979-05-27T07:32:00Z", b"../../x", b"#", b"4294967296", b"99999999999999999999",
]  # fmt: skip
_WORD = re.compile(rb"[-+.\w]+")


def mutated(random_: random.Random, content: bytes) -> bytes:
    """A file's content with one to four faults in it."""
    changed = bytearray(content)
    for _ in range(random_.randrange(1, 5)):
        place = random_.randrange(len(changed) + 1)
        length = random_.choice((1, 1, 4, 40, 400))
        what = random_.randrange(8)
        if what == 0 and changed:
            changed[min(place, len(changed) - 1)] ^= 1 << random_.randrange(8)
        elif what == 1:
            del changed[place : place + length]
        elif what == 2:
            changed[place:place] = random_.choice(NASTY)
        elif what == 3:
            changed[place : place + length] = random_.randbytes(length)
        elif what == 4:
            # A word or number by another, most of what is wrong in files that people write.
            words = list(_WORD.finditer(changed))
            if words:
                start, end = random_.choice(words).span()
                changed[start:end] = random_.choice([*NASTY, random_.choice(words).group()])
        elif what == 5:
            lines = bytes(changed).splitlines(keepends=True)
            if lines:
                lines.insert(random_.randrange(len(lines)), random_.choice(lines))
                changed = bytearray(b"".join(lines))
        elif what == 6:
            lines = bytes(changed).splitlines(keepends=True)
            random_.shuffle(lines)
            changed = bytearray(b"".join(lines))
        else:
            changed[place:place] = changed[place : place + length]
    return bytes(changed)


def fuzzed(name: str) -> list[bytes]:
    """What the fuzzer found for a reader."""
    with zipfile.ZipFile(FUZZED) as archive:
        names = sorted(member for member in archive.namelist() if member.startswith(f"{name}/"))
        return [archive.read(member) for member in names]


def mutants(name: str, contents: list[bytes]) -> Iterator[bytes]:
    """COUNT mutants, each of one of the contents."""
    for number in range(COUNT):
        random_ = random.Random(f"{name} {SEED} {number}")
        yield mutated(random_, random_.choice(contents))


def npz(folder: Path) -> bytes:
    write_npz(
        folder / "a.npz", {"u": np.arange(300.0).reshape(-1, 3), "name": np.array(["alpha1", "alpha2"])}
    )
    return (folder / "a.npz").read_bytes()


RECORDING = b"time_s,device_s,sequence,light_V\n" + b"".join(b"%f,%f,%d,1.5\n" % (k, k, k) for k in range(20))
INDEX = b'{"type": "recording", "version": 1}\n{"type": "file", "file": "recording-000.csv"}\n'
PIXELS = b"time_s,base right_px,base down_px\n" + b"".join(b"%d,100.5,%d\n" % (k, 50 + k) for k in range(9))

TREE = b"""format = 1
name = "two walls"
[nodes.Unit]
kind = "unit"
[nodes.Thin]
kind = "set_parameter"
at = [300, 0]
[nodes.Thin.settings]
value = 0.7
[nodes.Thin.links]
unit = ["Unit.unit"]
"""


def recording_with(name: str) -> Callable[[Path], Any]:
    """A reader of a recording, one of whose files is the given one."""

    def read(path: Path) -> Any:
        folder = path.parent / "recording"
        folder.mkdir(exist_ok=True)
        for file, content in (("index.ndjson", INDEX), ("recording-000.csv", RECORDING)):
            (folder / file).write_bytes(path.read_bytes() if file == name else content)
        return read_recording(folder)

    return read


# Name of the file, its content, and who reads it.
CORPUS: dict[str, tuple[str, Callable[[Path], bytes], Callable[[Path], Any]]] = {
    name: (f"{name.replace(' ', '-')}.toml", lambda _, text=text: text.encode(), reader)
    for name, (reader, text) in READERS.items()
    if text is not None
}
CORPUS |= {
    "phases": ("phases.csv", lambda _: shipped_phases().text().encode(), read_phases),
    "pixels": ("pixels.csv", lambda _: PIXELS, read_pixels),
    "STL": ("body.stl", lambda _: STL, read_body),
    "STL in text": ("body.stl", lambda _: stl(CORNERS).encode(), read_body),
    "STL to check": ("part.stl", lambda _: STL, lambda path: stl_surface(path.read_bytes())),
    "OBJ": ("body.obj", lambda _: obj().encode(), read_body),
    "PLY": ("body.ply", lambda _: ply(), read_body),
    "PLY of bytes": ("body.ply", lambda _: ply("binary_little_endian"), read_body),
    "NPZ": ("b.npz", npz, read_npz),
    "node tree": ("tree.toml", lambda _: TREE, read_tree),
    "recording": ("recording-000.csv", lambda _: RECORDING, recording_with("recording-000.csv")),
    "index of a recording": ("index.ndjson", lambda _: INDEX, recording_with("index.ndjson")),
}  # fmt: skip


def read_all(reader: Callable[[Path], Any], path: Path) -> int:
    """1 where a file is read, 0 where it is refused with all three words."""
    try:
        reader(path)
    except InputError as error:
        if not all((error.what, error.where, error.remedy)):
            raise AssertionError("an error without its three words") from error
        return 0
    return 1


@pytest.mark.parametrize("name", CORPUS)
def test_a_damaged_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    file, made, reader = CORPUS[name]
    content = made(tmp_path)
    assert (tmp_path / file).write_bytes(content)
    assert read_all(reader, tmp_path / file) == 1, "the corpus is sound"
    found = fuzzed(name)
    for number, made_up in enumerate([*found, *mutants(name, [content, *found])]):
        path = tmp_path / file
        path.write_bytes(made_up)
        try:
            read_all(reader, path)
        except Exception as error:
            raise AssertionError(f"{name}, number {number}: {error!r}") from error


JOBS: dict[str, Any] = {
    "check": Check(printer=load_printer(), unit=load_preset("mu-1.0x")),
    "grip": Grip(gripper=load_gripper("gripper")),
    "homogenize": Homogenize(unit=load_preset("mu-1.0x"), resin=ResinInput().made(("flexible-80a",), {})),
    "place": UnitStudy(
        unit=load_preset("mu-1.0x"), protocol=Protocol(np.arange(3.0), np.array([0.0, -20.0, 40.0]))
    ),
}


@pytest.mark.parametrize("name", ["measured", *JOBS])
def test_a_folder_with_a_damaged_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    folder = tmp_path / "folder"
    reader: Callable[[Path], Any] = read_folder
    if name in JOBS:
        keep_inputs(folder, JOBS[name].texts())
        reader = kind_of(folder).read
    else:
        shutil.copytree(DATA / name, folder)
    files = sorted(p for p in folder.iterdir() if p.suffix in (".toml", ".csv"))
    for path in files:
        content = path.read_bytes()
        for seed in range(COUNT):
            path.write_bytes(mutated(random.Random(f"{name} {path.name} {SEED} {seed}"), content))
            try:
                read_all(reader, folder)
            except Exception as error:
                raise AssertionError(f"{name}, {path.name}, seed {seed}: {error!r}") from error
        path.write_bytes(content)
