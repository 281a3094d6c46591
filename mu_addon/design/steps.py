"""The design as a chain of steps; each is evaluated again only if its inputs have changed.

    profile -> chambers -> membranes
       \\-> cells -> trim -> grading -> struts
              \\-> anchors -> path -> wells
                                        \\-> solid, of all of them

A step has parameters of the unit and may read those of other steps. Its value is cached under a key of all
its inputs, so that a slider, an undo or another unit of the same shape recomputes only changed steps. A muted
step passes its input on unchanged.
"""

from __future__ import annotations

import hashlib
from collections import Counter, OrderedDict
from collections.abc import Callable
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from ..arrays import Array
from ..errors import InputError
from .anchors import SHORTEST, Window, anchor_points, window
from .body import Body, covering, inside
from .grading import Grading
from .lattice import Graph, Lattice, graph_of, with_struts
from .parameters import Chambers, Envelope, Unit, Waveguide
from .profile import cavity_polygon, outer_polygon, outer_radius
from .quantity import describe
from .settings import QUALITY
from .solid import Solid, build_solid
from .waveguide import Bar, waveguide

ALONG = 4
"""Number of flat pieces along a quarter of a chamber in the polygons of `profile` and `chambers`."""
FINE = np.linspace(0.0, 1.0, 33)
"""Number of positions along a strut at which `trim` tests whether it is still outside the actuator."""
CLEARANCE = 0.018
"""Distance, in cells, that `trim` keeps between a strut's axis and the actuator: none shows inside."""
KEPT = 12
"""Number of cached values of a step: enough for an undo, a slider moved back, and a few units."""


@attrs.frozen
class StepInputs:
    """Inputs of the steps: a unit, the name of a path or "", and the names of muted steps.

    quality: as in `build_solid`; body: a body in place of the lattice's box, cut by `body.envelope`, or None.
    Raises InputError for a muted step that does not exist or cannot be muted.
    """

    unit: Unit
    path: str = ""
    muted: frozenset[str] = attrs.field(default=frozenset(), converter=frozenset)
    quality: str = QUALITY.default
    body: Body | None = None

    def __attrs_post_init__(self) -> None:
        for name in self.muted:
            if name not in STEPS:
                raise _unknown(name)
            if not STEPS[name].muting:
                raise InputError(
                    f"the step {name} cannot be muted", name, "all other steps need it: do not mute it"
                )


@attrs.frozen(eq=False)
class Section:
    """Half sections, radius and z in mm: outer profile (n, 2), inlet (4, 2), and cavity (m, 2) or None.

    The inlet is drawn from the inner end of its bore out around the boss.
    """

    outer: Array
    inlet: Array
    cavity: Array | None


@attrs.frozen(eq=False)
class TrimmedStruts:
    """Visible struts: ends (e, 2, 3) in mm of each whole strut, and fractions (e,) of its visible part.

    rows (e,): their numbers among the graph's; is_graded: their diameters follow the unit's grading.
    """

    graph: Graph
    ends: Array
    first: Array
    last: Array
    rows: NDArray[np.int64]
    is_graded: bool = False


@attrs.frozen(eq=False)
class Struts:
    """Trimmed struts and the lattice that gives their radii, None for struts drawn as bare lines."""

    trimmed: TrimmedStruts
    lattice: Lattice | None


@attrs.frozen(eq=False)
class Path:
    """The window that the waveguide follows and its anchors (n, 3) in mm."""

    window: Window
    points: Array


@attrs.frozen
class Step:
    """One step: its inputs, its parameters, and its value when muted.

    gives: kind of its value: profile, surface, lattice, points, path or solid; after: steps before it, whose
    values `make` gets in this order; own and reads: parameters of the unit as `section.name`; chosen: fields
    of StepInputs it also depends on; muting: describes the effect of muting, "" if it cannot be muted; mute:
    its value then, from the same arguments as `make`.
    """

    name: str
    text: str
    gives: str
    make: Callable[..., Any]
    after: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    reads: tuple[str, ...] = ()
    chosen: tuple[str, ...] = ()
    muting: str = ""
    mute: Callable[..., Any] = lambda *_: None


