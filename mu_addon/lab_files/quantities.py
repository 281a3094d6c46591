"""What a column of a test machine's file holds: quantity and unit, by its name and the row of units."""

from __future__ import annotations

import re
import unicodedata

import attrs

from ..measured.kinds import CONVERTED, UNITS

# Names of units beyond those that measured data are read in, by the unit that these are read in, and how much
# of it is one of them. The pound-force is exactly 4.4482216152605 N, the inch 25.4 mm.
_INCH, _POUND = 25.4, 4.4482216152605
_SPELT: dict[str, dict[str, float]] = {
    "s": {"sec": 1.0, "secs": 1.0, "second": 1.0, "seconds": 1.0, "sek": 1.0, "h": 3600.0},
    "mm": {"in": _INCH, "inch": _INCH, "inches": _INCH, "\u00b5m": 1e-3, "\u03bcm": 1e-3},
    "N": {"lbf": _POUND, "lb": _POUND, "kgf": 9.80665, "gf": 9.80665e-3},
    "kPa": {
        "N/mm2": 1e3,
        "N/mm\u00b2": 1e3,
        "N/mm^2": 1e3,
        "GPa": 1e6,
        "ksi": 1e3 * CONVERTED["kPa"]["psi"],
        "hPa": 0.1,
    },
    "deg": {"\u00b0": 1.0, "degree": 1.0, "degrees": 1.0, "grad": 1.0},
    "": {"%": 1e-2, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "1": 1.0},
    "V": {"volt": 1.0, "volts": 1.0},
    "mm3": {"mm\u00b3": 1.0, "mm^3": 1.0, "cm\u00b3": 1e3, "cc": 1e3, "\u00b5l": 1.0, "\u03bcl": 1.0},
    "g": {},
}
_UNITS = {
    name.casefold(): (read, factor)
    for read, names in _SPELT.items()
    for name, factor in {**({read: 1.0} if read else {}), **CONVERTED[read], **names}.items()
}
# These differ by their case alone.
_BY_CASE = {
    "mN": ("N", 1e-3),
    "MN": ("N", 1e6),
    "mPa": ("kPa", 1e-6),
    "MPa": ("kPa", 1e3),
    "M": None,
    "S": None,
}

# Words of columns' names in English, German, French, Italian, Spanish and Polish, the more particular first.
_WORDS: tuple[tuple[str, str], ...] = (
    ("orientation", r"orientation|\bpose\b|\broll\b|\blage\b|orientacja|orientamento|orientacion"),
    ("angle", r"angle|winkel|angolo|angulo|\bkat\b|biegewinkel"),
    ("strain", r"strain|dehnung|stauchung|allongement relatif|odksztalcenie|deformacion unitaria"),
    ("stress", r"stress|druckspannung|zugspannung|spannung|contrainte|sforzo|esfuerzo|naprezenie"),
    ("pressure", r"pressure|\bdruck\b|uberdruck|innendruck|pression|pressione|presion|cisnienie"),
    ("force", r"force|\bload\b|kraft|\blast\b|charge\b|forza|carico|fuerza|carga|\bsila\b"),
    ("time", r"time|zeit|\btemps\b|tempo|tiempo|\bczas\b|elapsed"),
    ("volume", r"volume|volumen|objetosc|\binfused\b|dispensed"),
    ("tip_deflection", r"tip.deflection"),
    ("added_mass", r"added.mass|zusatzmasse"),
    (
        "displacement",
        r"extension|displacement|standardweg|\bweg\b|verschiebung|deplacement|spostamento|desplazamiento|"
        r"przemieszczenie|stroke|\bhub\b|course|corsa|travel|verformung|deformation|deflection",
    ),
    ("position", r"position|crosshead|traverse|traversenweg"),
    ("voltage", r"voltage|photodiode|\bled\b|signal|\bspannung\b|tension"),
    ("count", r"\bnr\b|\bno\b|number|index|count|cycle|zyklus|schritt|\bstep\b|point"),
)
# What a quantity is read in; a machine's position is a displacement, a count is nothing that is read.
READ_IN = {**UNITS, "position": "mm", "count": ""}
# Never concluded from a unit: there is a more usual quantity of it.
_ONLY_BY_NAME = ("angle_sd", "stress_sd", "orientation")
_BRACKETED = re.compile(r"^(.*?)\s*(?:\(([^()]*)\)|\[([^\[\]]*)\]|/\s*([^\s()]+)|,\s*([^\s,]+))\s*$")


@attrs.frozen
class Column:
    """What a column holds.

    title: as the file has it; quantity: a name of `measured.kinds.UNITS`, "position", "count", or "" where it
    is not known; unit: as the file has it, "" without one; factor: how much of the unit that is read is one
    of it, None where the unit is not given or not known.
    """

    title: str
    quantity: str
    unit: str
    factor: float | None


def column(title: str, unit: str = "") -> Column:
    """What a column of this title, and this cell in the row of units, holds."""
    name = title
    if not unit:
        name, unit = _apart(title)
    unit = unit.strip().strip("()[]").strip()
    known = unit_of(unit) if unit else None
    quantity = _named(name, known[0] if known else None)
    if not quantity and known:
        # A unit that only one quantity has names it.
        fit = [q for q, read in UNITS.items() if read == known[0] and q not in _ONLY_BY_NAME and known[0]]
        quantity = fit[0] if len(fit) == 1 else ""
    if known and quantity and READ_IN[quantity] != known[0]:
        return Column(title, quantity, unit, None)
    if quantity == "strain" and not unit:
        return Column(title, quantity, "", None)
    return Column(title, quantity, unit, known[1] if known else None)


def unit_of(text: str) -> tuple[str, float] | None:
    """The unit that is read in place of this one, and how much of it is one of it; None for no unit."""
    text = unicodedata.normalize("NFC", text.strip().strip("()[]").strip())
    if text in _BY_CASE:
        return _BY_CASE[text]
    return _UNITS.get(text.casefold())


def is_unit(cell: str) -> bool:
    """Whether a cell holds the name of a unit and nothing else."""
    return unit_of(cell) is not None


def plain(text: str) -> str:
    """Text in small letters without accents."""
    text = text.replace("\u0142", "l").replace("\u0141", "L").replace("\u00df", "ss")
    decomposed = unicodedata.normalize("NFKD", text)
    return "".join(c for c in decomposed if not unicodedata.combining(c)).casefold()


def _apart(title: str) -> tuple[str, str]:
    """A title's name and unit, as in "Load (N)", "Force [kN]", "Kraft / N", "Time, s" and "force_N"."""
    match = _BRACKETED.match(title)
    if match:
        unit = next(group for group in match.groups()[1:] if group is not None)
        if is_unit(unit):
            return match[1], unit
    head, _, tail = title.rpartition("_")
    if head and is_unit(tail):
        return head, tail
    return title, ""


def _named(name: str, unit: str | None) -> str:
    """The quantity that a name says, of those that have this unit where it is known; "" for none."""
    words = plain(name).replace("_", " ")
    if words.strip() == "t" and unit in (None, "s"):
        return "time"
    for quantity, pattern in _WORDS:
        if re.search(pattern, words) and (unit is None or READ_IN[quantity] == unit):
            return quantity
    return ""
