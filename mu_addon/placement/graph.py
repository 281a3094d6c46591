"""The lattice as a graph: the steps that a printed waveguide may take, and the chains of them."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise

import attrs
import numpy as np

from ..arrays import Array
from ..design.dimensions import Dimensions
from ..design.lattice import lattice_of
from ..design.profile import outer_radius
from ..errors import InputError
from .settings import BEND, LONGEST, SHORTEST

# Points along a step at which its distance from the membrane is measured; heights of the profile's
# points, as a share of the clearance: the distance is then overestimated by less than 0.2 %.
_ALONG_STEP = 25
_PROFILE = 0.1


@attrs.frozen
class Limits:
    """Limits of a path: its least and largest length in cells, and its sharpest bend.

    Raises InputError for a limit that is out of bounds.
    """

    shortest_cells: float = SHORTEST.field()
    longest_cells: float = LONGEST.field()
    sharpest_bend_deg: float = BEND._replace(name="sharpest_bend_deg").field()


@attrs.frozen(eq=False)
class Graph:
    """Nodes (n, 3) in mm of a lattice and steps (e, 2) from the lower node to the higher.

    image (n,): number of each node's mirror image across x = 0; cell: edge of the unit cell in mm. Steps
    rise: light enters near the inlet and leaves near the tip, as in the source paper.
    """

    nodes: Array
    steps: Array
    image: Array
    cell: float

    @property
    def lengths(self) -> Array:
        """Length (e,) of every step in mm."""
        return np.asarray(np.linalg.norm(np.diff(self.nodes[self.steps], axis=1)[:, 0], axis=1))

    def chains(self, limits: Limits) -> Iterator[tuple[int, ...]]:
        """Every chain within the limits as its nodes, from the lowest; only one of two mirror images.

        Depth first in the order of the nodes, so that the same graph gives the same sequence. Only one chain
        is in memory at a time.
        """
        shortest, longest = (self.cell * c for c in (limits.shortest_cells, limits.longest_cells))
        least = np.cos(np.radians(limits.sharpest_bend_deg)) - 1e-9
        lengths = self.lengths
        way = np.diff(self.nodes[self.steps], axis=1)[:, 0] / lengths[:, None]
        onward: list[list[tuple[int, int]]] = [[] for _ in self.nodes]
        for step, (low, high) in enumerate(self.steps.tolist()):
            onward[low].append((high, step))
        bends = way @ way.T >= least
        slack = 1e-9 * self.cell

        def extend(chain: list[int], last: int | None, length: float) -> Iterator[tuple[int, ...]]:
            if last is not None and length >= shortest - slack and self._stands_for_both(chain):
                yield tuple(chain)
            for node, step in onward[chain[-1]]:
                longer = length + lengths[step]
                if (last is None or bends[last, step]) and longer <= longest + slack:
                    yield from extend([*chain, node], step, longer)

        for start in range(len(self.nodes)):
            yield from extend([start], None, 0.0)

    def _stands_for_both(self, chain: list[int]) -> bool:
        """Return True if a chain is the one of two mirror images that is listed."""
        return chain <= [int(i) for i in self.image[chain]]

    def count(self, limits: Limits) -> int:
        """Number of chains within the limits, mirror images counted once."""
        return sum(1 for _ in self.chains(limits))

    def steps_of(self, chain: tuple[int, ...]) -> list[int]:
        """Numbers of the steps of a chain of nodes; raises KeyError where two of them have none between."""
        return [self._number[pair] for pair in pairwise(chain)]

    @cached_property
    def _number(self) -> dict[tuple[int, int], int]:
        return {(low, high): i for i, (low, high) in enumerate(self.steps.tolist())}


def lattice_graph(d: Dimensions, clearance_mm: float | None = None) -> Graph:
    """Graph of the lattice nodes and steps that keep a distance from membrane and envelope.

    Steps: the lattice's struts, and one cell along z from a node to the equivalent one, like the windows of
    anchors. clearance_mm: least distance of a step's axis from the membrane's outer surface and from the
    envelope's faces, by default the inclusion's radius, so that every inclusion is whole. Raises InputError
    if no step is left.
    """
    clearance = d.inclusion_radius if clearance_mm is None else clearance_mm
    lattice = lattice_of(d)
    place, up = lattice.grid, lattice.kind.divisions
    where = {tuple(p): i for i, p in enumerate(place.tolist())}
    upright = [(i, where[x, y, z + up]) for (x, y, z), i in where.items() if (x, y, z + up) in where]
    pairs = np.vstack([lattice.struts, upright])
    z = lattice.nodes[:, 2]
    pairs = np.where((z[pairs[:, 0]] > z[pairs[:, 1]])[:, None], pairs[:, ::-1], pairs)
    pairs = np.unique(pairs, axis=0)
    pairs = pairs[_clear(d, lattice.nodes[pairs], clearance)]
    if not len(pairs):
        raise InputError(
            f"no step of the lattice is {clearance:g} mm clear of membrane and envelope",
            "paths",
            "widen the lattice or thin the waveguide",
        )
    used, numbered = np.unique(pairs, return_inverse=True)
    # From the inlet up, and from -x to x within a layer: chains are enumerated in this order.
    place = place[used]
    order = np.lexsort((place[:, 0], place[:, 1], place[:, 2]))
    new = np.empty(len(used), int)
    new[order] = np.arange(len(used))
    steps = new[np.reshape(numbered, (-1, 2))]
    where = {tuple(p): i for i, p in enumerate(place[order].tolist())}
    image = np.array([where[-x, y, z] for x, y, z in place[order].tolist()])
    return Graph(lattice.nodes[used][order], steps[np.lexsort(steps.T[::-1])], image, d.cell)


def _clear(d: Dimensions, ends: Array, clearance: float) -> Array:
    """Mask (e,) of steps (e, 2, 3) clear of the membrane's outer surface and the envelope's faces."""
    from scipy.spatial import cKDTree

    t = np.linspace(0.0, 1.0, _ALONG_STEP)[:, None]
    points = ends[:, :1] + t * (ends[:, 1:] - ends[:, :1])
    low, high = np.array(d.bounds).T
    slack = 1e-9 * d.cell
    inside = ((points >= low + clearance - slack) & (points <= high - clearance + slack)).all(axis=(1, 2))
    height = np.linspace(0.0, d.height, int(d.height / (_PROFILE * clearance)) + 2)
    profile = cKDTree(np.stack([outer_radius(d, height), height], axis=1))
    rho, z = np.hypot(points[..., 0], points[..., 1]), points[..., 2]
    distance, _ = profile.query(np.stack([rho, z], axis=-1))
    outside = (rho > outer_radius(d, z)) & (distance >= clearance - slack)
    return np.asarray(inside & outside.all(axis=1))
