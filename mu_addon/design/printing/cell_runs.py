"""Runs of cells along the lines of a grid, and the connected parts they form.

A grid whose cells are mostly equal along its lines has some hundred times fewer runs than cells. Finding
regions and chambers on the runs takes less time and memory than a label for each cell.
"""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import connected, ranges

Index = NDArray[np.int64]

_AT_ONCE = 16_000_000


@attrs.frozen(eq=False)
class Runs:
    """Runs of cells along the last axis of a grid, in order, separated by gaps.

    line (r,): number of each run's line, counted over the other axes; start, end (r,): its first cell in the
    line, and the one after its last; cells: number of cells of a line.
    """

    line: Index
    start: Index
    end: Index
    cells: int

    def part(self, first: int, last: int) -> Runs:
        """The runs of lines first .. last - 1, which keep their numbers."""
        a, b = np.searchsorted(self.line, [first, last])
        return Runs(self.line[a:b], self.start[a:b], self.end[a:b], self.cells)

    @property
    def gaps(self) -> tuple[Index, Index, Index]:
        """Lines, starts and ends of the gaps before, between and after the runs of lines that have any."""
        first = np.diff(self.line, prepend=-1) != 0
        last = np.diff(self.line, append=-1) != 0
        before = np.where(first, 0, np.concatenate([[0], self.end[:-1]])) if len(self.line) else self.start
        line = np.concatenate([self.line, self.line[last]])
        start = np.concatenate([before, self.end[last]])
        end = np.concatenate([self.start, np.full(int(last.sum()), self.cells)])
        some = start < end
        return line[some], start[some], end[some]

    def complement(self, first: int, last: int) -> Runs:
        """Runs of all other cells of lines first .. last - 1; these runs must be of such lines."""
        empty = np.setdiff1d(np.arange(first, last), self.line, assume_unique=False)
        line, start, end = self.gaps
        line = np.concatenate([line, empty])
        start = np.concatenate([start, np.zeros(len(empty), np.int64)])
        end = np.concatenate([end, np.full(len(empty), self.cells)])
        order = np.lexsort((start, line))
        return Runs(line[order], start[order], end[order], self.cells)

    def of(self, line: Index, cell: Index) -> Index:
        """Numbers (k,) of the runs that contain cells (k,) of lines (k,); -1 without one."""
        width = self.cells + 2
        at = np.searchsorted(self.line * width + self.start, line * width + cell, side="right") - 1
        at = np.asarray(at, np.int64)
        known = np.maximum(at, 0)
        if not len(self.line):
            return np.full(len(at), -1)
        held = (at >= 0) & (self.line[known] == line) & (cell < self.end[known])
        return np.where(held, at, -1)


def runs_of(marked: NDArray[np.bool_]) -> Runs:
    """Runs of the marked cells of a grid along its last axis."""
    cells = marked.shape[-1]
    count = marked.size // max(cells, 1)
    at_once = max(1, _AT_ONCE // (cells + 1))
    lead = marked.shape[:-1]
    flat = marked.reshape(count, cells) if marked.flags.c_contiguous else None
    found = []
    for first in range(0, count, at_once):
        last = min(first + at_once, count)
        # A cell that is not marked after each line: no run goes on from one line into the next.
        rows = np.zeros((last - first, cells + 1), bool)
        if flat is not None:
            rows[:, :-1] = flat[first:last]
        else:
            rows[:, :-1] = marked[np.unravel_index(np.arange(first, last), lead)]
        bits = rows.ravel()
        turns = np.flatnonzero(bits[1:] != bits[:-1]) + 1
        if bits[0]:
            turns = np.concatenate([[0], turns])
        begin, end = turns[::2], turns[1::2]
        line = begin // (cells + 1)
        found.append((line + first, begin - line * (cells + 1), end - line * (cells + 1)))
    if not found:
        return Runs(*(np.empty(0, np.int64),) * 3, cells)
    line, start, end = (np.concatenate(each) for each in zip(*found, strict=True))
    return Runs(line, start, end, cells)


def meeting(one: Runs, other: Runs, shift: int, reach: int = 0) -> tuple[Index, Index]:
    """Pairs of runs, numbers (p,) in `one` and (p,) in `other`, with cells over each other.

    shift: offset of the other's line numbers. reach: include runs with ends this many cells apart, 1 for
    cells that touch at a corner.
    """
    width = one.cells + 2
    line = (one.line + shift) * width
    first = np.searchsorted(other.line * width + other.end, line + one.start - reach, side="right")
    last = np.searchsorted(other.line * width + other.start, line + one.end + reach, side="left")
    return ranges(np.maximum(last - first, 0), first)


@attrs.frozen(eq=False)
class Parts:
    """Parts of a grid's marked cells that are connected by the cells' sides.

    shape: of the grid (a, b, c); runs: of the marked cells; part (r,): each run's part; count: of parts.
    """

    shape: tuple[int, ...]
    runs: Runs
    part: NDArray[np.int32]
    count: int

    def at(self, cells: Index) -> Index:
        """Parts (k,) that hold cells (k, 3); -1 where a cell is not marked."""
        run = self.runs.of(cells[:, 0] * self.shape[1] + cells[:, 1], cells[:, 2])
        return np.where(run < 0, -1, self.part[run] if len(self.part) else -1)

    def ends(self, wanted: NDArray[np.bool_] | None = None) -> tuple[Index, Index]:
        """First and last cells of the runs (r, 3); only of those wanted (r,)."""
        r = self.runs
        which = slice(None) if wanted is None else wanted
        line = r.line[which]
        i, j = line // self.shape[1], line % self.shape[1]
        return np.stack([i, j, r.start[which]], axis=1), np.stack([i, j, r.end[which] - 1], axis=1)


def parts_of(marked: NDArray[np.bool_]) -> Parts:
    """Parts of the marked cells of a grid (a, b, c) that are connected by the cells' sides."""
    rows = marked.shape[1]
    runs = runs_of(marked)
    one, other = meeting(runs, runs, 1)
    beside = runs.line[one] % rows != rows - 1
    above, below = meeting(runs, runs, rows)
    part = connected(
        len(runs.line), np.concatenate([one[beside], above]), np.concatenate([other[beside], below])
    )
    return Parts(marked.shape, runs, part, int(part.max(initial=-1)) + 1)
