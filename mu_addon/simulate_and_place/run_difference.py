"""Difference between the motions of a unit in two runs, at the surface that one of them shows."""

from __future__ import annotations

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..report.motion_files import Motion, Skin

FARTHEST = 0.05
"""Points farther outside the other mesh than this share of its extent are not compared."""
_LEAST_SHARE = 0.5
"""Least share of the points in or near the other mesh; with less, the units are not comparable."""


@attrs.frozen(eq=False)
class Difference:
    """Distance (s, v) in mm between a surface's points in two runs, at the first one's states.

    It is NaN for a point too far outside the other mesh; unknown: share of these points.
    """

    distance_mm: Array
    unknown: float


def difference(one: Motion, name: str, skin: Skin, other: Motion, other_name: str) -> Difference:
    """Compare the motion of Model A or a path (`name`) in one run with another's, point by point.

    On equal meshes nodes are compared. Otherwise the surface's points are embedded in the other mesh, by its
    shape functions. Raises InputError where the runs cannot be compared: different pressures over time, units
    with less than half in common, a missing motion.
    """
    states = _states(one, other)
    own, image = one.sides(name)
    moved = skin.of_nodes(own, image)
    if one.mesh.hash() == other.mesh.hash():
        far = skin.of_nodes(*other.sides(other_name))[states]
        return Difference(np.linalg.norm(moved - far, axis=2).astype(np.float32), 0.0)
    embedding = other.embedding(skin.of_nodes(one.mesh.nodes))
    extent = float(np.ptp(other.mesh.nodes, axis=0).max())
    known = embedding.outside_mm <= FARTHEST * extent
    if known.mean() < _LEAST_SHARE:
        raise InputError(
            f"the two units share only {known.mean():.0%} of their surface",
            str(other.folder.parent),
            "compare runs of units of about the same size",
        )
    far = other.carried(other_name, embedding)[states]
    found = np.linalg.norm(moved - far, axis=2).astype(np.float32)
    found[:, ~known] = np.nan
    return Difference(found, float(1.0 - known.mean()))


def _states(one: Motion, other: Motion) -> Array:
    """State (s,) of another run at the time of each state of one."""
    if words := one.so_far or other.so_far:
        raise InputError(
            f"a motion is not whole: {words}", str(other.folder.parent), "compare runs that are complete"
        )
    same = len(one.time_s) == len(other.time_s)
    if not same or not (
        np.allclose(one.time_s, other.time_s) and np.allclose(one.pressure_kPa, other.pressure_kPa)
    ):
        raise InputError(
            "the two runs have different pressures over time",
            str(other.folder.parent),
            "compare runs with the same protocol and number of samples",
        )
    found = np.full(len(one.state_kPa), -1)
    found[one.state] = other.state
    if (found[one.state] != other.state).any():
        raise InputError(
            "the other run's motion depends on its history, this one's on pressure alone",
            str(other.folder.parent),
            "show the other run, and compare it with this one",
        )
    # States that no sample shows, if there were any, are of no time.
    found[found < 0] = 0
    return found
