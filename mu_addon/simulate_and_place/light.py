"""The light signal of each candidate path: its change with bending."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..design.anchors import anchor_points, windows
from ..design.waveguide import waveguide
from ..errors import InputError
from ..fem.bending_angle import TipSection
from ..report.results import Checks, Signals
from ..run.cache import Cache, key
from ..sensing.embedded_waveguide import EmbeddedWaveguide, Joints, embed_waveguide
from ..sensing.light_law import CURVATURE_OF_WELLS, Law, features, fit_law
from ..sensing.light_signal import (
    best_sets,
    differential_pairs,
    pareto,
    response,
    signal_of_nodes,
    traced_signal,
)
from ..sensing.optics import Optics

if TYPE_CHECKING:
    from ..design.dimensions import Dimensions
    from ..design.parameters import Unit
    from ..fem.trajectory import Trajectory
    from .ranking import Ranking


TABLE = "signals.csv"
# Noise of a reading, as a share of the light: a photodiode and a 10 bit converter.
NOISE = 0.005
# Variation of the curvature of one cell of the backbone, 1/mm: a fifth of the unit's at 40 degrees.
SPREAD = 0.002
_CHECKS = 5


def light_signals(
    unit: Unit,
    optics: Optics,
    motion: Trajectory,
    ranking: Ranking,
    has_gravity: bool,
    cache: Cache,
    update: Callable[[float], None],
) -> tuple[Signals, dict[str, str]]:
    """Light along every candidate path through the motion of Model A, and why some paths have none, by name.

    has_gravity: the unit at rest differs from the drawn one, by its weight. Raises InputError for a unit that
    does not bend, a resin that is too dark, or no path with room for a waveguide.
    """
    anchors = anchor_points(unit)
    law = cached_law(unit.printed, optics, cache, update)
    states = motion.solved
    # The state without pressure comes first, whether or not a sample meets it.
    still = next((s.u for s in states if not s.pressure_MPa), np.zeros_like(motion.mesh.nodes))
    displacements = [still, *(s.u for s in states)]
    tip = TipSection.of(motion.mesh)
    angle = np.array([tip.angle_deg(u) + 0.0 for u in displacements])
    joints = Joints.of(motion.mesh, anchors)
    moved = [joints.moved(u) for u in displacements]
    bars, without = _bars(unit, anchors)
    own = {name: [(at[i], turned[i]) for at, turned in moved] for name, (i, _) in bars.items()}
    found = {name: signal_of_nodes(law, bar, own[name]) for name, (_, bar) in bars.items()}
    responses = [response(angle, signal.transmitted, float(angle[0])) for signal in found.values()]
    errors, slopes = [], []
    for name, (_, bar) in bars.items():
        # Over the whole motion: the law's error grows with what changes.
        ends = [features(bar.shape, bar.legs(*own[name][i])) for i in (angle.argmin(), angle.argmax())]
        errors.append(law.error(ends[1] - ends[0]) / float(np.ptp(angle)))
        slopes.append(_by_cell(law, bar, anchors))
    names = tuple(bars)
    solved, bounds = ranking.J_hat_mm, ranking.at_least_mm
    J, known = np.array([solved.get(n, bounds.get(n)) for n in names]), [name in solved for name in names]
    best = names[int(np.where(known, J, np.inf).argmin())]
    checks = _checked(bars[best][1], own[best], angle, optics, has_gravity)
    sizes = [size for size in (2, 3) if size <= len(names)]
    sets = [best for size in sizes for best in best_sets(SPREAD * np.array(slopes), NOISE, size)]
    pairs = differential_pairs([r.sensitivity_per_deg for r in responses])
    light = Signals(
        optics=optics,
        law=law,
        names=names,
        responses=tuple(responses),
        errors_per_deg=np.array(errors),
        at_rest=np.array([s.transmitted[0] if has_gravity else s.at_rest for s in found.values()]),
        checks=checks,
        j_hat=J,
        front=tuple(pareto(J.tolist(), [r.sensitivity_per_deg for r in responses], known)),
        solved=tuple(known),
        sets=_named(names, sets),
        differential=_named(names, pairs),
    )
    return light, without


def _bars(
    unit: Unit, anchors: Array
) -> tuple[dict[str, tuple[list[int], EmbeddedWaveguide]], dict[str, str]]:
    """Anchors' numbers and waveguide of every candidate path, and why some have none, by name.

    Raises InputError if no path has room.
    """
    found, without, why = {}, {}, None
    for window in windows(len(anchors)):
        numbers = list(window.indices)
        try:
            bar = waveguide(unit, window)
        except InputError as error:
            why, without[window.name] = error, error.what
            continue
        found[window.name] = numbers, embed_waveguide(bar, anchors[numbers], unit.printed)
    if why is not None and not found:
        raise why
    return found, without


def _checked(
    bar: EmbeddedWaveguide, moved: list[tuple[Array, Array]], angle: Array, optics: Optics, has_gravity: bool
) -> Checks:
    """Rays through a bar at rest, at its ends of the motion and between them; `moved` begins with rest.

    has_gravity: True if the unit at rest differs from the drawn one, by its weight.
    """
    order = np.argsort(angle, kind="stable")
    some = order[np.unique(np.linspace(0, len(order) - 1, _CHECKS).astype(int))]
    light = traced_signal(bar, [*moved[:has_gravity], *(moved[i] for i in some)], optics)
    share, errors = light.transmitted[has_gravity:], light.errors[has_gravity:]
    delta = 1 - share / (light.transmitted[0] if has_gravity else light.at_rest)
    return Checks(angle[some], delta, errors * (1 - delta))


def _named(names: Sequence[str], chosen: Any) -> tuple[tuple[tuple[str, ...], float], ...]:
    return tuple((tuple(names[i] for i in numbers), float(value)) for numbers, value in chosen)


def cached_law(
    d: Dimensions, optics: Optics, cache: Cache, on_trace: Callable[[float], None] = lambda share: None
) -> Law:
    """The fast law of a unit's waveguide, from a cache if it was fitted before; on_trace: share done."""
    sizes = (
        d.cell, d.waveguide_section, d.well_width, d.well_depth, d.well_pitch, d.waveguide_end,
        d.junction_diameter,
    )  # fmt: skip
    name = key("light", 3, sizes, attrs.astuple(optics))
    stored = cache.get("light", name)
    if stored is None:
        law = fit_law(d, optics, on_trace=on_trace)
        arrays = {"coefficients": law.coefficients, "covariance": law.covariance, "rms": np.array(law.rms)}
        cache.put("light", name, arrays)
        return law
    return Law(stored["coefficients"], stored["covariance"], float(stored["rms"]))


