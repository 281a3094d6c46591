"""An experiment that is made of a table: its columns, what was decided, and the open questions."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from .blocks import Block, Unread
from .columns import Column, shown


class NoExperiment(InputError):
    """A table from which no experiment can be made."""


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
class Series:
    """A column that is read.

    values (n,): in the unit that its name ends with; origin: title and unit in the file, or how it was made;
    place: position in the file's table, None for one that was made.
    """

    values: Array
    origin: str
    place: int | None = None


@attrs.frozen(eq=False)
class Proposal:
    """One experiment, as far as it was read and decided: each step returns a new one.

    file, block: its source; name: of the experiment; answers: by key, as text; rows (n,): of the block, those
    that are read; concluded: changes and assumptions; unread: lines and columns that are not read; table: the
    columns by their names in a folder of measured data; free: positions of columns of no known quantity;
    kind, keys: of experiments.toml; questions: those still open.
    """

    file: Path
    block: Block
    name: str
    answers: Mapping[str, str]
    rows: Array
    concluded: tuple[str, ...]
    unread: tuple[Unread, ...]
    table: Mapping[str, Series] = attrs.field(factory=dict)
    free: tuple[int, ...] = ()
    kind: str = ""
    keys: Mapping[str, Any] = attrs.field(factory=dict)
    questions: tuple[Question, ...] = ()

    @classmethod
    def of(cls, file: Path, block: Block, name: str, answers: Mapping[str, str]) -> Proposal:
        """The proposal of a table of which nothing is decided."""
        return cls(file, block, name, answers, np.arange(len(block.lines)), block.noted, block.unread)

    @property
    def columns(self) -> dict[str, Array]:
        """Values (n,) of the columns."""
        return {name: one.values for name, one in self.table.items()}

    @property
    def origin(self) -> dict[str, str]:
        """Source of each column."""
        return {name: one.origin for name, one in self.table.items()}

    @property
    def lines(self) -> Array:
        """Lines (n,) of the rows in the file."""
        return np.asarray(self.block.lines[self.rows])

    @property
    def where(self) -> str:
        """File, sheet and lines of the whole table."""
        return self._at(str(self.file), self.block.lines)

    @property
    def source(self) -> str:
        """File, sheet and lines of the rows that are read."""
        return self._at(str(self.file), self.lines)

    @property
    def place(self) -> str:
        """The same without the file's folder."""
        return self._at(self.file.name, self.lines)

    def _at(self, file: str, lines: Array) -> str:
        sheet = f", sheet {self.block.sheet!r}" if self.block.sheet else ""
        return f"{file}{sheet}, lines {lines[0]} to {lines[-1]}"

    def concluding(self, words: str) -> Proposal:
        """With a conclusion."""
        return attrs.evolve(self, concluded=(*self.concluded, words))

    def left(self, what: str, why: str, lines: Sequence[int] = ()) -> Proposal:
        """With a part that is not read."""
        return attrs.evolve(self, unread=(*self.unread, Unread(what, why, tuple(lines))))

    def asked(self, key: str, words: str, choices: Sequence[str] = (), proposed: str = "") -> Proposal:
        """With an open question."""
        return attrs.evolve(self, questions=(*self.questions, Question(key, words, tuple(choices), proposed)))

    def with_column(self, name: str, values: Array, origin: str = "", place: int | None = None) -> Proposal:
        """With a column, or with other values of the one of this name, whose source it keeps."""
        one = Series(values, origin, place) if origin else attrs.evolve(self.table[name], values=values)
        return attrs.evolve(self, table={**self.table, name: one})

    def without_column(self, name: str, why: str) -> Proposal:
        """Without a column, which is listed as unread."""
        place = self.table[name].place
        found = attrs.evolve(self, table={other: one for other, one in self.table.items() if other != name})
        return found if place is None else found.left(self.title(place), why)

    def with_rows(self, keep: Array) -> Proposal:
        """With the rows of a mask (n,) alone."""
        table = {name: attrs.evolve(one, values=one.values[keep]) for name, one in self.table.items()}
        return attrs.evolve(self, table=table, rows=self.rows[keep])

    # Columns of the table, and what is answered about them.

    def title(self, k: int) -> str:
        """Column k as text."""
        one = self.block.columns[k]
        unit = f" [{one.unit}]" if one.unit and one.unit not in one.title else ""
        return shown(one.title, one.place) + unit

    @property
    def titles(self) -> str:
        """All columns as text."""
        return ", ".join(map(self.title, range(len(self.block.columns))))

    def extent(self, k: int) -> str:
        """The least and the largest number of column k as text, "" if it has none."""
        values = self.block.values[:, k]
        return f" ({np.nanmin(values):.6g} to {np.nanmax(values):.6g})" if np.isfinite(values).any() else ""

    def key(self, one: Column) -> str:
        """Name of a column in answers: its number if others have its title."""
        return one.name if [c.title for c in self.block.columns].count(one.title) == 1 else str(one.place)

    def answer_on(self, key: str, one: Column) -> tuple[str, str | None]:
        """Key and text of an answer about a column, `unit` or `column`, by its title or its number."""
        keys = [f"{key}.{name}" for name in (self.key(one), one.name, str(one.place))]
        found = next((k for k in keys if k in self.answers), keys[0])
        return found, self.answers.get(found)

    # Answers as values.

    def choice(self, key: str, choices: Sequence[str]) -> str | None:
        """An answer of one of `choices`, None without one; raises InputError for another."""
        answer = self.answers.get(key)
        if answer is not None and answer not in choices:
            raise InputError(
                f"{key} = {answer!r} is not known", self.where, f"choose one of {', '.join(choices)}"
            )
        return answer

    def numbers(self, key: str, counts: Sequence[int] = (1,), whole: bool = False) -> list[Any]:
        """Numbers of an answer such as 12.5x3 or 3,3,3, as many as one of `counts`; raises InputError."""
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

    def positive(self, key: str) -> float | None:
        """An answer of one number above 0, None without one; raises InputError."""
        if key not in self.answers:
            return None
        value = float(self.numbers(key)[0])
        if value <= 0:
            raise InputError(f"{key} = {value:g} is not above 0", self.where, "give a number above 0")
        return value
