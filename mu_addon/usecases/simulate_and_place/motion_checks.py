"""Checks for doubtful results of a study: each gives figures for the summary, and warnings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ...design.quantity import in_kPa
from ...fem.self_intersection import first_self_intersection
from ...fem.state import State, rest

if TYPE_CHECKING:
    from ...meshing.mesh import Mesh
    from .job import Job


# With self-contact, refine 0.7: docs/engineering/verification.md, the paper.
def doubts_of_job(job: Job) -> Iterator[str]:
    """Warnings on the omissions of a simulation's settings."""
    # Uniform samples miss the protocol's extremes.
    corners, samples = job.driven.pressure_kPa, job.supplied_kPa
    for extreme, met in ((corners.min(), samples.min()), (corners.max(), samples.max())):
        if abs(extreme - met) > 1e-6:
            yield (
                f"The protocol goes to {extreme:g} kPa, but its {job.times} samples reach only "
                f"{met:g} kPa: choose a number of samples that includes its extremes."
            )


def doubts_of_motion(job: Job, mesh: Mesh, states: Sequence[State], summary: dict[str, Any]) -> Iterator[str]:
    """Warnings on a motion's states; their figures go into the summary."""
    yield from _walls_cross(job, mesh, states, summary)
    yield from _snaps(job, states)
    most = summary.get("nearest_to_break", {})
    if most.get("percent", 0.0) > 100.0:
        x, y, z = most["place_mm"]
        yield (
            f"The {most['part']} near ({x:g}, {y:g}, {z:g}) mm would tear: at {most['pressure_kPa']:g} kPa "
            f"the stretch takes {most['percent']:.3g} % of the resin's elongation at break, "
            f"{100 * job.unit.material.elongation_at_break:g} %. Lower the pressure or thicken that part."
        )


def _walls_cross(job: Job, mesh: Mesh, states: Sequence[State], summary: dict[str, Any]) -> Iterator[str]:
    """The first pressure, on either side, at which walls pass through each other, and which."""
    found = summary["walls_cross_at_kPa"] = {}
    # With self-contact no step passes a touch.
    for sign in () if job.self_contact else (-1, 1):
        outward = sorted((s for s in states if s.pressure_MPa * sign > 0), key=lambda s: abs(s.pressure_MPa))
        still = [s for s in states if s.loaded and not s.pressure_MPa]
        first = first_self_intersection(mesh, [rest(mesh), *still, *outward])
        if first is None:
            continue
        pressure = f"{in_kPa(first.pressure_MPa):.4g}"
        found[pressure] = [str(c) for c in first.crossings]
        yield (
            f"From {pressure} kPa on, walls intersect: {first.crossings[0]}. Self-contact is not "
            f"modelled, so states beyond this pressure are invalid. Use a thicker wall, --self-contact or a "
            "smaller pressure."
        )


def _snaps(job: Job, states: Sequence[State]) -> Iterator[str]:
    """The first pressure on either side beyond a limit point, and how far a node moved.

    For a motion solved instant by instant, the first instant.
    """
    snapped = [s for s in states if s.snapped_mm]
    if job.in_time:
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
