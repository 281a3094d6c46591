"""Quantity and unit of a column in a test machine's file, by its name and the row of units."""

from __future__ import annotations

import re
import unicodedata

import attrs

from ..measured.kinds import CONVERTED, UNITS

# Names of units beyond those that measured data are read in, by the unit that these are read in, and how much
# of it is one of them. The pound-force is exactly 4.4482216152605 N, the inch 25.4 mm.
_INCH, _POUND, _KILOPOND = 25.4, 4.4482216152605, 9.80665
_SPELT: dict[str, dict[str, float]] = {
    "s": {
        **dict.fromkeys(
            ("sec", "secs", "second", "seconds", "sek", "sekunden", "\u0441", "\u0441\u0435\u043a"), 1.0
        ),
        **dict.fromkeys(
            ("\u79d2", "\ucd08", "segundos", "segundo", "seg", "secondes", "secondi", "sekunder"), 1.0
        ),
        **dict.fromkeys(
            (
                "msec",
                "millis",
                "millisecond",
                "milliseconds",
                "milisegundos",
                "millisekunden",
                "\u043c\u0441",
            ),
            1e-3,
        ),
        **dict.fromkeys(("\u00b5s", "\u03bcs", "usec", "micros", "microsecond", "microseconds"), 1e-6),
        "ns": 1e-9,
        **dict.fromkeys(("mins", "minute", "minutes", "minuten", "minutos", "minuti"), 60.0),
        **dict.fromkeys(("h", "hr", "hrs", "hour", "hours", "stunden", "horas", "heures", "ore"), 3600.0),
        **dict.fromkeys(("d", "day", "days"), 86400.0),
        # Times of day of two parts are read as the former.
        **dict.fromkeys(("h:min", "hh:mm"), 1.0),
        **dict.fromkeys(("min:s", "mm:ss"), 1.0 / 60.0),
    },
    "mm": {
        **dict.fromkeys(("in", "inch", "inches"), _INCH),
        **dict.fromkeys(("\u00b5m", "\u03bcm", "micron", "microns", "\u043c\u043a\u043c"), 1e-3),
        **dict.fromkeys(
            (
                "millimeter",
                "millimeters",
                "millimetre",
                "millimetres",
                "milimetros",
                "millimetri",
                "\u043c\u043c",
            ),
            1.0,
        ),
        **dict.fromkeys(("mil", "mils", "thou"), _INCH / 1000.0),
        "ft": 12.0 * _INCH,
        "nm": 1e-6,
        "\u0441\u043c": 10.0,
    },
    "N": {
        **dict.fromkeys(("lbf", "lb", "lbs", "pound", "pounds"), _POUND),
        **dict.fromkeys(("kgf", "kp", "\u043a\u0433\u0441"), _KILOPOND),
        **dict.fromkeys(("newton", "newtons", "newtones", "\u043d"), 1.0),
        **dict.fromkeys(("gf", "grf", "gram-force", "grams-force"), _KILOPOND / 1000.0),
        "ozf": _POUND / 16.0,
        "\u043a\u043d": 1e3,
        "dan": 10.0,
        "cn": 1e-2,
    },
    "kPa": {
        **dict.fromkeys(("N/mm2", "N/mm\u00b2", "N/mm^2", "\u043c\u043f\u0430"), 1e3),
        **dict.fromkeys(("kN/mm2", "kN/mm\u00b2", "kN/mm^2", "GPa"), 1e6),
        **dict.fromkeys(("N/m2", "N/m\u00b2", "N/m^2", "\u043f\u0430"), 1e-3),
        **dict.fromkeys(("kgf/cm2", "kgf/cm\u00b2", "kg/cm2", "kg/cm\u00b2"), 10.0 * _KILOPOND),
        **dict.fromkeys(("mmHg", "Torr"), 101.325 / 760.0),
        **dict.fromkeys(("\u043a\u043f\u0430", "kilopascal", "kilopascals", "kilopascales"), 1.0),
        **dict.fromkeys(("pascal", "pascals", "pascales"), 1e-3),
        **dict.fromkeys(("megapascal", "megapascals"), 1e3),
        "millibar": 0.1,
        "atm": 101.325,
        **dict.fromkeys(("mmH2O", "mmWC", "mmWS"), 0.00980665),
        **dict.fromkeys(("cmH2O", "cmWC", "cmWS"), 0.0980665),
        "inH2O": _INCH * 0.00980665,
        "inHg": _INCH * 101.325 / 760.0,
        "ksi": 1e3 * CONVERTED["kPa"]["psi"],
        "hPa": 0.1,
    },
    "deg": dict.fromkeys(("\u00b0", "degree", "degrees", "grad", "grados", "gradi", "degres", "\u00ba"), 1.0),
    "": {
        **dict.fromkeys(("mm/mm", "m/m", "in/in", "1", "-"), 1.0),
        "%": 1e-2,
        **dict.fromkeys(
            ("\u00b5\u03b5", "\u03bc\u03b5", "ue", "microstrain", "\u00b5m/m", "\u03bcm/m"), 1e-6
        ),
    },
    "V": {"volt": 1.0, "volts": 1.0, "\u0432": 1.0},
    "mm3": {
        **dict.fromkeys(("mm\u00b3", "mm^3", "\u00b5l", "\u03bcl"), 1.0),
        **dict.fromkeys(("cm\u00b3", "cc", "cm^3"), 1e3),
    },
    "g": {**dict.fromkeys(("gram", "grams", "gramm"), 1.0), "oz": 28.349523125},
}
_UNITS = {
    unicodedata.normalize("NFC", name).casefold(): (read, factor)
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
    "V": ("V", 1.0),
    "v": None,
    "H": None,
}


