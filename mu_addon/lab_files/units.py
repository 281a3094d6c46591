"""Units in a test machine's file: their names, in any spelling, and the unit that each is read in."""

from __future__ import annotations

import re
import unicodedata

from ..measured.kinds import CONVERTED, UNITS

# Names of units beyond those that measured data are read in, by the unit that these are read in and how much
# of it is one of them. The pound-force is exactly 4.4482216152605 N, the inch 25.4 mm.
_INCH, _POUND, _KILOPOND = 25.4, 4.4482216152605, 9.80665
_SPELT: dict[str, dict[float, str]] = {
    "s": {
        # Times of day of two parts are read as hours and minutes.
        1.0: "sec secs second seconds segundo segundos seg secondes secondi sek sekunden sekunder \u0441 "
        "\u0441\u0435\u043a \u79d2 \ucd08 h:min hh:mm",
        1e-3: "msec millis millisecond milliseconds milisegundos millisekunden \u043c\u0441",
        1e-6: "\u00b5s \u03bcs usec micros microsecond microseconds",
        1e-9: "ns",
        60.0: "mins minute minutes minuten minutos minuti",
        3600.0: "h hr hrs hour hours stunden horas heures ore",
        86400.0: "d day days",
        1.0 / 60.0: "min:s mm:ss",
    },
    "mm": {
        1.0: "millimeter millimeters millimetre millimetres milimetros millimetri \u043c\u043c",
        1e-3: "\u00b5m \u03bcm micron microns \u043c\u043a\u043c",
        1e-6: "nm",
        10.0: "\u0441\u043c",
        _INCH: "in inch inches",
        _INCH / 1000.0: "mil mils thou",
        12.0 * _INCH: "ft",
    },
    "N": {
        1.0: "newton newtons newtones \u043d",
        1e-2: "cn",
        10.0: "dan",
        1e3: "\u043a\u043d",
        _POUND: "lbf lb lbs pound pounds",
        _POUND / 16.0: "ozf",
        _KILOPOND: "kgf kp \u043a\u0433\u0441",
        _KILOPOND / 1000.0: "gf grf gram-force grams-force",
    },
    "kPa": {
        1.0: "\u043a\u043f\u0430 kilopascal kilopascals kilopascales",
        1e-3: "N/m2 N/m\u00b2 N/m^2 \u043f\u0430 pascal pascals pascales",
        1e3: "N/mm2 N/mm\u00b2 N/mm^2 \u043c\u043f\u0430 megapascal megapascals",
        1e6: "kN/mm2 kN/mm\u00b2 kN/mm^2 GPa",
        0.1: "millibar hPa",
        10.0 * _KILOPOND: "kgf/cm2 kgf/cm\u00b2 kg/cm2 kg/cm\u00b2",
        101.325: "atm",
        101.325 / 760.0: "mmHg Torr",
        _INCH * 101.325 / 760.0: "inHg",
        0.00980665: "mmH2O mmWC mmWS",
        0.0980665: "cmH2O cmWC cmWS",
        _INCH * 0.00980665: "inH2O",
        1e3 * CONVERTED["kPa"]["psi"]: "ksi",
    },
    "deg": {1.0: "\u00b0 \u00ba degree degrees grad grados gradi degres"},
    "": {
        1.0: "mm/mm m/m in/in 1 -",
        1e-2: "%",
        1e-6: "\u00b5\u03b5 \u03bc\u03b5 ue microstrain \u00b5m/m \u03bcm/m",
    },
    "V": {1.0: "volt volts \u0432"},
    "mm3": {1.0: "mm\u00b3 mm^3 \u00b5l \u03bcl", 1e3: "cm\u00b3 cc cm^3"},
    "g": {1.0: "gram grams gramm", 28.349523125: "oz"},
}
_UNITS = {
    unicodedata.normalize("NFC", name).casefold(): (read, factor)
    for read, spelt in _SPELT.items()
    for names in (
        {read: 1.0} if read else {},
        CONVERTED[read],
        {n: f for f, s in spelt.items() for n in s.split()},
    )
    for name, factor in names.items()
}
# These differ from others by their case alone.
_BY_CASE = {"MN": ("N", 1e6), "mPa": ("kPa", 1e-6), **dict.fromkeys(("M", "S", "v", "H", "Nm"))}
# Units that quantities are read in; a count is not read.
READ_IN = {**UNITS, "position": "mm", "stretch": "", "count": ""}

# A unit of pressure with the zero it counts from, such as psia, bar(g) and kPa abs.
REFERENCE = re.compile(
    r"(psi|m?bar|[kmh]?pa|torr|atm|(?:mm|in)hg|[mci][mn]h2o)[ _]?[(\[]?(a|abs\.?|absolute?|g|ga|gauge)[)\]]?"
)


def plain(text: str) -> str:
    """Text in small letters without accents."""
    text = text.replace("\u0142", "l").replace("\u0141", "L").replace("\u00df", "ss").replace("\u00f8", "o")
    decomposed = unicodedata.normalize("NFKD", text.replace("\u0131", "i"))
    return "".join(c for c in decomposed if not unicodedata.combining(c)).casefold()


def unit_of(text: str) -> tuple[str, float] | None:
    """The unit that is read in place of this one, and the factor to it; None for no unit."""
    text = unicodedata.normalize("NFC", text.strip().strip("()[]{}").strip())
    if text in _BY_CASE:
        return _BY_CASE[text]
    if match := REFERENCE.fullmatch(text.casefold()):
        return unit_of(text[: match.end(1)])
    return _UNITS.get(text.casefold()) or _UNITS.get(
        plain(text).removesuffix(".") if text[:-1].isalpha() else ""
    )


def known_in(quantity: str, text: str) -> float | None:
    """Factor from a unit to that in which a quantity is read, None for the unit of another quantity.

    A force in g or kg is the weight of that mass.
    """
    known = unit_of(text) if text else None
    if known and quantity == "force" and known[0] == "g":
        return known[1] * _KILOPOND / 1000.0
    return known[1] if known and known[0] == READ_IN[quantity] else None


def is_unit(cell: str) -> bool:
    """Return True if a cell is the name of a unit."""
    return unit_of(cell) is not None
