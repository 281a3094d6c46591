"""Limits of a printer and its resin, with their sources, from assets/printers/*.toml."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import attrs

from ...errors import InputError
from ...reading import read_text
from ...toml_writer import Commented, toml_text
from ..assets import asset_file, asset_names
from ..settings import PRINTER
from ..toml_text import parse, place

DEFAULT = PRINTER.default
MEANING = {
    "build_x_mm": "size of the build volume along x",
    "build_y_mm": "size of the build volume along y",
    "build_z_mm": "height of the build volume above the platform",
    "support_mm": "height that supports and raft lift the part above the platform",
    "layer_mm": "height of a layer",
    "layer_s": "time that a layer takes in s",
    "solid_mm": "thinnest solid",
    "wall_mm": "thinnest wall between a chamber and the outside",
    "strut_mm": "thinnest strut",
    "gap_mm": "narrowest gap between two surfaces",
    "well_width_mm": "narrowest engraved detail",
    "well_depth_mm": "shallowest engraved detail",
    "drain_diameter_mm": "narrowest opening that drains a chamber",
    "leak_diameter_mm": "smallest hole that stays open",
    "overhang_deg": "flattest slope that needs no support, from level",
    "overhang_mm": "longest unsupported overhang",
    "bridge_mm": "longest span between two supports",
    "cup_ml": "largest volume sealed against the film",
    "density_g_per_ml": "density of the cured resin",
}


@attrs.frozen
class Limit:
    """Limit of a printer with a resin, and its source: assumed, measured or published.

    The value's unit is the end of the limit's name in MEANING.
    """

    value: float
    source: str
    assumed: bool
    measured: bool = False

    @property
    def standing(self) -> str:
        """Basis of the value, in a word."""
        return "measured" if self.measured else "assumed" if self.assumed else "published"


@attrs.frozen
class Printer:
    """A printer with a resin and a layer height; limits by the names of MEANING, which end with their units.

    `printer[name]` is a limit's value.
    """

    name: str
    title: str
    limits: dict[str, Limit]

    def __getitem__(self, name: str) -> float:
        return self.limits[name].value

    def with_limits(self, limits: dict[str, Limit]) -> Printer:
        """The printer with some limits replaced, by name."""
        return attrs.evolve(self, limits={**self.limits, **limits})

    @property
    def room(self) -> tuple[float, float, float]:
        """Sizes in mm of the room for the part itself: the build volume less the height of its supports."""
        return self["build_x_mm"], self["build_y_mm"], self["build_z_mm"] - self["support_mm"]


def load_printer(name: str = DEFAULT) -> Printer:
    """The shipped printer of this name, or the only one whose name begins so, or the one in a TOML file.

    Raises InputError for an unknown or ambiguous name, and as `read_printer` does.
    """
    if name.endswith(".toml") or "/" in name or "\\" in name:
        return read_printer(name)
    matches = [known for known in asset_names("printers") if known.startswith(name)] if name else []
    found = matches[0] if len(matches) == 1 else name
    return read_printer(asset_file("printers", "printer", found))


def read_printer(path: str | Path) -> Printer:
    """The printer in a TOML file. Raises InputError with file, line or key, and remedy."""
    path = Path(path)
    text = read_text(path, "printer's limits", "check the name")
    of_limit = ("value", "source", "assumed", "measured")
    keys = {"": ("format", "name", "title"), **dict.fromkeys(MEANING, of_limit)}
    document = parse(text, keys, str(path))
    if document.get("format") != 1 or document["format"] is True:
        raise InputError("the printer's file has no format = 1", place(str(path), None), "write format = 1")
    missing = [name for name in MEANING if name not in document]
    if missing:
        raise InputError(
            f"a limit is missing: {missing[0]}, {MEANING[missing[0]]}",
            str(path),
            f"add [{missing[0]}] with value and source, or start from a shipped file",
        )
    limits = {name: _limit(name, document[name], str(path)) for name in MEANING}
    if limits["support_mm"].value >= limits["build_z_mm"].value:
        raise InputError(
            "supports take the whole height of the build volume", f"{path}, [support_mm]", "correct it"
        )
    return Printer(str(document.get("name", path.stem)), str(document.get("title", path.stem)), limits)


def printer_text(printer: Printer) -> str:
    """The printer as TOML text that `read_printer` reads, with the meaning of each limit as comment."""
    values: dict[str, Any] = {"format": 1, "name": printer.name, "title": printer.title}
    for name, limit in printer.limits.items():
        table = {"value": limit.value, "source": limit.source, "assumed": limit.assumed}
        table |= {"measured": True} if limit.measured else {}
        values[name] = Commented(table, (MEANING[name],))
    return toml_text(values)


def _limit(name: str, table: dict[str, object], origin: str) -> Limit:
    value, source = table.get("value"), table.get("source")
    assumed, measured = table.get("assumed", False), table.get("measured", False)
    where = f"{origin}, [{name}]"
    real = isinstance(value, int | float) and not isinstance(value, bool)
    if not real or not math.isfinite(float(value)) or float(value) <= 0.0:  # type: ignore[arg-type]
        raise InputError(f"value = {value!r} is not a number above zero", where, MEANING[name])
    if not isinstance(source, str) or not source.strip():
        raise InputError("the limit has no source", where, 'write source = "where the figure is from"')
    for key, flag in (("assumed", assumed), ("measured", measured)):
        if not isinstance(flag, bool):
            raise InputError(f"{key} = {flag!r} is not true or false", where, "write true or false")
    if assumed and measured:
        raise InputError("the limit is both assumed and measured", where, "leave one of them out")
    return Limit(float(value), source, bool(assumed), bool(measured))  # type: ignore[arg-type]
