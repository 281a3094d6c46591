"""Build directions compared by cups, islands, overhangs and height, with the Pareto-optimal ones."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import attrs
import numpy as np
from numpy.typing import NDArray

from ...arrays import Array
from ..surface import Triangles, Vertices
from .layers import islands, regions
from .thickness import Samples
from .trapped_resin import cups
from .voxels import frame_along, voxel_rows


@attrs.frozen
class Build:
    """One build direction, a unit vector away from the platform, and its costs.

    cup_ml: the largest volume sealed against the film; islands: their number; support_mm2: surface flatter
    than the printer's slope, which needs supports; inner_mm2: the part of it in chambers, where supports
    cannot be removed; height_mm: along the direction; fits: the part fits the build volume, turned about the
    direction by 0 or 90 degrees; best_among: the build is Pareto-optimal in these.
    """

    direction: tuple[float, float, float]
    cup_ml: float
    islands: int
    support_mm2: float
    inner_mm2: float
    height_mm: float
    fits: bool
    best_among: bool = False

    @property
    def costs(self) -> tuple[float, ...]:
        """Costs to minimise, the most important first: not fitting, cup, inner, islands, support, height.

        In the units of the attributes, rounded to steps below which directions count as equal.
        """
        return (
            float(not self.fits),
            0.5 * round(2.0 * self.cup_ml),
            5.0 * round(self.inner_mm2 / 5.0),
            float(self.islands),
            5.0 * round(self.support_mm2 / 5.0),
            round(self.height_mm, 0),
        )


def directions() -> Array:
    """Unit vectors (26, 3) to the sides, edges and corners of a cube; the six along the axes first."""
    every = np.array([d for d in itertools.product((-1.0, 0.0, 1.0), repeat=3) if any(d)])
    every = every[np.argsort(np.abs(every).sum(axis=1), kind="stable")]
    return np.asarray(every / np.linalg.norm(every, axis=1, keepdims=True))


def tilted(direction: Array, degrees: float) -> Array:
    """Eight unit vectors (8, 3) inclined by this angle in degrees to a direction (3,), evenly around it."""
    x, y, z = frame_along(direction)
    angle = np.arange(8) * np.pi / 4.0
    away = np.cos(angle)[:, None] * x + np.sin(angle)[:, None] * y
    return np.asarray(np.cos(np.radians(degrees)) * z + np.sin(np.radians(degrees)) * away)


def build(
    vertices: Vertices,
    triangles: Triangles,
    surface: Samples,
    in_chamber: NDArray[np.bool_],
    direction: Array,
    step: float,
    slope_deg: float,
    room: tuple[float, float, float],
) -> Build:
    """Costs of printing a surface, vertices (n, 3) in mm and triangles (m, 3), along a unit vector (3,).

    surface: samples of it, of which in_chamber (s,) marks those of chambers; step: cell of the grid in mm;
    slope_deg: flattest slope from level, in degrees, that needs no support; room: sizes of the build volume
    in mm.
    """
    frame = frame_along(direction)
    grid = voxel_rows(vertices, triangles, step, frame=frame)
    closed = cups(grid, regions(grid, free=True))
    loose = islands(grid, regions(grid, free=False))
    height = surface.points @ direction
    flat = surface.normals @ direction < -np.cos(np.radians(slope_deg))
    flat &= height > height.min() + step
    extent = np.ptp(vertices @ frame.T, axis=0)
    return Build(
        direction=tuple(direction.tolist()),
        cup_ml=float(closed.volume[:1].sum()) / 1e3,
        islands=len(loose.area),
        support_mm2=float(surface.area[flat].sum()),
        inner_mm2=float(surface.area[flat & in_chamber].sum()),
        height_mm=float(extent[2]),
        fits=fits(extent, room),
    )


def fits(extent: Array, room: tuple[float, float, float]) -> bool:
    """True if extents (3,) in mm fit a build volume in mm, as they are or turned by 90 degrees about z."""
    x, y, z = extent.tolist()
    flat = (x <= room[0] and y <= room[1]) or (y <= room[0] and x <= room[1])
    return bool(flat and z <= room[2])


def ranked(builds: list[Build]) -> list[Build]:
    """The builds in the order of their `costs`, the best first, with the Pareto-optimal ones marked."""
    cost = np.array([b.costs for b in builds])
    as_good = (cost[:, None, :] <= cost[None, :, :]).all(axis=2)
    better = (cost[:, None, :] < cost[None, :, :]).any(axis=2)
    dominated = (as_good & better).any(axis=0)
    marked = [attrs.evolve(b, best_among=not bad) for b, bad in zip(builds, dominated.tolist(), strict=True)]
    return sorted(marked, key=lambda b: b.costs)


def orientations(
    vertices: Vertices,
    triangles: Triangles,
    surface: Samples,
    in_chamber: NDArray[np.bool_],
    step: float,
    slope_deg: float,
    room: tuple[float, float, float],
    own: Array,
    share: Callable[[float], None] | None = None,
) -> list[Build]:
    """Ranked builds along 26 directions, the present one `own` (3,), and eight at 20 degrees to the best.

    vertices (n, 3) in mm and triangles (m, 3); in_chamber (s,) and the other arguments are as in `build`;
    share: called with the share of the directions that is done.
    """

    first = directions()
    if np.abs(first - own).sum(axis=1).min() > 1e-6:
        first = np.concatenate([own[None], first])
    found: list[Build] = []

    def add(ways: Array) -> None:
        for direction in ways:
            found.append(build(vertices, triangles, surface, in_chamber, direction, step, slope_deg, room))
            if share is not None:
                share(len(found) / (len(first) + 8))

    add(first)
    add(tilted(np.array(ranked(found)[0].direction), 20.0))
    return ranked(found)


def direction_name(direction: Sequence[float]) -> str:
    """A direction as text: +z, +x−y, or `20° from +z toward −x`."""
    way = np.asarray(direction, float) / np.linalg.norm(direction)
    every = directions()
    k = int((every @ way).argmax())
    if every[k] @ way > np.cos(np.radians(1.0)):
        return _signs(every[k])
    axis = every[int((every[:6] @ way).argmax())]
    aside = way - (way @ axis) * axis
    toward = every[int((every @ aside).argmax())]
    return f"{np.degrees(np.arccos(way @ axis)):.0f}° from {_signs(axis)} toward {_signs(toward)}"


def _signs(way: Array) -> str:
    return "".join(
        f"{'+' if s > 0 else '−'}{a}" for a, s in zip("xyz", way.tolist(), strict=True) if abs(s) > 1e-9
    )