@attrs.define
class Stack:
    """Cached values of the steps, at most KEPT for each, under a hash of their inputs.

    counts: how often each step was evaluated; a value found in the cache is not counted.
    """

    counts: Counter[str] = attrs.field(factory=Counter)
    _values: dict[str, OrderedDict[str, Any]] = attrs.field(
        factory=lambda: {name: OrderedDict() for name in STEPS}
    )

    def value(self, name: str, given: StepInputs) -> Any:
        """The value of a step, evaluated with the steps before it where it is not cached.

        Raises InputError for an unknown step, and the errors of the steps.
        """
        if name not in STEPS:
            raise _unknown(name)
        return self._value(name, given, keys(given))

    def keep(self, name: str, given: StepInputs, value: Any) -> None:
        """Cache a step's value that was computed elsewhere, for example in another process."""
        self._values[name][keys(given)[name]] = value

    def has(self, name: str, given: StepInputs) -> bool:
        """Return True if a step's value is cached."""
        return keys(given)[name] in self._values[name]

    def again(self, name: str, given: StepInputs) -> Any:
        """The value of a step, evaluated again even if cached; earlier steps only if they are not cached.

        Raises InputError for an unknown step, and the errors of the steps.
        """
        if name not in STEPS:
            raise _unknown(name)
        key = keys(given)
        self._values[name].pop(key[name], None)
        return self._value(name, given, key)

    def _value(self, name: str, given: StepInputs, key: dict[str, str]) -> Any:
        kept = self._values[name]
        if key[name] not in kept:
            step = STEPS[name]
            taken = [self._value(before, given, key) for before in step.after]
            make = step.mute if name in given.muted else step.make
            value = make(given, *taken)
            self.counts[name] += 1
            kept[key[name]] = value
            while len(kept) > KEPT:
                kept.popitem(last=False)
        kept.move_to_end(key[name])
        return kept[key[name]]


def keys(given: StepInputs) -> dict[str, str]:
    """SHA-256, in hexadecimal, of all inputs of each step's value."""
    found: dict[str, str] = {}
    for step in STEPS.values():
        content = [
            step.name,
            step.name in given.muted,
            given.unit.scale,
            *(parameter(given.unit, path) for path in (*step.own, *step.reads)),
            *(_content(getattr(given, name)) for name in step.chosen),
            *(found[name] for name in step.after),
        ]
        found[step.name] = hashlib.sha256(repr(content).encode()).hexdigest()
    return found


def parameter(unit: Unit, path: str) -> Any:
    """Value of a unit's parameter, given as `section.name`."""
    section, name = path.split(".")
    return getattr(getattr(unit, section), name)


def downstream(name: str) -> tuple[str, ...]:
    """Names of the steps that depend on this one, directly or not, in their order."""
    found = {name}
    for step in STEPS.values():
        if found.intersection(step.after):
            found.add(step.name)
    return tuple(step for step in STEPS if step in found and step != name)


def require_whole(given: StepInputs) -> None:
    """Raise InputError where a muted step leaves out a part that the printable solid needs.

    The path may be muted, and without a path also anchors and wells.
    """
    needed = set(STEPS) - {"path", "solid"}
    if not given.path or "path" in given.muted:
        needed -= {"anchors", "wells"}
    missing = [name for name in STEPS if name in needed & given.muted]
    if missing:
        raise InputError(
            f"a solid without {' and '.join(missing)} is not the unit: {STEPS[missing[0]].muting}",
            "muted steps",
            f"unmute {', '.join(missing)}, then build the solid",
        )


def _content(value: Any) -> Any:
    return value.hash if isinstance(value, Body) else value


def _unknown(name: str) -> InputError:
    return InputError(f"there is no step {name!r}", "steps", f"choose one of {', '.join(STEPS)}")


