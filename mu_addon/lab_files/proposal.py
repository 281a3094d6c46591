"""Experiments in the tables of laboratory files, the conclusions drawn, and the open questions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from ..measured.kinds import ACCURACIES, AXES, KINDS, MODES, PLATES, VALVES, may_be_missing, named
from ..table_cells.notation import number
from .blocks import Block, Unread
from .columns import READ_AS, READ_IN, Column, column, known_in, plain, unit_of
from .signs import LOADS, jumps, turned

Array = np.ndarray[Any, Any]

# A displacement that begins farther from zero than this share of its range is a place of the machine.
_OFFSET = 0.02
_TENSION = re.compile(r"tensil|tension test|zugversuch|\bzug\b|traction|trazione|traccion|rozciagan")
_COMPRESSION = re.compile(r"compress|druckversuch|stauch|druckspannung|\bdruck\b|schiacc|sciskan")
_LENGTH = re.compile(
    r"gau?ge length|grip separation|messlange|einspannlange|anfangslange|initial length|specimen length|"
    r"\bheight\b|\bhohe\b|probenhohe|longueur|lunghezza|longitud|\bl0\b"
)
_WIDTH = re.compile(r"width|breite|largeur|larghezza|anchura|szerokosc|\bb0\b")
_THICKNESS = re.compile(r"thickness|dicke|epaisseur|spessore|espesor|grubosc|\ba0\b")
_DIAMETER = re.compile(r"diameter|durchmesser|diametre|diametro|srednica|\bd0\b")
_AREA = re.compile(r"\barea\b|querschnitt|section area|\bs0\b|aire\b")
_NAME = re.compile(
    r"specimen (label|name|id)|sample (name|id)|probenbezeichnung|probenname|specimen$|sample$|probe$"
)
_KEYS_OF_NUMBERS = (
    "temperature_C",
    "scale",
    "orientation_deg",
    "mass_g",
    "strut_mm",
    "chamber_volume_mm3",
    "gap_mm",
    *ACCURACIES,
)
# Columns that are asked for, and jumps of a column that are named, at most.
_MOST_ASKED, _MOST_JUMPS = 12, 3
# A column that is missing in a larger share of the rows is left out instead of them, where it may be.
_SPARSE = 0.1
# Titles of a table of amplitudes, by frequency or temperature.
_OSCILLATION = re.compile(
    r"oscillat|\bosz|amplitud|(storage|loss|complex) mod|speichermod|verlustmod|module de (conservation|"
    r"perte)|modulo (elastico|viscoso)|tan ?\W?(delta|d\b|\u03b4)|loss factor|verlustfaktor|"
    r"\b[eg]['\u2032\"\u2033]|\bfrequen|\bfreq\b|\bf ?[/\[(] ?hz|phase angle|phasenwinkel"
)
# A stretch at rest is 1, a strain 0, within this.
_AT_REST = 0.1
# More degrees than a full turn in radians.
_NO_RADIANS = 7.0
# A pressure that goes this share of its range within that share of a record, read so many times a second.
_STEP, _WITHIN, _CAMERA_Hz = 0.6, 0.02, 20.0


@attrs.frozen
class Question:
    """A question that a file leaves open: its key, its text, and possible answers.

    proposed: the likely answer, "" without one.
    """

    key: str
    words: str
    choices: tuple[str, ...] = ()
    proposed: str = ""

    @property
    def text(self) -> str:
        """The question with its possible answers."""
        return self.words + (f" ({', '.join(self.choices)})" if self.choices else "")


@attrs.frozen(eq=False)
class Proposal:
    """One experiment, as far as it was read.

    file, sheet: its source; lines (n,): of the rows read; keys: of experiments.toml; columns: arrays (n,) by
    their names in a folder of measured data; origin: source of each column; concluded: changes and
    assumptions; unread: lines and columns that are not read; questions: those still open; titles: of all
    columns of the table, and their numbers.
    """

    file: Path
    sheet: str
    lines: Array
    keys: dict[str, Any]
    columns: dict[str, Array]
    origin: dict[str, str]
    concluded: tuple[str, ...]
    unread: tuple[Unread, ...]
    questions: tuple[Question, ...]
    titles: tuple[str, ...]

    @property
    def name(self) -> str:
        """The experiment's name."""
        return str(self.keys["name"])

    @property
    def place(self) -> str:
        """Name of the file, sheet and lines, in words."""
        sheet = f", sheet {self.sheet!r}" if self.sheet else ""
        return f"{self.file.name}{sheet}, lines {self.lines[0]} to {self.lines[-1]}"

    @property
    def where(self) -> str:
        """The same with the file's path."""
        return f"{self.file}{self.place.removeprefix(self.file.name)}"


