"""Branches of equilibria followed through limit points, and the critical points they pass."""

from __future__ import annotations

from typing import Any, Literal

import attrs
import numpy as np

from ..errors import ConvergenceError
from .arc_length import Arc, Body, ContinuationSettings, Node, Point
from .state import State

Array = np.ndarray[Any, Any]

Kind = Literal["limit point", "bifurcation"]
Ending = Literal["pressure reached", "volume reached", "critical point", "most points"]


@attrs.frozen(eq=False)
class Critical:
    """A limit point, where pressure turns, or a bifurcation, where another branch crosses.

    accuracy_MPa: of its pressure. volume_mm3: of the cavity. mode (n, 3): the displacement that meets no
    resistance there, its largest 1. place (3,): where that is, deformed, in mm.
    """

    kind: Kind
    state: State
    accuracy_MPa: float
    volume_mm3: float
    mode: Array
    place: Array

    def __str__(self) -> str:
        x, y, z = self.place
        return f"{self.kind} at {self.state.pressure_kPa:.4g} kPa near ({x:.1f}, {y:.1f}, {z:.1f}) mm"


@attrs.frozen(eq=False)
class Branch:
    """Points of a branch in order from its start, the critical points passed, and why it ends.

    ended: "pressure reached", "volume reached", "critical point" or "most points".
    """

    points: tuple[Point, ...]
    criticals: tuple[Critical, ...]
    ended: Ending

    @property
    def pressure_MPa(self) -> Array:
        """Pressure in MPa of every point, (k,)."""
        return np.array([p.state.pressure_MPa for p in self.points])

    @property
    def volume_mm3(self) -> Array:
        """Cavity volume in mm3 of every point, (k,)."""
        return np.array([p.volume_mm3 for p in self.points])

    @property
    def negative(self) -> Array:
        """Number of negative eigenvalues of the tangent at every point, (k,); 0 is stable."""
        return np.array([p.negative for p in self.points])


def trace_branch(
    body: Body,
    start: State,
    *,
    until_MPa: float | None = None,
    until_mm3: float | None = None,
    toward: float = 1.0,
    stop_at_critical: bool = False,
    settings: ContinuationSettings | None = None,
) -> Branch:
    """The branch of equilibria from a converged state, through limit points, by arc-length continuation.

    It ends where it first reaches the pressure until_MPa or the cavity volume until_mm3, at the first
    critical point (stop_at_critical), or after settings.max_points. It sets out toward the target, else to
    higher (toward > 0) or lower pressure. body: an `Equilibrium`.

    Mirror planes of the mesh hide bifurcations into shapes that lack their symmetry. Raises
    ConvergenceError where the smallest step fails. Sources: Keller (1977); Riks, J. Appl. Mech. 39 (1972)
    1060.
    """
    s = settings or ContinuationSettings()
    arc = Arc(body, start, s)
    node = arc.begin()
    if until_MPa is not None:
        toward = until_MPa - node.z[-1]
    elif until_mm3 is not None:
        toward = (until_mm3 - node.point.volume_mm3) * node.point.compliance
    if toward < 0:
        node = node.reversed()
    step = first = s.first_step_MPa / abs(node.point.slope)
    points, criticals = [node.point], list[Critical]()
    ended: Ending | None = None
    while ended is None and len(points) < s.max_points:
        try:
            new = arc.advance(node, step)
            if _entangled(node, new) and step > first / 16:
                raise ConvergenceError("several critical points in one step")
            new, ended = _landed(arc, node, new, until_MPa, until_mm3)
            found = _criticals(arc, node, new)
        except ConvergenceError as why:
            ended, step = None, step / 2
            if step < s.min_step * first:
                raise _failure(body, node, why.what) from None
            continue
        criticals += found
        points.append(new.point)
        if found and stop_at_critical:
            ended = "critical point"
        turn = np.arccos(np.clip(arc.product(node.direction, new.direction), -1, 1))
        step *= float(np.clip(s.turn / max(turn, 1e-12), 0.5, 2.0))
        node = new
    return Branch(tuple(points), tuple(criticals), ended or "most points")