# Functions of the steps. Each reads only what its Step declares, which a test checks.


def _profile(given: StepInputs) -> Array:
    return outer_polygon(given.unit.dimensions, ALONG)


def _chambers(given: StepInputs, profile: Array) -> Array:
    return cavity_polygon(given.unit.dimensions, ALONG)


def _membranes(given: StepInputs, profile: Array, cavity: Array | None) -> Section:
    d = given.unit.dimensions
    boss = d.inlet_radius + d.inlet_wall
    bore = [[d.inlet_radius, d.base_cap], [d.inlet_radius, -d.inlet_length]]
    inlet = np.array([*bore, [boss, -d.inlet_length], [boss, 0.0]])
    return Section(profile, inlet, cavity)


def _cells(given: StepInputs, profile: Array) -> Graph:
    d = given.unit.dimensions
    return graph_of(covering(d, given.body))


def _trim(given: StepInputs, profile: Array, graph: Graph | None) -> TrimmedStruts | None:
    if graph is None:
        return None
    d = given.unit.dimensions
    ends = graph.nodes[graph.struts]
    at = along(ends, FINE)
    shown = np.hypot(at[..., 0], at[..., 1]) >= outer_radius(d, at[..., 2]) + CLEARANCE * d.cell
    if given.body is not None:
        shown &= inside(given.body, at)
    left = shown.any(axis=1)
    ends, shown = ends[left], shown[left]
    rows = np.flatnonzero(left)
    last = FINE[len(FINE) - 1 - shown[:, ::-1].argmax(axis=1)]
    return TrimmedStruts(graph, ends, FINE[shown.argmax(axis=1)], last, rows)


def _untrimmed(given: StepInputs, profile: Array, graph: Graph | None) -> TrimmedStruts | None:
    if graph is None:
        return None
    ends = graph.nodes[graph.struts]
    return TrimmedStruts(graph, ends, np.zeros(len(ends)), np.ones(len(ends)), np.arange(len(ends)))


def _grading(given: StepInputs, trimmed: TrimmedStruts | None) -> TrimmedStruts | None:
    if trimmed is None or given.unit.dimensions.grading is None:
        return trimmed
    return attrs.evolve(trimmed, is_graded=True)


def _ungraded(given: StepInputs, trimmed: TrimmedStruts | None) -> TrimmedStruts | None:
    return trimmed


def _struts(given: StepInputs, trimmed: TrimmedStruts | None) -> Struts | None:
    if trimmed is None:
        return None
    return Struts(trimmed, with_struts(trimmed.graph, given.unit.dimensions, trimmed.is_graded))


def _lines(given: StepInputs, trimmed: TrimmedStruts | None) -> Struts | None:
    return None if trimmed is None else Struts(trimmed, None)


def _anchors(given: StepInputs, graph: Graph | None) -> Array:
    return anchor_points(given.unit)


def _path(given: StepInputs, points: Array | None) -> Path | None:
    if not given.path or points is None:
        return None
    found = window(given.unit, given.path)
    return Path(found, points[list(found.indices)])


def _wells(given: StepInputs, path: Path | None) -> Bar | None:
    if path is None:
        return None
    d = given.unit.dimensions
    return waveguide(given.unit, path.window, covering(d, given.body))


def _without_wells(given: StepInputs, path: Path | None) -> Bar | None:
    bar = _wells(given, path)
    return None if bar is None else attrs.evolve(bar, wells=bar.wells[:0])


def _solid(given: StepInputs, *_: Any) -> Solid:
    require_whole(given)
    chosen = bool(given.path) and "path" not in given.muted
    path = window(given.unit, given.path) if chosen else None
    return build_solid(given.unit, path, given.quality, given.body)


def along(ends: Array, t: Array) -> Array:
    """Points (e, n, 3) on the lines between ends (e, 2, 3), at fractions t of shape (n,) or (e, n); in mm."""
    return np.asarray(ends[:, :1] + t[..., None] * (ends[:, 1:] - ends[:, :1]))