# A unit of pressure with the zero it counts from, such as psia, bar(g) and kPa abs, and titles that say so.
_REFERENCE = re.compile(
    r"(psi|m?bar|[kmh]?pa|torr|atm|(?:mm|in)hg|[mci][mn]h2o)[ _]?[(\[]?(a|abs\.?|absolute?|g|ga|gauge)[)\]]?"
)
_ABSOLUTE = re.compile(r"\babsolut\w*|\babs\b|\bgauge (?=press)")


def plain(text: str) -> str:
    """Text in small letters without accents."""
    text = text.replace("\u0142", "l").replace("\u0141", "L").replace("\u00df", "ss").replace("\u00f8", "o")
    decomposed = unicodedata.normalize("NFKD", text.replace("\u0131", "i"))
    return "".join(c for c in decomposed if not unicodedata.combining(c)).casefold()


# Words of columns' names, the more particular first: English, German, French, Italian, Spanish, Portuguese,
# Dutch, Scandinavian, Finnish, Polish, Czech, Hungarian, Turkish, Russian, Chinese, Japanese and Korean.
_WORDS = tuple(
    (quantity, re.compile(plain(pattern)))
    for quantity, pattern in (
        (
            "count",
            r"\brate\b|speed|velocity|geschwindigkeit|vitesse|velocita|velocidad|temperat|\btemp\b|humid|feuchte|"
            r"accel|energy|energie|\bwork\b|modulus|frequen|скорост|温度|速度|온도|속도",
        ),
        ("orientation", r"orientation|\bpose\b|\broll\b|\blage\b|orientacja|orientamento|orientacion"),
        ("angle", r"angle|winkel|angolo|angulo|\bkat\b|hoek|vinkel|kulma|szog|\buhel|\baci\b|угол|角度|각도"),
        ("stretch", r"\bstretch\b|stretch ratio|\blambda ?\d?\b|\u03bb|streckung|streckverhaltnis|etirement"),
        (
            "strain",
            r"strain|dehnung|stauchung|allongement relatif|odksztalcenie|deformacion unitaria|\brek\b|"
            r"tojning|toyning|venyma|deformace|nyulas|sekil degistirme|относительн|应变|ひずみ|歪み|변형률",
        ),
        (
            "stress",
            r"stress|druckspannung|zugspannung|spannung|contrainte|sforzo|esfuerzo|naprezenie|tensao|tensione|tension|"
            r"spanning|spanding|spenning|jannitys|feszultseg|napeti|gerilme|напряжение|应力|応力|응력",
        ),
        (
            "pressure",
            r"pressure|vacuum|vakuum|\bdruck\b|uberdruck|innendruck|pression|pressione|presion|cisnienie|pressao|\bdruk\b|\btryk|"
            r"paine\b|nyomas|\btlak|basinc|давление|压力|壓力|圧力|압력",
        ),
        (
            "force",
            r"force|\bload\b|load ?cell|kraft|\blast\b|charge\b|forza|carico|fuerza|carga|\bsila\b|forca|"
            r"kracht|belasting|voima|\bero\b|kuvvet|\byuk\b|усилие|сила|нагрузка|力|载荷|負荷|荷重|负荷|하중|힘",
        ),
        (
            "time",
            r"time|zeit|\btemps\b|tempo|tiempo|\bczas\b|elapsed|\btijd|\btid\b|\baika\b|\bido\b|\bcas\b|zaman|\bsure\b|"
            r"millis|micros|время|时间|時間|时刻|시간|seconds|\bsek",
        ),
        ("position", r"absolut\w* (crosshead|traverse)|(crosshead|traverse) absolut"),
        ("volume", r"volume|volumen|objetosc|\binfused\b|dispensed|объем|体积"),
        ("tip_deflection", r"tip.deflection"),
        ("added_mass", r"added.mass|zusatzmasse"),
        (
            "displacement",
            r"extension|\bext\b|displacement|\bstretch\b|\bdispl?\b|standardweg|\bweg\b|verschiebung|deplacement|spostamento|desplazamiento|"
            r"przemieszczenie|stroke|\bhub\b|course|corsa|travel|verformung|deformation|deflection|elongation|"
            r"verplaatsing|deslocamento|alongamento|alargamiento|forskydning|forskyvning|forflyttning|siirtyma|"
            r"elmozdulas|\bposuv|posunuti|prodlouzeni|uzama|allongement|wydluzenie|verlangerung|"
            r"перемещение|удлинение|деформация|位移|变形|變形|変位|變位|伸び|"
            r"ストローク|변위|신율",
        ),
        ("strain", r"deformac|deformazione|deformation|деформация"),
        ("position", r"position|crosshead|traverse|traversenweg|横梁"),
        (
            "voltage",
            r"voltage|photodiode|\bled\b|signal|\bspannung\b|tension|voltaje|tensao|napeti|напряжение|电压|電圧|전압",
        ),
        (
            "count",
            r"^#$|\bnr\b|\bno\b|number|index|count|\bframes?\b|cycle|zyklus|schritt|\bstep\b|point|номер|序号|番号|번호",
        ),
    )
)
# Units that quantities are read in. A machine's position is a displacement, a stretch (1 at rest) a strain; a
# count is not read.
READ_IN = {**UNITS, "position": "mm", "stretch": "", "count": ""}
READ_AS = {"position": "displacement", "stretch": "strain"}
# Never concluded from a unit, which suggests a more usual quantity.
_ONLY_BY_NAME = ("angle_sd", "stress_sd", "orientation", "tip_deflection")
_UNIT = r"(?:\(([^()]*)\)|\[([^\[\]]*)\]|\{([^{}]*)\})"
_BRACKETED = re.compile(_UNIT)
_BEFORE_UNIT = re.compile(r"\s*/\s*|\s+in\s+|[,;:]\s*|\s+|_")
# A quantity by another one, such as N/s, is none that is read.
_COMPOUND = re.compile(r"[^/\s]{1,6}/[^/\s]{1,6}|[\u00b0\u00ba]\s?[CFK]|\u2103|[A-Za-z]{1,3}(\^-?|-)\d")