def limit_pressure(body: Body, last: State, toward: float) -> Critical | None:
    """The first critical point on the way from a converged state to a pressure `toward` in MPa, or None.

    None means that the branch reaches that pressure without one, or that none was found among 30 points.
    Raises ConvergenceError where the branch cannot be traced.
    """
    # Load stepping gives up within its smallest step of what stops it.
    settings = ContinuationSettings(first_step_MPa=body.settings.min_step_MPa, max_points=30)
    branch = trace_branch(body, last, until_MPa=toward, stop_at_critical=True, settings=settings)
    return branch.criticals[0] if branch.criticals else None


def _landed(
    arc: Arc, before: Node, after: Node, until_MPa: float | None, until_mm3: float | None
) -> tuple[Node, Ending | None]:
    """The target between two nodes and its name, or the second node where there is none."""
    if until_MPa is not None and _passed(before.z[-1], after.z[-1], until_MPa):
        return arc.at_pressure(before, after, until_MPa), "pressure reached"
    volumes = before.point.volume_mm3, after.point.volume_mm3
    if until_mm3 is not None and _passed(*volumes, until_mm3):
        return arc.at_volume(before, after, until_mm3), "volume reached"
    return after, None


def _passed(before: float, after: float, target: float) -> bool:
    return (before - target) * (after - target) < 0 or after == target


def _turned(before: Node, after: Node) -> bool:
    return bool(before.direction[-1] * after.direction[-1] < 0)


def _entangled(before: Node, after: Node) -> bool:
    """Return True if more happened between two nodes than one critical point explains."""
    change = abs(after.point.negative - before.point.negative)
    return change > 1 or (_turned(before, after) and change == 0)


def _criticals(arc: Arc, before: Node, after: Node) -> list[Critical]:
    """Critical points between two nodes, by the pressure's slope and the number of negative eigenvalues.

    A turn explains a change by one: the determinant of the tangent changes sign with the pressure's slope.
    """
    turned = _turned(before, after)
    change = abs(after.point.negative - before.point.negative)
    found = [_locate(arc, before, after, "limit point")] if turned else []
    if change > int(turned):
        found.append(_locate(arc, before, after, "bifurcation"))
    return found


def _locate(arc: Arc, before: Node, after: Node, kind: Kind) -> Critical:
    """The critical point between two nodes, by the Illinois method on the length from the first.

    Its function is the slope of pressure, or the eigenvalue nearest zero with the sign that the number of
    negative ones tells. Source: Dowell and Jarratt, BIT 11 (1971) 168.
    """

    def value(node: Node) -> float:
        if kind == "limit point":
            return node.point.slope
        least = abs(arc.softest(node.z)[0])
        return least if node.point.negative == before.point.negative else -least

    low, high = 0.0, arc.product(before.direction, after.z - before.z)
    at_low, at_high = value(before), value(after)
    for _ in range(30):
        rate = (at_high - at_low) / (high - low)
        length = low - at_low / rate
        node = arc.advance(before, length)
        here = value(node)
        # The length is off by about here / rate.
        error = abs(node.point.slope * here / rate)
        if error <= arc.settings.accuracy * max(abs(node.z[-1]), arc.settings.first_step_MPa):
            break
        if here * at_low > 0:
            low, at_low, at_high = length, here, at_high / 2
        else:
            high, at_high, at_low = length, here, at_low / 2
    _, mode = arc.softest(node.z)
    u = node.point.state.u
    place = (arc.model.mesh.nodes + u)[np.linalg.norm(mode, axis=1).argmax()]
    return Critical(kind, node.point.state, error, node.point.volume_mm3, mode, place)


def _failure(body: Body, node: Node, why: str) -> ConvergenceError:
    point = node.point
    least, element = body.model.smallest_jacobian(point.state.u, body.parameters)
    nodes = body.model.mesh.tets[element]
    x, y, z = (body.model.mesh.nodes[nodes] + point.state.u[nodes]).mean(axis=0)
    return ConvergenceError(
        f"the branch cannot be followed beyond {point.state.pressure_kPa:.4g} kPa and "
        f"{point.volume_mm3:.4g} mm3: {why}",
        f"its last point's most distorted element is {element} near ({x:.1f}, {y:.1f}, {z:.1f}) mm with "
        f"det F = {least:.3g}",
        "refine the mesh there, or stop before this point",
    )
