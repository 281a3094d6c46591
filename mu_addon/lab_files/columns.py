"""Quantity and unit of a column in a test machine's file, by its name and the row of units."""

from __future__ import annotations

import re
import unicodedata

import attrs

from ..measured.kinds import CONVERTED, UNITS, named

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
            r"accel|energy|energie|\bwork\b|torque|drehmoment|modulus|frequen|скорост|温度|速度|온도|속도",
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
            r"pressure|vacuum|vakuum|druck\b|pression|pressione|presion|cisnienie|pressao|\bdruk\b|\btryk|"
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
            r"extension|\bext\b|displacement|\bdistance\b|\blvdt\b|\bstretch\b|\bdispl?\b|standardweg|\bweg\b|verschiebung|deplacement|spostamento|desplazamiento|"
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
            r"^#$|\bnr\b|\bno\b|\bstage\b|number|index|count|\bframes?\b|cycle|zyklus|schritt|\bstep\b|point|номер|序号|番号|번호",
        ),
    )
)
# Units that quantities are read in; a count is not read.
READ_IN = {**UNITS, "position": "mm", "stretch": "", "count": ""}
# A machine's position is a displacement, a stretch (1 at rest) a strain.
_READ_AS = {"position": "displacement", "stretch": "strain"}
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
    def reads(self) -> str:
        """Name of the column of measured data that it is read as, such as force_N."""
        return named(_READ_AS.get(self.quantity, self.quantity))

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
    if known and unit.casefold() in ("min", "h", "d") and _meant(name, "s") != "time":
        # A minimum, as beside a (Max), a height, or tan d.
        name, unit, known = title, "", None
    if unit and not known and _COMPOUND.fullmatch(unit):
        return Column(title, "count", unit, None)
    meant = _meant(name)
    if meant == "count" and not (known and known[0]):
        return Column(title, "count", unit, None)
    if known and known[0] == "g" and meant == "force":
        return Column(title, meant, unit, known_in("force", unit))
    quantity = _meant(name, known[0]) if known else meant
    if quantity == "count":
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


def shown(title: str, place: int) -> str:
    """Title of a column in a text; place: its number in its table."""
    return f"column {title!r}" if title else f"column {place}, which has no title"