@attrs.frozen
class Column:
    """Quantity of a column.

    title: as in the file; quantity: a name of `measured.kinds.UNITS`, "position", "count", or "" if unknown;
    unit: as in the file, "" without one; factor: to the unit that is read, None for a missing or unknown
    unit; place: number of the column in its table; likely: the quantity that the unit suggests if the title
    names none; stated: another one that the title names.
    """

    title: str
    quantity: str
    unit: str
    factor: float | None
    place: int = 0
    likely: str = ""
    stated: str = ""

    @property
    def reference(self) -> str:
        """Whether unit or title say of a pressure that it is "absolute" or "gauge"; "" for neither."""
        match = _REFERENCE.fullmatch(self.unit.casefold())
        word = match[2] if match else (_ABSOLUTE.search(plain(self.title)) or [""])[0]
        return {"a": "absolute", "g": "gauge", "": ""}[word[:1]] if self.quantity == "pressure" else ""

    @property
    def name(self) -> str:
        """Its title, or its number without one, as used in answers."""
        return self.title or str(self.place)


def column(title: str, unit: str = "") -> Column:
    """Column with this title and this cell in the row of units.

    Where title and unit disagree, as in "Strain" in mm, the unit decides.
    """
    name = title
    if not unit:
        name, unit = _apart(title)
    unit = unit.strip().strip("()[]{}").strip()
    known = unit_of(unit) if unit else None
    if known and known[1] == 60.0 and unit.casefold() == "min" and _meant(name, "s") != "time":
        # A minimum, as beside a (Max).
        name, unit, known = title, "", None
    if unit and not known and _COMPOUND.fullmatch(unit):
        return Column(title, "count", unit, None)
    meant = _meant(name)
    if meant == "count" and not (known and known[0]):
        return Column(title, "count", unit, None)
    if known and known[0] == "g" and meant == "force":
        return Column(title, meant, unit, known_in("force", unit))
    quantity = _meant(name, known[0]) if known else meant
    if quantity == "count" or (not known and quantity == "strain" and not unit):
        return Column(title, quantity, unit, None)
    if quantity == "stretch":
        return Column(title, quantity, unit, known[1] if known else 1.0)
    if not quantity and _REFERENCE.fullmatch(unit.casefold()):
        quantity = "pressure"
    if quantity or not known or not known[0]:
        return Column(title, quantity, unit, known[1] if known else None)
    # The unit says it, where only one quantity has it, or the title speaks of another one of a test.
    fit = [q for q, read in UNITS.items() if read == known[0] and q not in _ONLY_BY_NAME]
    likely = fit[0] if len(fit) == 1 else ""
    if likely and (
        meant in ("strain", "stress", "force", "displacement", "") and (meant or known[0] != "mm")
    ):
        return Column(title, likely, unit, known[1], stated=meant)
    return Column(title, "", unit, known[1], likely=likely)


