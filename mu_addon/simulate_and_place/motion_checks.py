"""Checks for doubtful results of a study: each gives figures for the summary, and warnings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

from ..design.quantity import in_kPa
from ..fem.self_intersection import first_self_intersection
from ..fem.state import State, rest

if TYPE_CHECKING:
    from ..fem.protocol import Protocol
    from ..meshing.mesh import Mesh
    from .mechanics import Samples


def doubts_of_protocol(protocol: Protocol, samples: Samples) -> Iterator[str]:
    """Warnings on what a protocol's samples leave out: uniform ones miss its extremes."""
    corners, met = protocol.pressure_kPa, samples.supplied_kPa
    for extreme, nearest in ((corners.min(), met.min()), (corners.max(), met.max())):
        if abs(extreme - nearest) > 1e-6:
            yield (
                f"The protocol goes to {extreme:g} kPa, but its {len(met)} samples reach only "
                f"{nearest:g} kPa: choose a number of samples that includes its extremes."
            )


def would_tear(most: Mapping[str, Any], elongation: float) -> str:
    """Warning of the largest share of a resin's elongation at break, a ratio; "" if it is below 100 %."""
    if most.get("percent", 0.0) <= 100.0:
        return ""
    x, y, z = most["place_mm"]
    return (
        f"The {most['part']} near ({x:g}, {y:g}, {z:g}) mm would tear: at {most['pressure_kPa']:g} kPa "
        f"the stretch takes {most['percent']:.3g} % of the resin's elongation at break, "
        f"{100 * elongation:g} %. Lower the pressure or thicken that part."
    )


# With self-contact, refine 0.7: docs/engineering/verification.md, the paper.
def crossings(mesh: Mesh, states: Sequence[State]) -> dict[str, tuple[str, ...]]:
    """Walls that pass through each other at the first such pressure in kPa, on either side of 0, by that."""
    found = {}
    for sign in (-1, 1):
        outward = sorted((s for s in states if s.pressure_MPa * sign > 0), key=lambda s: abs(s.pressure_MPa))
        still = [s for s in states if s.loaded and not s.pressure_MPa]
        first = first_self_intersection(mesh, [rest(mesh), *still, *outward])
        if first is not None:
            found[f"{in_kPa(first.pressure_MPa):.4g}"] = tuple(str(c) for c in first.crossings)
    return found


def walls_cross(found: Mapping[str, Sequence[str]]) -> Iterator[str]:
    """Warnings of `crossings`."""
    for pressure, walls in found.items():
        yield (
            f"From {pressure} kPa on, walls intersect: {walls[0]}. Self-contact is not "
            f"modelled, so states beyond this pressure are invalid. Use a thicker wall, --self-contact or a "
            "smaller pressure."
        )


def snaps(states: Sequence[State], in_time: bool) -> Iterator[str]:
    """The first pressure on either side beyond a limit point, and how far a node moved.

    For a motion solved instant by instant, the first instant.
    """
    snapped = [s for s in states if s.snapped_mm]
    if in_time:
        ways = [snapped]
    else:
        outward = sorted(snapped, key=lambda s: abs(s.pressure_MPa))
        ways = [[s for s in outward if s.pressure_MPa * sign > 0] for sign in (-1, 1)]
    for way in ways:
        for first in way[:1]:
            yield (
                f"Before {first.pressure_kPa:.4g} kPa parts of the unit snap, by {first.snapped_mm:.2g} "
                "mm at most: later states are those that a damped motion reaches, and unloading "
                "takes a different path."
            )
