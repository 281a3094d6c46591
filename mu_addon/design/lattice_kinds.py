"""Kinds of lattice by name: nodes and struts of one cell, and a strut's radius along its length.

A kind is a file of `assets/lattices`, or the text of a unit's own struts; solids, meshes and moduli follow.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from fractions import Fraction
from functools import cache, cached_property
from itertools import product
from pathlib import Path
from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import Array
from ..errors import InputError
from ..toml_reader import read_toml
from .assets import asset_file, asset_names

RadiusLaw = Callable[[Array, float, float], Array]

_FINEST = 64
"""Largest denominator of a node's coordinates, so that shared nodes are found exactly."""
CUSTOM = "custom"
"""Name of the kind whose struts a unit states itself."""

_MOST = 200
_NUMBER = re.compile(r"\d(?:/[1-9]\d?|\.\d{1,12})?")
_EXAMPLE = '"0 1/2 1/2 to 1/2 1/2 1/2; ..."'


def sin_squared(t: Array, junction_radius: float, midspan_radius: float) -> Array:
    """Strut radius at fractions t (0 .. 1, any shape) of the length, in the unit and shape of its arguments.

    r_junction + (r_midspan - r_junction) sin^2(pi t): the junction's at both ends, the mid-span's at t = 1/2.
    An array of the shape of t (any shape).

    >>> sin_squared(np.array([0.0, 0.5, 1.0]), 0.75, 1.0).tolist()
    [0.75, 1.0, 0.75]
    """
    swell = np.sin(np.pi * np.asarray(t, dtype=float)) ** 2
    return np.asarray(junction_radius + (midspan_radius - junction_radius) * swell)


def constant(t: Array, junction_radius: float, midspan_radius: float) -> Array:
    """The mid-span's radius at all fractions t (any shape), in its unit; an array of that shape (any shape).

    The junction's radius is ignored.
    """
    return np.full_like(np.asarray(t, dtype=float), midspan_radius)


def _coordinates(value: ArrayLike) -> Array:
    return np.array(value, dtype=float).reshape(-1, 3)


def _pairs(value: ArrayLike) -> NDArray[np.int64]:
    return np.array(value, dtype=np.int64).reshape(-1, 2)


def _content(array: NDArray[Any]) -> tuple[Any, ...]:
    return tuple(array.ravel().tolist())