def unit_of(text: str) -> tuple[str, float] | None:
    """The unit that is read in place of this one, and the factor to it; None for no unit."""
    text = unicodedata.normalize("NFC", text.strip().strip("()[]{}").strip())
    if text in _BY_CASE:
        return _BY_CASE[text]
    if match := _REFERENCE.fullmatch(text.casefold()):
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


def known_words(text: str) -> int:
    """Number of cells in a text's first lines that name a quantity or a unit with letters beyond ASCII."""
    cells = [cell for cell in re.split(r"[\t;,\n()\[\]\"]| {2,}", text[:4000]) if cell and not cell.isascii()]
    return sum(bool(_meant(cell)) + is_unit(cell) for cell in cells)


def _apart(title: str) -> tuple[str, str]:
    """A title's name and unit, as in "Load (N)", "Force [kN] 1", "Kraft / N", "Time, s" and "force_N"."""
    bracketed = [next(g for g in match.groups() if g is not None) for match in _BRACKETED.finditer(title)]
    for text in reversed(bracketed):
        if is_unit(text) or _COMPOUND.fullmatch(text.strip()):
            return _BRACKETED.sub(" ", title).strip(), text
    for sign in _BEFORE_UNIT.finditer(title):
        name, unit = title[: sign.start()], title[sign.end() :]
        if name and ((is_unit(unit) and not unit.isdigit()) or (unit == "S" and _meant(name) == "time")):
            return name, unit.lower() if unit == "S" else unit
    # Names of a program's variables, such as millis.
    return title, title if is_unit(title) and len(title) > 4 else ""


def _meant(name: str, unit: str | None = None) -> str:
    """Quantity of a name, among those of this unit if it is known; "" for none."""
    words = plain(name).replace("_", " ")
    if words.strip() == "t" and unit in (None, "s"):
        return "time"
    for quantity, pattern in _WORDS:
        if pattern.search(words) and (unit is None or READ_IN[quantity] == unit):
            return quantity
    return ""