def _by_cell(law: Law, bar: EmbeddedWaveguide, anchors: Array) -> Array:
    """d log(light) by the curvature of each cell along the anchors, (n,) in mm, at rest."""
    wells = np.asarray(bar.shape.wells) + bar.points[0, 2]
    edges = np.concatenate([[-np.inf], (anchors[1:, 2] + anchors[:-1, 2]) / 2, [np.inf]])
    return -law.coefficients[CURVATURE_OF_WELLS] * np.histogram(wells, edges)[0]


COLUMNS = (
    "path", "J_hat_mm", "sensitivity_per_deg", "its_error", "monotonic_from_deg", "monotonic_to_deg",
    "span", "transmitted_at_rest", "pareto",
)  # fmt: skip


def rows(found: Signals) -> list[tuple[Any, ...]]:
    """Rows of signals.csv."""
    return [
        (
            name,
            f"{found.j_hat[k]:.9g}" if found.solved[k] else "",
            f"{r.sensitivity_per_deg:.6g}",
            f"{found.errors_per_deg[k]:.3g}",
            f"{r.monotonic_deg[0]:.4g}",
            f"{r.monotonic_deg[1]:.4g}",
            f"{r.span:.6g}",
            f"{found.at_rest[k]:.6g}",
            "" if found.front[k] is None else int(bool(found.front[k])),
        )
        for k, (name, r) in enumerate(zip(found.names, found.responses, strict=True))
    ]


def figures(found: Signals) -> dict[str, Any]:
    """Figures of summary.json."""
    by_name = dict(zip(found.names, found.responses, strict=True))
    return {
        "optics": attrs.asdict(found.optics),
        "law_rms": found.law.rms,
        "sensitivity_per_deg": {n: r.sensitivity_per_deg for n, r in by_name.items()},
        "monotonic_deg": {n: r.monotonic_deg for n, r in by_name.items()},
        "pareto": [n for n, on in zip(found.names, found.front, strict=True) if on],
        "differential_pairs": [
            {"paths": names, "sensitivity_per_deg": value} for names, value in found.differential
        ],
        "traced": {
            "angle_deg": found.checks.angle_deg.tolist(),
            "delta": found.checks.delta.tolist(),
            "error": found.checks.errors.tolist(),
        },
        "sets": [{"paths": names, "information": value} for names, value in found.sets],
    }