@attrs.frozen
class LatticeKind:
    """One cell of a lattice, to be repeated along x, y and z.

    nodes (n, 3): in a cell of side 1, within [0, 1]^3, including those on faces and corners; every coordinate
    is a fraction with a denominator of at most 64. struts (e, 2): pairs of nodes, including struts shared
    with neighbours. radius(t, junction_radius, midspan_radius): strut radius at t (array, 0 .. 1), symmetric
    about t = 1/2. Raises InputError for nodes outside the cell or listed twice, for missing, doubled, invalid
    or crossing struts, and for a radius that is not symmetric and positive.
    """

    name: str
    nodes: Array = attrs.field(converter=_coordinates, eq=_content, repr=False)
    struts: NDArray[np.int64] = attrs.field(converter=_pairs, eq=_content, repr=False)
    radius: RadiusLaw = sin_squared

    def __attrs_post_init__(self) -> None:
        n = len(self.nodes)
        t = np.linspace(0.0, 1.0, 11)
        one = np.asarray(self.radius(t, 1.0, 2.0))
        if not (np.isfinite(self.nodes).all() and (self.nodes >= 0).all() and (self.nodes <= 1).all()):
            raise self._refused("has a node outside its cell", "give coordinates from 0 to 1")
        if np.abs(self.grid / self.divisions - self.nodes).max(initial=0.0) > 1e-9:
            raise self._refused(
                "has a node that is not at a simple fraction of the cell",
                f"use coordinates of a denominator up to {_FINEST}, so that shared nodes are found exactly",
            )
        if len(np.unique(self.grid, axis=0)) < n:
            raise self._refused("has two nodes at the same position", "list each node once")
        if not len(self.struts) or self.struts.min() < 0 or self.struts.max() >= n:
            raise self._refused(
                "has no struts, or a strut to a node that does not exist", "count nodes from 0"
            )
        ends = np.sort(self.struts, axis=1)
        if (ends[:, 0] == ends[:, 1]).any() or len(np.unique(ends, axis=0)) < len(ends):
            raise self._refused("has a duplicate strut or one of zero length", "list each strut once")
        if self.opening < 1e-9:
            raise self._refused("has struts that cross where there is no node", "split them at a node")
        if one.shape != t.shape or not np.allclose(one, one[::-1]) or not (one > 0).all():
            raise self._refused(
                "has a radius that depends on a strut's direction or is not positive",
                "give radius(t) = radius(1 - t) > 0",
            )

    def _refused(self, what: str, remedy: str) -> InputError:
        return InputError(f"lattice {self.name!r} {what}", "lattice kind", remedy)

    @cached_property
    def divisions(self) -> int:
        """Smallest even number of parts of the cell's side that gives all nodes whole coordinates."""
        parts = {Fraction(x).limit_denominator(_FINEST).denominator for x in self.nodes.ravel().tolist()}
        return math.lcm(2, *parts)

    @cached_property
    def grid(self) -> NDArray[np.int64]:
        """Nodes (n, 3) as whole numbers, in units of the cell's side over `divisions`."""
        return np.rint(self.nodes * self.divisions).astype(np.int64)

    @cached_property
    def inside(self) -> NDArray[np.bool_]:
        """True for each node in the interior of the cell, (n,), not shared with a neighbour."""
        return np.asarray(((self.grid > 0) & (self.grid < self.divisions)).all(axis=1))

    @cached_property
    def on_face(self) -> NDArray[np.bool_]:
        """True for each strut that lies in a face of the cell, (e,), where a neighbour may share it."""
        first, second = self.grid[self.struts[:, 0]], self.grid[self.struts[:, 1]]
        return np.asarray(((first == second) & (first % self.divisions == 0)).any(axis=1))

    @cached_property
    def is_half_diagonals(self) -> bool:
        """True if the struts are the eight half diagonals of the cell, from its centre to its corners."""
        apart = np.abs(np.diff(self.nodes[self.struts], axis=1)) == 0.5
        return bool(apart.all() and len(self.struts) == 8)

    @cached_property
    def opening(self) -> float:
        """Smallest distance, in cells, between the axes of two struts without a common node.

        Struts of this diameter touch between their nodes, and the openings of the cell close. inf where every
        two struts share a node.
        """
        here = self.grid[self.struts]
        shifts = np.array(list(product((-1, 0, 1), repeat=3))) * self.divisions
        every = (here + shifts[:, None, None]).reshape(-1, 2, 3)
        first = np.repeat(here, len(every), axis=0)
        second = np.tile(every, (len(here), 1, 1))
        apart = ~(first[:, :, None] == second[:, None]).all(axis=3).any(axis=(1, 2))
        return float(_distances(first[apart], second[apart]).min(initial=np.inf)) / self.divisions

    @cached_property
    def mirrors(self) -> tuple[bool, bool, bool]:
        """True if the periodic lattice is symmetric about the cell's mid-planes normal to x, y and z."""
        period = self.divisions

        def skeleton(grid: NDArray[np.int64]) -> set[tuple[int, ...]]:
            found = set()
            for a, b in self.struts.tolist():
                for start, end in ((grid[a], grid[b]), (grid[b], grid[a])):
                    found.add((*(start % period).tolist(), *(end - start).tolist()))
            return found

        here = skeleton(self.grid)
        x, y, z = (bool(skeleton(self.grid * np.where(np.arange(3) == k, -1, 1)) == here) for k in range(3))
        return x, y, z