def _all_of(section: type[Chambers | Envelope | Grading | Waveguide]) -> tuple[str, ...]:
    return tuple(f"{section.section}.{d.name}" for d in describe(section))


_PROFILE = (
    "chambers.count",
    "chambers.cell_mm",
    "chambers.bladder_diameter_mm",
    "chambers.neck_diameter_mm",
    "chambers.bladder_share",
)
_WALL = ("chambers.wall_mm", "chambers.wall_factors")
_CHAMBERS = ("chambers.wall_mm", "chambers.base_cap_mm", "chambers.tip_cap_mm", "chambers.wall_factors")
_STRUTS = ("lattice.junction_diameter_mm", "lattice.midspan_diameter_mm")
_GRADING = _all_of(Grading)
_PITCH = ("chambers.count", "chambers.cell_mm")
_WELLS = tuple(p for p in _all_of(Waveguide) if p.startswith("waveguide.well_"))
_ROW = ("waveguide.row",)


def _rest(section: type[Chambers | Envelope | Waveguide]) -> tuple[str, ...]:
    """The section's parameters without another step, so that a new one has a step automatically."""
    owned = {*_PROFILE, *_CHAMBERS, *_STRUTS, *_WELLS, *_ROW}
    return tuple(p for p in _all_of(section) if p not in owned)


STEPS: dict[str, Step] = {
    step.name: step
    for step in (
        Step("profile", "outer profile of bladders and necks", "profile", _profile, own=_PROFILE),
        Step(
            "chambers",
            "cavity inside a constant wall",
            "surface",
            _chambers,
            ("profile",),
            _CHAMBERS,
            _PROFILE,
            muting="the actuator stays a full body, without a cavity",
        ),
        Step(
            "membranes",
            "wall of the chambers, with the inlet",
            "surface",
            _membranes,
            ("profile", "chambers"),
            _rest(Chambers),
            muting="a lattice without an actuator",
        ),
        Step(
            "cells",
            "cells of the lattice envelope",
            "lattice",
            _cells,
            ("profile",),
            _rest(Envelope),
            _PITCH,
            ("body",),
            muting="an actuator without a lattice",
        ),
        Step(
            "trim",
            "struts trimmed where they enter the actuator or leave a user-defined body",
            "lattice",
            _trim,
            ("profile", "cells"),
            reads=_PROFILE,
            chosen=("body",),
            muting="struts run through wall and chambers",
            mute=_untrimmed,
        ),
        Step(
            "grading",
            "factors on the struts' diameters over the envelope",
            "lattice",
            _grading,
            ("trim",),
            _GRADING,
            muting="struts are alike everywhere",
            mute=_ungraded,
        ),
        Step(
            "struts",
            "thickness of the struts, tapered to their ends",
            "lattice",
            _struts,
            ("grading",),
            _STRUTS,
            muting="struts are lines without thickness",
            mute=_lines,
        ),
        Step(
            "anchors",
            "anchors P1 .. Pn for the sensor",
            "points",
            _anchors,
            ("cells",),
            _ROW,
            _PITCH,
            muting="without anchors there is no path",
        ),
        Step(
            "path",
            f"a window of {SHORTEST} or more anchors that the waveguide follows",
            "path",
            _path,
            ("anchors",),
            _rest(Waveguide),
            _PITCH,
            chosen=("path",),
            muting="the unit has no waveguide",
        ),
        Step(
            "wells",
            "the waveguide's bar, with wells at a constant pitch",
            "path",
            _wells,
            ("path",),
            _WELLS,
            (*_PROFILE, *_STRUTS, *_GRADING, *_WALL),
            muting="a bar without wells is not sensitive to the bending direction",
            mute=_without_wells,
        ),
        Step(
            "solid",
            "the printable body, checked by its gates",
            "solid",
            _solid,
            ("membranes", "struts", "wells"),
            chosen=("quality", "body"),
        ),
    )
}
