"""study.toml: the inputs of a study, a table a stage."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ...errors import InputError
from ...meshing.settings import REFINE
from ...reading import file_bytes, parse_toml
from ...run.folder import RUN, FolderLayout
from ...run.inputs import digest
from ...toml_writer import toml_text
from .settings import MESH_CHECK, STAGES, UNDER_PRESSURE

NAME = "study.toml"
# The first line, by which a study's folder is known.
HEADER = "# The inputs of this study; unit.toml and protocol.csv beside it belong to them."
FORMAT = 3
# Files of inputs that a stage's table names, each under the key that names it.
FILES = {
    "unit": "unit.toml",
    "body": "body.obj",
    "protocol": "protocol.csv",
    "obstacles": "obstacles.obj",
}
FILES_OF = {"design": ("unit", "body"), "simulate": ("protocol", "obstacles"), "place": ()}
LAYOUT = FolderLayout(
    NAME,
    HEADER,
    results=(
        "unit.stl",
        "anchors.txt",
        "mesh.vtu",
        "model_a.pvd",
        "model_a",
        "motion.csv",
        "angle.svg",
        "stretch.csv",
        "self_contact.csv",
        "contact.csv",
        "deviation.csv",
        "delta.npz",
        "sensitivity.vtu",
        "signals.csv",
        "paths.csv",
        "report.html",
        "unit.png",
        "unit_alpha[0-9]*.stl",
        "motion",
    ),
    optional=tuple(FILES.values()),
)
# Far more than any study.toml has: a file this long is not one.
_LONGEST = 100_000

Tables = dict[str, dict[str, Any]]


def compose(tables: Mapping[str, Mapping[str, Any]], run: Mapping[str, Any] = MappingProxyType({})) -> str:
    """Text of study.toml with a table a stage, and a table [run] of keys that decide no figure."""
    return toml_text({"format": FORMAT, **tables, **({RUN: run} if run else {})}, HEADER)


def left_out(tables: Mapping[str, Mapping[str, Any]]) -> str:
    """What the figures of a quick ranking leave out, as text; empty for another study.

    tables: of study.toml, by stage.
    """
    motion, ranking = tables.get("simulate", {}), tables.get("place", {})
    if not motion.get(UNDER_PRESSURE.name):
        return ""
    coarse = motion["mesh"]["refine"] < REFINE.default
    unchecked = not ranking.get(MESH_CHECK.name, True)
    words = "under pressure alone", "coarse mesh" * coarse, "no mesh check" * unchecked
    return ", ".join(filter(None, words))


def read(folder: Path) -> Tables | None:
    """The tables of a folder's study.toml by stage, or None without the file.

    Raises InputError for one that cannot be used, or that another version of this program wrote.
    """
    path = folder / NAME
    if not path.is_file():
        return None
    return parse(_text(path), folder)


def read_run(folder: Path) -> dict[str, Any]:
    """The table [run] of a folder's study.toml; empty without it. Raises InputError."""
    found = parse_toml(_text(folder / NAME), str(folder / NAME)).get(RUN, {})
    if not isinstance(found, dict):
        raise InputError(f"{RUN} is not a table", str(folder / NAME), f"write it as [{RUN}]")
    return found


def _text(path: Path) -> str:
    try:
        with path.open(encoding="utf-8-sig") as stream:
            text = stream.read(_LONGEST + 1)
    except OSError as error:
        raise InputError(
            f"cannot read the study: {error.strerror or error}", str(path), "check the folder"
        ) from error
    except UnicodeDecodeError as error:
        raise InputError("this is not UTF-8 text", str(path), "choose another folder") from error
    if len(text) > _LONGEST:
        raise InputError(
            f"more than {_LONGEST} characters are too long for a study.toml",
            str(path),
            "choose another folder",
        )
    return text


def parse(text: str, folder: Path) -> Tables:
    """Tables of the text of a folder's study.toml by stage; raises InputError."""
    where = str(folder / NAME)
    document = parse_toml(text, where, "choose another folder")
    found = document.pop("format", None)
    document.pop(RUN, None)
    if found != FORMAT or isinstance(found, bool):
        newer = isinstance(found, int) and not isinstance(found, bool) and found > FORMAT
        raise InputError(
            f"study.toml is of format {found!r}, and this version reads {FORMAT}",
            where,
            "use the newer version that wrote it" if newer else "run its unit again in another folder",
        )
    stages = STAGES[: len(document)]
    if set(document) != set(stages) or not document:
        raise InputError(
            f"the tables [{'], ['.join(map(str, document))}] are not those of a study",
            where,
            f"the tables are [{'], ['.join(STAGES)}], each with those before it",
        )
    for stage in stages:
        if not isinstance(document[stage], dict):
            raise InputError(f"{stage} is not a table", where, f"write it as [{stage}]")
        for key in FILES_OF[stage]:
            # A name that leads elsewhere is not followed: each file has its one place.
            if document[stage].get(key, FILES[key]) != FILES[key]:
                raise InputError(
                    f"{key} = {document[stage][key]!r} is not in the folder", where, f'write "{FILES[key]}"'
                )
    return {stage: document[stage] for stage in stages}


def holds(folder: Path, tables: Mapping[str, Mapping[str, Any]]) -> dict[str, str] | None:
    """Texts of the files that some stages' tables name, by name, or None where one has changed."""
    texts = {}
    for stage, values in tables.items():
        for key in FILES_OF[stage]:
            if key in values:
                try:
                    texts[FILES[key]] = file_bytes(folder / FILES[key]).decode("utf-8")
                except (OSError, UnicodeDecodeError):
                    return None
                if digest(texts[FILES[key]]) != values.get(f"{key}_sha256"):
                    return None
    return texts