def _distances(first: NDArray[np.int64], second: NDArray[np.int64]) -> Array:
    """Least distance (n,) between segments, their ends (n, 2, 3).

    It lies between an end and the other segment or, where both feet fall inside, between the two lines.
    """
    found = np.full(len(first), np.inf)
    for one, other in ((first, second), (second, first)):
        axis = (other[:, 1] - other[:, 0]).astype(float)
        for end in (0, 1):
            away = (one[:, end] - other[:, 0]).astype(float)
            t = np.clip(np.sum(away * axis, 1) / np.sum(axis**2, 1), 0.0, 1.0)
            found = np.minimum(found, np.linalg.norm(away - t[:, None] * axis, axis=1))
    u, v, w = (
        x.astype(float)
        for x in (first[:, 1] - first[:, 0], second[:, 1] - second[:, 0], first[:, 0] - second[:, 0])
    )
    a, b, c, d, e = (np.sum(p * q, 1) for p, q in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    det = a * c - b * b
    skew = det > 1e-9 * a * c
    s, t = np.full(len(u), -1.0), np.full(len(u), -1.0)
    s[skew] = ((b * e - c * d) / np.where(skew, det, 1.0))[skew]
    t[skew] = ((a * e - b * d) / np.where(skew, det, 1.0))[skew]
    inner = (s >= 0) & (s <= 1) & (t >= 0) & (t <= 1)
    gap = np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1)
    return np.where(inner, np.minimum(found, gap), found)


@cache
def names() -> tuple[str, ...]:
    """Names of all kinds of lattice: those of the files in `assets/lattices`, and CUSTOM."""
    return (*asset_names("lattices"), CUSTOM)


@cache
def kind(name: str, struts: str = "") -> LatticeKind:
    """The lattice kind of this name; struts: the text of CUSTOM's. Raises InputError."""
    if name == CUSTOM:
        return parsed(name, struts, "[lattice] struts")
    if name not in names():
        raise InputError(
            f"there is no lattice {name!r}", "[lattice] kind", f"choose one of {', '.join(names())}"
        )
    path = asset_file("lattices", "lattice", name)
    return parsed(name, read_struts(path), str(path))


def read_struts(path: Path) -> str:
    """The canonical text of the struts in a file of a lattice kind. Raises InputError."""
    struts = read_toml(path, "lattice kind", "give a TOML file").only(("struts",)).word("struts")
    return text_of(parsed(path.stem, struts, str(path)))


def parsed(name: str, text: str, where: str) -> LatticeKind:
    """The kind whose struts a text lists by their ends, as "0 0 0 to 1/2 1/2 1/2; ...".

    Ends are in cells; `straight` in front: of the mid-span's diameter throughout, else tapered. where: for
    messages. Raises InputError.
    """
    entries = [entry.strip() for entry in text.replace("\n", ";").split(";") if entry.strip()]
    straight = entries[:1] == ["straight"]
    number: dict[tuple[Fraction, ...], int] = {}
    struts = []
    for entry in entries[straight:]:
        ends = [end.split() for end in entry.split(" to ")]
        if [len(end) for end in ends] != [3, 3] or not all(_NUMBER.fullmatch(x) for end in ends for x in end):
            raise InputError(f"{entry[:60]!r} is not a strut between two nodes", where, f"write {_EXAMPLE}")
        nodes = [tuple(map(Fraction, end)) for end in ends]
        struts.append([number.setdefault(node, len(number)) for node in nodes])
    if len(struts) > _MOST:
        raise InputError(f"a cell of {len(struts)} struts", where, f"give {_MOST} at most")
    try:
        return LatticeKind(
            name,
            [[float(x) for x in node] for node in number],
            struts,
            constant if straight else sin_squared,
        )
    except InputError as error:
        raise InputError(error.what, where, error.remedy) from error


def text_of(kind: LatticeKind) -> str:
    """The struts of a kind as `parsed` takes them, on one line. Raises InputError for another radius.

    >>> text_of(kind("body-centred"))[:46]
    '1/2 1/2 1/2 to 0 0 0; 1/2 1/2 1/2 to 0 0 1; 1/'
    """
    if kind.radius not in (constant, sin_squared):
        raise InputError(
            f"the radius of lattice {kind.name!r} has no text", "lattice kind", "take one of two"
        )
    nodes = [" ".join(str(Fraction(x, kind.divisions)) for x in node) for node in kind.grid.tolist()]
    struts = [f"{nodes[a]} to {nodes[b]}" for a, b in kind.struts.tolist()]
    return "; ".join([*(["straight"] if kind.radius is constant else []), *struts])


def canonical_text(text: str) -> str:
    """One text for all that list the same struts in the same order; "" for "". Raises InputError."""
    return text_of(kind(CUSTOM, text)) if text.strip() else ""
