"""Quantity and unit of a column in a test machine's file, by its name and the row of units."""

from __future__ import annotations

import re

import attrs

from ..measured.kinds import UNITS, named
from .units import READ_IN, REFERENCE, is_unit, known_in, plain, unit_of

# Titles that say whether a pressure counts from that of the air.
_ABSOLUTE = re.compile(r"\babsolut\w*|\babs\b|\bgauge (?=press)")


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
        match = REFERENCE.fullmatch(self.unit.casefold())
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
    if not quantity and REFERENCE.fullmatch(unit.casefold()):
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