class NoExperiment(InputError):
    """A table from which no experiment can be made."""


def propose(path: Path, block: Block, name: str, answers: Mapping[str, str]) -> Proposal:
    """Make an experiment of a table.

    name: of the experiment; answers: by key, as text, of this experiment. Raises InputError for an invalid
    answer, for a time that does not increase, and NoExperiment where columns are missing.
    """
    return _Proposing(path, block, name, dict(answers)).proposal()


def answers_for(name: str, given: Mapping[str, str]) -> dict[str, str]:
    """Answers for an experiment: those under its name before those for all."""
    general = {key: value for key, value in given.items() if "." not in key or key.startswith(_OWN)}
    own = {key[len(name) + 1 :]: value for key, value in given.items() if key.startswith(name + ".")}
    return general | own


# Answers about a column begin so, and hold its title.
_OWN = ("unit.", "column.")


class _Proposing:
    """Conversion of one table to an experiment."""

    def __init__(self, path: Path, block: Block, name: str, answers: dict[str, str]) -> None:
        self.path, self.block, self.name, self.answers = path, block, name, answers
        self.concluded: list[str] = list(block.noted)
        self.unread: list[Unread] = list(block.unread)
        self.questions: list[Question] = []
        self.keys: dict[str, Any] = {"name": name}
        # Columns of the table by what they are read as, and those that may be asked for.
        self.places: dict[str, int] = {}
        self.free: list[int] = []
        self.keep = np.full(len(block.lines), True)

    @property
    def where(self) -> str:
        lines = self.block.lines
        sheet = f", sheet {self.block.sheet!r}" if self.block.sheet else ""
        return f"{self.path}{sheet}, lines {lines[0]} to {lines[-1]}"

    def proposal(self) -> Proposal:
        columns, origin = self._columns()
        kind = self._kind(columns)
        if kind:
            self._interval(columns, origin, kind)
            self._require_curve(kind)
            self._require_needed(columns, kind)
            columns = self._of_kind(columns, kind)
            columns = self._complete(columns, kind)
            self._time(columns, kind)
            # A place of the machine may be negative: its change tells the sign.
            self._zero(columns)
            self._signs(columns, kind)
            self.keys = self._keys(columns, kind)
        else:
            columns = {name: values[self.keep] for name, values in columns.items()}
        self.unread += [Unread(self._title(k), self._why_free(k)) for k in self.free]
        return Proposal(
            file=self.path,
            sheet=self.block.sheet,
            lines=self.block.lines[self.keep],
            keys=self.keys,
            columns=columns,
            origin={column: origin[column] for column in columns},
            concluded=tuple(self.concluded),
            unread=tuple(self.unread),
            questions=tuple(self.questions),
            titles=tuple(name for c in self.block.columns for name in dict.fromkeys((c.name, str(c.place)))),
        )

    def _title(self, k: int) -> str:
        """A column as text."""
        one = self.block.columns[k]
        unit = f" [{one.unit}]" if one.unit and one.unit not in one.title else ""
        return f"column {one.title!r}{unit}" if one.title else f"column {one.place}, which has no title{unit}"

    def _range(self, k: int) -> str:
        """The least and the largest number of a column as text, "" if it has none."""
        values = self.block.values[:, k]
        if not np.isfinite(values).any():
            return ""
        return f" ({np.nanmin(values):.6g} to {np.nanmax(values):.6g})"

    def _why_free(self, k: int) -> str:
        one = self.block.columns[k]
        if one.quantity == "count":
            return "not a quantity that is read" + (f", in {one.unit!r}" if one.unit else "")
        return f"its quantity is not known; set it by column.{self._name(one)}=QUANTITY"

    def _columns(self) -> tuple[dict[str, Array], dict[str, str]]:
        """The columns of known quantity, in the units that are read, and the source of each."""
        columns: dict[str, Array] = {}
        origin: dict[str, str] = {}
        position: tuple[int, Array, str] | None = None
        untitled = not any(one.title for one in self.block.columns)
        for k, given in enumerate(self.block.columns):
            one = self._answered(given, k, untitled)
            if one is None:
                self.unread.append(Unread(self._title(k), "left out by the answer 'none'"))
                continue
            if not one.quantity or one.quantity == "count":
                self.free.append(k)
                continue
            one = self._stretch(self._weight(one, k), k)
            if one.factor is None:
                one = self._unit(one, k)
            if one.stated and one.stated != one.quantity:
                self.concluded.append(f"{self._title(k)} is read as {one.quantity}, by its unit")
            values = self.block.values[:, k] * (one.factor or 1.0) - (one.quantity == "stretch")
            read = f" [{one.unit}]" if one.unit else ""
            source = f"{one.title or f'column {one.place}'!r}{read}"
            target = named(READ_AS.get(one.quantity, one.quantity))
            # A clock beside a numeric time adds nothing; nor does a machine's position beside an extension.
            first = self.places.get(target)
            if one.quantity == "position":
                position = position or (k, values, source)
                if position[0] != k:
                    self._again(k, position[0], one)
            elif first is not None and self.block.columns[first].unit == "clock" and target == "time_s":
                self._again(first, k, one)
                columns[target], origin[target], self.places[target] = values, source, k
            elif first is not None:
                self._again(k, first, one)
            else:
                columns[target], origin[target], self.places[target] = values, source, k
        if position:
            k, values, source = position
            if "displacement_mm" in columns:
                self._again(k, self.places["displacement_mm"], self.block.columns[k])
            else:
                columns["displacement_mm"], origin["displacement_mm"] = values, source
                self.places["displacement_mm"] = k
        return columns, origin

    def _weight(self, one: Column, k: int) -> Column:
        """A load in grams as the weight of that mass, or as a mass that bends a beam."""
        unit = unit_of(one.unit) if one.unit else None
        if unit is None or unit[0] != "g" or one.quantity not in ("force", "added_mass"):
            return one
        others = {other.quantity for other in self.block.columns}
        kind = self.answers.get("kind", "beam_deadweight" if "tip_deflection" in others else "")
        if kind == "beam_deadweight":
            return attrs.evolve(one, quantity="added_mass", factor=unit[1])
        forced = kind in KINDS and "force_N" in KINDS[kind].columns and "force" not in others
        if one.quantity == "force" or forced:
            self.concluded.append(
                f"{self._title(k)} is read as a force, the weight of that mass: 1 {one.unit} is "
                f"{known_in('force', one.unit):.6g} N"
            )
            return attrs.evolve(one, quantity="force", factor=known_in("force", one.unit))
        return one

    def _stretch(self, one: Column, k: int) -> Column:
        """A stretch, 1 or 100 % at rest, and a strain, 0 at rest, told apart by the first reading."""
        if one.quantity not in ("stretch", "strain"):
            return one
        values = self.block.values[:, k]
        first = float(values[np.isfinite(values)][0]) * (one.factor or 1.0)
        answered = self._answer("column", one)[1] is not None
        if one.quantity == "stretch":
            if abs(first - 100.0) < 100.0 * _AT_REST and not unit_of(one.unit):
                one = attrs.evolve(one, unit="%", factor=0.01)
            elif abs(first) < _AT_REST and not answered:
                self.concluded.append(
                    f"{self._title(k)} is read as a strain: it begins at {first:g}, not at 1"
                )
                return attrs.evolve(one, quantity="strain", factor=one.factor if one.unit else None)
            self.concluded.append(f"{self._title(k)} is read as a stretch: the strain is its value less 1")
        elif abs(first - 1.0) < _AT_REST or (one.factor is None and abs(first - 100.0) < 100.0 * _AT_REST):
            words = f"{self._title(k)} begins at {first:g}, as a stretch does, and a strain at 0"
            if answered:
                self.concluded.append(f"{words}: column.{self._name(one)}=stretch if it is one")
            else:
                self._ask(f"column.{self._name(one)}", words, ("strain", "stretch"), "stretch")
        return one

    def _again(self, k: int, first: int, one: Column) -> None:
        self.unread.append(Unread(self._title(k), f"another {one.quantity}: {self._title(first)} is read"))

    def _name(self, one: Column) -> str:
        """Name of a column in answers: its number if others have its title."""
        alone = [other.title for other in self.block.columns].count(one.title) == 1
        return one.name if alone else str(one.place)

    def _answer(self, key: str, one: Column) -> tuple[str, str | None]:
        """An answer about a column by its title, or by its number: its key and text."""
        keys = [f"{key}.{one.title}", f"{key}.{one.place}"] if one.title else [f"{key}.{one.place}"]
        if self._name(one) != one.title:
            keys.reverse()
        found = next((k for k in keys if k in self.answers), keys[0])
        return found, self.answers.get(found)

    def _answered(self, one: Column, k: int, untitled: bool) -> Column | None:
        """A column as an answer names it, `column.TITLE=quantity`; None for `none`."""
        key, answer = self._answer("column", one)
        unit = self._answer("unit", one)[1]
        if answer is None:
            if untitled and not one.quantity:
                self._ask_column(
                    k, tuple(q for q in READ_IN if q != "count"), f"{self._title(k)}{self._range(k)}"
                )
            if unit is not None and unit_of(unit):
                # The unit that is given may say that a title means another quantity.
                again = attrs.evolve(column(one.title, unit), place=one.place)
                if not one.quantity or again.stated == "strain":
                    one = attrs.evolve(again, quantity=again.quantity or again.likely)
            return one
        if answer == "none":
            return None
        if answer not in READ_IN:
            raise InputError(
                f"{key} = {answer!r} is not a quantity",
                self.where,
                f"choose one of {', '.join(READ_IN)}, or none",
            )
        if one.unit == "clock" and answer == "time":
            return one
        factor = known_in(answer, one.unit)
        if answer == "stretch" and factor is None:
            factor = 1.0
        return attrs.evolve(one, quantity=answer, factor=factor, stated="")

    def _ask_column(self, k: int, quantities: Sequence[str], words: str, why: str = "") -> None:
        """Ask for the quantity of a column."""
        one = self.block.columns[k]
        values = self.block.values[:, k]
        proposed = one.likely if one.likely in quantities else ""
        if not one.title and "time" in quantities and k == 0 and (np.diff(values) > 0).all():
            proposed = "time"
        self.questions.append(
            Question(
                f"column.{self._name(one)}", f"what does {words} hold{why}?", (*quantities, "none"), proposed
            )
        )

    def _unit(self, one: Column, k: int) -> Column:
        """A column with its unit from an answer, `unit.TITLE=N`; asked for without one."""
        wanted = READ_IN[one.quantity]
        key, answer = self._answer("unit", one)
        if answer is None:
            if (
                wanted == "deg"
                and not one.unit
                and np.nanmax(np.abs(self.block.values[:, k]), initial=0) > _NO_RADIANS
            ):
                self.concluded.append(f"in degrees{self._range(k)}: {self._title(k)}")
                return attrs.evolve(one, unit="deg", factor=1.0)
            shown = f"{one.unit!r}, which is not known" if one.unit else "not given"
            title = repr(one.title) if one.title else f"column {one.place}"
            halves = one.quantity == "time" and one.unit == "" and self.block.clock == k
            choices = ("h:min", "min:s") if halves else _OFTEN[wanted]
            self.questions.append(
                Question(
                    key,
                    f"the unit of {title}{self._range(k)} is {shown}",
                    choices,
                    "" if halves else self._likely(one, k),
                )
            )
            return attrs.evolve(one, factor=1.0)
        factor = 1.0 if answer in ("", wanted) else known_in(one.quantity, answer)
        if factor is None:
            raise InputError(
                f"{key} = {answer!r} is not a unit of {one.quantity}",
                self.where,
                f"choose one of {', '.join(_OFTEN[wanted])}; column.{self._name(one)}=QUANTITY says that "
                f"it is no {one.quantity}",
            )
        return attrs.evolve(one, unit=answer, factor=factor)

    def _likely(self, one: Column, k: int) -> str:
        """The likely unit: of strain and of time by the size of the values."""
        values = self.block.values[:, k]
        if one.quantity == "strain":
            return "%" if np.nanmax(np.abs(values), initial=0) > 1.5 else "1"
        if one.quantity == "time":
            if _DATE.search(plain(one.title)) and ((values > _DAYS[0]) & (values < _DAYS[1])).all():
                return "d"
            # Boards count milliseconds and microseconds in whole numbers, clocks of computers whole seconds.
            step = float(np.nanmedian(np.abs(np.diff(values)))) if len(values) > 1 else 0.0
            whole = bool((values[np.isfinite(values)] % 1 == 0).all())
            return "us" if whole and step >= 1000 else "ms" if whole and step >= 5 else "s"
        return _OFTEN[READ_IN[one.quantity]][0] if READ_IN[one.quantity] in ("mm", "N", "deg") else ""

    def _kind(self, columns: Mapping[str, Array]) -> str:
        """Kind of experiment, "" if it must be asked."""
        answer = self.answers.get("kind")
        if answer is not None:
            if answer not in KINDS:
                raise InputError(
                    f"kind = {answer!r} is not known", self.where, f"choose one of {', '.join(KINDS)}"
                )
            return "" if any(question.key.startswith("column.") for question in self.questions) else answer
        have = set(columns)
        if {"angle_deg", "voltage_V"} <= have and "pressure_kPa" not in have:
            return "waveguide_bending"
        if {"pressure_kPa", "orientation_deg", "angle_deg"} <= have:
            return "unit_pose"
        if {"pressure_kPa", "force_N"} <= have:
            self.concluded.append("blocked_force: a force beside a pressure (kind=... for another)")
            return "blocked_force"
        if {"pressure_kPa", "angle_deg"} <= have and stepped(columns):
            self.concluded.append(
                "pressure_step: the pressure jumps, and was read often enough to see the unit follow "
                "(kind=unit_pressure where it was slow)"
            )
            return "pressure_step"
        if {"pressure_kPa", "angle_deg"} <= have or {"pressure_kPa", "volume_mm3"} <= have:
            return "unit_pressure"
        if {"added_mass_g", "tip_deflection_mm"} <= have:
            return "beam_deadweight"
        loads = ({"strain", "stress_kPa"}, {"displacement_mm", "force_N"})
        if any(load <= have for load in loads):
            return self._loading()
        if any(question.key.startswith("column.") for question in self.questions):
            return ""
        if self._ask_unknown():
            return ""
        if "pressure_kPa" in have:
            return "pressure_hold"
        self._refuse(have)
        return ""

    def _ask_unknown(self) -> bool:
        """Ask for the columns of unknown quantity; return True if there are any."""
        unknown = [k for k in self.free if not self.block.columns[k].quantity]
        for k in unknown[:_MOST_ASKED]:
            unit = unit_of(self.block.columns[k].unit) if self.block.columns[k].unit else None
            fit = tuple(
                q for q, read in READ_IN.items() if q != "count" and (unit is None or read == unit[0])
            )
            self._ask_column(k, fit, f"{self._title(k)}{self._range(k)}")
        return bool(unknown)

    def _refuse(self, have: set[str]) -> None:
        """Raise NoExperiment with the columns found and those that each kind needs."""
        ways = "; ".join(
            f"{kind.name}: {' or '.join(', '.join(g) for g in kind.needs)}" for kind in KINDS.values()
        )
        titles = ", ".join(self._title(k) for k in range(len(self.block.columns)))
        raise NoExperiment(
            f"no kind of experiment has {' and '.join(sorted(have)) or 'no known column'} alone; there are "
            f"{titles}",
            self.where,
            f"export the columns of one kind ({ways}), or say with column.TITLE=QUANTITY what a column holds",
        )

    def _require_needed(self, columns: Mapping[str, Array], kind: str) -> None:
        """Ask for the columns that the kind needs; raises NoExperiment if no candidate is left."""
        have = set(columns)
        groups = [set(group) | ({"time_s"} if KINDS[kind].timed else set()) for group in KINDS[kind].needs]
        if any(group - {"time_s"} <= have for group in groups):
            return
        # The group that most columns are there for, or may be by their units.
        ways = []
        for group in groups:
            gone = sorted(group - have - {"time_s"})
            wanted = [q for q in READ_IN if named(q) in gone]
            unknown = [k for k in self.free if self._may_be(k, wanted)]
            fit = [q for q in wanted if any(self._may_be(k, [q]) for k in unknown)]
            ways.append((len(group & have) / len(group), len(fit) / len(gone), gone, wanted, unknown))
        _, _, gone, wanted, unknown = max(ways, key=lambda way: way[0] + way[1])
        if not unknown:
            titles = ", ".join(self._title(k) for k in range(len(self.block.columns)))
            raise NoExperiment(
                f"{kind} needs {' and '.join(gone)}, and no column is left that may hold it; there are "
                f"{titles}",
                self.where,
                "export that column as well, choose another kind, or say with column.TITLE=QUANTITY and "
                "unit.TITLE=UNIT what a column holds",
            )
        for k in unknown[:_MOST_ASKED]:
            self._ask_column(
                k, wanted, f"{self._title(k)}{self._range(k)}", f", as {kind} needs {' and '.join(gone)}"
            )
            if len(unknown) == 1 and len(wanted) == 1:
                self.questions[-1] = attrs.evolve(self.questions[-1], proposed=wanted[0])

    def _require_curve(self, kind: str) -> None:
        """Raise NoExperiment for loads that are amplitudes of an oscillation; an answered column is none."""
        if kind not in ("coupon", "lattice_compression"):
            return
        for k, one in enumerate(self.block.columns):
            if _OSCILLATION.search(plain(one.title)) and self._answer("column", one)[1] is None:
                raise NoExperiment(
                    f"{self._title(k)} shows a test by oscillation: its loads are amplitudes, and no "
                    "stress-strain curve",
                    self.where,
                    "export a test of one pull or pressing; if each row is a reading of one, answer "
                    f"column.{self._name(one)}=none, or with its quantity",
                )

    def _may_be(self, k: int, quantities: Sequence[str]) -> bool:
        """Return True if an unread column may hold one of these quantities, by its unit."""
        one = self.block.columns[k]
        if self._answer("column", one)[1] is not None or (one.quantity == "count" and one.unit):
            return False
        return unit_of(one.unit) is None or any(known_in(q, one.unit) is not None for q in quantities)

    def _loading(self) -> str:
        """Kind of loading, tension of a specimen or compression of a lattice, by the file's text."""
        words = " ".join(
            [self.path.stem, self.block.sheet, self.block.label, *(c.title for c in self.block.columns)]
            + [" ".join((key, *cells)) for key, cells in self.block.facts.items()]
        )
        pulled = bool(_TENSION.search(plain(words)))
        pressed = bool(_COMPRESSION.search(plain(words)))
        if pulled != pressed:
            kind = "coupon" if pulled else "lattice_compression"
            self.concluded.append(f"{kind}: the file speaks of {'tension' if pulled else 'compression'}")
            return kind
        self.questions.append(
            Question(
                "kind",
                "a specimen was loaded: was it a coupon of resin, or a block of lattice compressed?",
                ("coupon", "lattice_compression"),
            )
        )
        return ""

    def _interval(self, columns: dict[str, Array], origin: dict[str, str], kind: str) -> None:
        """A time made from an interval, if the file has none and the kind needs one."""
        if "time_s" in columns:
            return
        interval = self._positive("interval_s") if "interval_s" in self.answers else None
        if interval is not None:
            columns["time_s"] = interval * np.arange(len(self.block.lines), dtype=float)
            origin["time_s"] = f"rows, {interval:g} s apart"
        elif KINDS[kind].timed:
            self.questions.append(
                Question("interval_s", f"{kind} needs a time, and there is none: seconds from row to row?")
            )

    def _of_kind(self, columns: Mapping[str, Array], kind: str) -> dict[str, Array]:
        """Columns that a kind may have."""
        kept = {name: values for name, values in columns.items() if KINDS[kind].knows(name)}
        self.unread += [
            Unread(self._title(self.places[name]), f"{name} is not a column of {kind}")
            for name in columns
            if name not in kept
        ]
        return kept

    def _complete(self, columns: dict[str, Array], kind: str) -> dict[str, Array]:
        """Rows without missing required values; the others are listed with the reason."""
        needs = KINDS[kind].needs
        reasons: dict[str, list[int]] = {}
        for name, values in list(columns.items()):
            gone = np.isnan(values)
            if not gone.any() or name not in self.places:
                continue
            others = set(columns) - {name}
            if (
                gone.mean() > _SPARSE
                and name != "time_s"
                and any(others.issuperset(group) for group in needs)
            ):
                self.unread.append(
                    Unread(self._title(self.places[name]), f"missing in {gone.sum()} of {len(gone)} rows")
                )
                del columns[name]
                continue
            for i in np.flatnonzero(gone):
                text = self.block.bad.get((int(i), self.places[name]))
                if may_be_missing(name):
                    if text is not None:
                        why = f"{text!r} in {self._title(self.places[name])} is not a number: left empty"
                        reasons.setdefault(why, []).append(int(self.block.lines[i]))
                elif self.keep[i]:
                    self.keep[i] = False
                    title = self._title(self.places[name])
                    why = (
                        f"{text!r} in {title} is not a number"
                        if text is not None
                        else f"no number in {title}"
                    )
                    reasons.setdefault(why, []).append(int(self.block.lines[i]))
        self.unread += [Unread("", why, tuple(lines)) for why, lines in reasons.items()]
        if self.keep.sum() < KINDS[kind].fewest:
            raise NoExperiment(
                f"{self.keep.sum()} rows have all that {kind} needs, at least {KINDS[kind].fewest} must: "
                + "; ".join(one.words for one in self.unread[-3:]),
                self.where,
                "correct these cells, or leave a column out with column.TITLE=none",
            )
        return {name: values[self.keep] for name, values in columns.items()}

    def _time(self, columns: dict[str, Array], kind: str) -> None:
        """Raise InputError for a time that runs backward; leave out a constant one, if allowed."""
        if "time_s" not in columns:
            return
        begins = float(columns["time_s"][0])
        if begins > _LONGEST_TEST_S:
            columns["time_s"] = columns["time_s"] - begins
            self.concluded.append(f"time_s: minus its first value, {begins:.10g} s, of a calendar")
        step = np.diff(columns["time_s"])
        lines = self.block.lines[self.keep]
        if (step < 0).any():
            raise InputError(
                "the time runs backward",
                f"{self.path}, line {lines[int(np.argmax(step < 0)) + 1]}",
                "divide the file where a new record begins",
            )
        if not KINDS[kind].timed and (step == 0).any():
            at = lines[int(np.argmax(step == 0)) + 1]
            why = f"time does not increase at line {at}, and {kind} does not need it"
            self.unread.append(Unread(self._title(self.places["time_s"]), why))
            del columns["time_s"]

    def _signs(self, columns: dict[str, Array], kind: str) -> None:
        """Set signs: compression positive in a lattice block; a coupon's force with its stretch's sign."""
        pairs = [name for name in LOADS if name in columns]
        if kind not in ("coupon", "lattice_compression") or not pairs:
            return
        lines = self.block.lines[self.keep]
        for name in pairs:
            for row in jumps(columns, name)[:_MOST_JUMPS]:
                by = columns[name][row] - columns[name][row - 1]
                self.concluded.append(
                    f"{name}: jumps by {by:.4g} at line {lines[row]} while the test goes on; check it"
                )
        pressed = kind == "lattice_compression"
        found = turned(columns, pressed)
        if self._choice("sign", ("as_read",)):
            return
        for name in found:
            columns[name] = 0.0 - columns[name]
            self.concluded.append(
                f"{name}: sign turned, positive in {'compression' if pressed else 'tension'} "
                "(sign=as_read keeps it)"
            )
        if not pressed and not found and all(np.nanmean(columns[name]) < 0 for name in pairs):
            self.concluded.append("force and displacement are negative: read as compression of the coupon")

    def _zero(self, columns: dict[str, Array]) -> None:
        """Shift a displacement that begins at a position of the machine to begin at zero."""
        found = columns.get("displacement_mm")
        if found is None or self.answers.get("zero") == "as_read":
            return
        first = float(found[np.isfinite(found)][0])
        if abs(first) > _OFFSET * float(np.nanmax(found) - np.nanmin(found)):
            columns["displacement_mm"] = found - first
            self.concluded.append(
                f"displacement_mm: minus its first value, {first:g} mm, the machine's position "
                "(zero=as_read keeps it)"
            )

    def _keys(self, columns: Mapping[str, Array], kind: str) -> dict[str, Any]:
        """Keys of experiments.toml: answers, then facts in the file, else a question."""
        keys: dict[str, Any] = {"name": self.name, "kind": kind}
        keys["specimen"] = self.answers.get("specimen") or self._fact_text(_NAME) or self.name
        keys["role"] = self._choice("role", ("fit", "held_out")) or "fit"
        keys["source"] = self.path.name
        for key in _KEYS_OF_NUMBERS:
            if key in self.answers and (key in KINDS[kind].keys):
                keys[key] = self._number(key)
        if kind == "coupon":
            keys["mode"] = self._choice("mode", MODES)
            if keys["mode"] is None:
                self._ask("mode", "how was the coupon loaded?", MODES, "uniaxial")
        for key, choices in (("plates", PLATES), ("axis", AXES), ("valve", VALVES)):
            if key in KINDS[kind].keys and self._choice(key, choices):
                keys[key] = self._choice(key, choices)
        axis = self._choice("orientation_axis", AXES)
        if axis and "orientation_axis" in KINDS[kind].keys:
            keys["orientation_axis"] = axis
        if kind == "blocked_force" and "gap_mm" not in keys:
            self._ask("gap_mm", "how far in mm was the load cell from the tip at rest?", (), "0")
        if "pressure" in KINDS[kind].keys and self._choice("pressure", ("gauge", "absolute")):
            keys["pressure"] = self._choice("pressure", ("gauge", "absolute"))
        if "cells" in self.answers and kind == "lattice_compression":
            cells = self._numbers("cells", (1, 3), whole=True)
            keys["cells"] = cells if len(cells) == 3 else cells[0]
        # Section and length turn force and displacement into stress and strain.
        needs_section = "section_mm" in KINDS[kind].keys and (
            kind == "beam_deadweight" or ("stress_kPa" not in columns and "force_N" in columns)
        )
        needs_length = "length_mm" in KINDS[kind].keys and (
            kind == "beam_deadweight" or ("strain" not in columns and "displacement_mm" in columns)
        )
        keys["section_mm"] = self._section()
        if keys["section_mm"] is None and needs_section:
            self._ask("section_mm", "width and thickness of the section in mm, as 12.5x3?")
        keys["length_mm"] = self._length()
        if keys["length_mm"] is None and needs_length:
            self._ask(
                "length_mm",
                "length in mm over which the displacement is taken (gauge length, height of a block)?",
            )
        known = KINDS[kind].keys
        return {key: value for key, value in keys.items() if value is not None and key in known}

    def _ask(self, key: str, words: str, choices: tuple[str, ...] = (), proposed: str = "") -> None:
        self.questions.append(Question(key, words, choices, proposed))

    def _section(self) -> list[float] | None:
        """Width and thickness in mm by an answer or the file; a round section as a square of equal area."""
        if "section_mm" in self.answers:
            return self._numbers("section_mm", (2,))
        width, thickness = self._fact_mm(_WIDTH), self._fact_mm(_THICKNESS)
        if width and thickness:
            self.concluded.append(f"section of {width:g} x {thickness:g} mm, as the file says")
            return [width, thickness]
        diameter, area = self._fact_mm(_DIAMETER), self._fact_mm(_AREA)
        if diameter or area:
            side = math.sqrt(area) if area else 0.5 * math.sqrt(math.pi) * float(diameter or 0.0)
            words = f"of {area:g} mm2" if area else f"round, {diameter:g} mm"
            self.concluded.append(f"section {words}, as the file says: given as a square of that area")
            return [round(side, 6), round(side, 6)]
        return None

    def _length(self) -> float | None:
        if "length_mm" in self.answers:
            return self._positive("length_mm")
        length = self._fact_mm(_LENGTH)
        if length:
            self.concluded.append(f"length of {length:g} mm, as the file says")
        return length

    def _fact_text(self, pattern: re.Pattern[str]) -> str:
        return next(
            (cells[0] for key, cells in self.block.facts.items() if cells and pattern.search(key)), ""
        )

    def _fact_mm(self, pattern: re.Pattern[str]) -> float | None:
        """A positive length (or area) in mm stated in the file, None without it or its unit."""
        for key, cells in self.block.facts.items():
            if not cells or not pattern.search(key):
                continue
            value = number(cells[0], self.block.decimal)
            text = cells[1] if len(cells) > 1 else (re.search(r"[(\[]([^()\[\]]+)[)\]]", key) or ["", ""])[1]
            unit = unit_of(text.replace("\u00b2", "").removesuffix("2").removesuffix("^")) if text else None
            if value is not None and value > 0 and unit and unit[0] == "mm":
                squared = text.rstrip().endswith(("2", "\u00b2"))
                return float(value * (unit[1] ** 2 if squared else unit[1]))
        return None

    def _choice(self, key: str, choices: Sequence[str]) -> str | None:
        answer = self.answers.get(key)
        if answer is not None and answer not in choices:
            raise InputError(
                f"{key} = {answer!r} is not known", self.where, f"choose one of {', '.join(choices)}"
            )
        return answer

    def _number(self, key: str) -> float:
        return self._numbers(key, (1,))[0]

    def _positive(self, key: str) -> float:
        value = self._number(key)
        if value <= 0:
            raise InputError(f"{key} = {value:g} is not above 0", self.where, "give a number above 0")
        return value

    def _numbers(self, key: str, counts: Sequence[int], whole: bool = False) -> list[Any]:
        """Numbers of an answer such as 12.5x3 or 3,3,3."""
        parts = [part for part in re.split(r"[x\u00d7,; ]+", self.answers[key].strip("[]() ")) if part]
        try:
            values = [int(part) if whole else float(part) for part in parts]
        except ValueError:
            values = []
        if len(values) not in counts or not all(math.isfinite(value) for value in values):
            raise InputError(
                f"{key} = {self.answers[key]!r} is not {' or '.join(map(str, counts))} numbers",
                self.where,
                f"write it as {'3x3x3' if whole else 'x'.join(['12.5', '3', '1'][: counts[0]])}",
            )
        return values


# A date that a spreadsheet has as a number counts days from 1900: here of 1968 to 2091.
_DATE = re.compile(r"\bdat(e|um|a)\b|fecha|\u65e5")
_DAYS = 25_000, 70_000
# Seconds or days since 1970 or 1900 are no time of a test.
_LONGEST_TEST_S = 1e8
# Units that a question offers, the usual one first.
_OFTEN = {
    "s": ("s", "ms", "us", "min", "h", "d"),
    "mm": ("mm", "um", "cm", "m", "in"),
    "N": ("N", "kN", "mN", "lbf", "kgf"),
    "kPa": ("MPa", "kPa", "Pa", "bar", "mbar", "psi"),
    "deg": ("deg", "rad"),
    "": ("1", "%"),
    "V": ("V", "mV"),
    "mm3": ("mm3", "ml"),
    "g": ("g", "kg"),
}


def stepped(columns: Mapping[str, Array]) -> bool:
    """Return True if a record is of pressure steps, sampled fast."""
    t, p = columns.get("time_s"), columns["pressure_kPa"]
    if t is None or len(t) < 50 or not np.isfinite(p).all() or not (np.diff(t) > 0).all():
        return False
    lasts, extent = float(t[-1] - t[0]), float(np.ptp(p))
    if not extent or len(t) / lasts < _CAMERA_Hz:
        return False
    later = np.interp(t + _WITHIN * lasts, t, p)
    return bool(np.abs(later - p).max() >= _STEP * extent)
