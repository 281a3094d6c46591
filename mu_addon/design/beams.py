"""The unit as an actuator, a waveguide and a lattice of beams, for programs that thicken struts."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import shapes
from .dimensions import Dimensions
from .lattice import Lattice, lattice_of
from .profile import cavity_polygon, outer_polygon, outer_radius
from .solid import Facets, printable
from .threemf import Beams, Part
from .waveguide import Bar, strut_radii

PIECES = 8
"""Number of frusta in a strut: between them its sin^2 swell is straight, which loses 0.6 % of its volume."""


def lattice_beams(d: Dimensions, bar: Bar | None = None) -> Beams:
    """The lattice as beams: each strut is a chain of `PIECES` frusta whose radii in mm follow its law.

    bar: a waveguide; struts that it replaces are left out, and those that touch it are thickened as in the
    printable solid (`waveguide.strut_radii`). Frusta with both ends inside the actuator's outer surface are
    left out.
    """
    lattice = lattice_of(d)
    t = np.linspace(0.0, 1.0, PIECES + 1)
    standing = np.ones(len(lattice.struts), bool) if bar is None else ~bar.replaced
    radii = _radii(lattice, bar, t)[standing]
    struts = lattice.struts[standing]
    first, last = lattice.nodes[struts[:, 0]], lattice.nodes[struts[:, 1]]
    inner = first[:, None] + t[1:-1, None] * (last - first)[:, None]
    nodes = np.concatenate([lattice.nodes, inner.reshape(-1, 3)])
    along = len(lattice.nodes) + np.arange(inner.shape[0] * (PIECES - 1)).reshape(-1, PIECES - 1)
    chain = np.concatenate([struts[:, :1], along, struts[:, 1:]], axis=1)
    pairs = np.stack([chain[:, :-1], chain[:, 1:]], axis=2).reshape(-1, 2)
    ends = np.stack([radii[:, :-1], radii[:, 1:]], axis=2).reshape(-1, 2)
    within = np.hypot(nodes[:, 0], nodes[:, 1]) < outer_radius(d, nodes[:, 2])
    shown = ~within[pairs].all(axis=1)
    used, numbered = np.unique(pairs[shown], return_inverse=True)
    return Beams(nodes[used], numbered.reshape(-1, 2).astype(np.int64), ends[shown])


def _radii(lattice: Lattice, bar: Bar | None, t: NDArray[np.float64]) -> NDArray[np.float64]:
    if bar is None:
        return lattice.radii(t)
    return strut_radii(lattice, bar.met, bar.half, t)


def beam_parts(d: Dimensions, facets: Facets, bar: Bar | None = None) -> tuple[list[Part], list[int]]:
    """Objects of a 3MF file with the lattice as beams, and the numbers, from 1, of those to be printed.

    The objects are the actuator with inlet and cavity, a clipping mesh, the lattice and, with a `bar`, the
    waveguide with its wells. The clipping mesh, object 2, is the envelope without the cavity: beams cut to it
    end inside the membrane. It is not printed.
    """
    from manifold3d import Manifold, OpType

    n = facets.around_axis
    boss = shapes.cylinder(d.inlet_radius + d.inlet_wall, -d.inlet_length, d.base_cap / 2.0, n)
    bore = shapes.cylinder(d.inlet_radius, -1.5 * d.inlet_length, d.base_cap + d.inlet_radius, n)
    hollow = Manifold.batch_boolean(
        [shapes.revolved(cavity_polygon(d, facets.along_arc), n), bore], OpType.Add
    )
    low, high = np.array(d.bounds).T
    parts = [
        Part(
            "actuator", *printable((shapes.revolved(outer_polygon(d, facets.along_arc), n) + boss) - hollow)
        ),
        Part("where struts may be", *printable(shapes.box(low, high) - hollow)),
        Part("lattice", beams=lattice_beams(d, bar), clipped_to=2),
    ]
    if bar is None:
        return parts, [1, 3]
    guide = Manifold.batch_boolean([bar.solid(), *bar.cut_solids()], OpType.Subtract)
    return [*parts, Part("waveguide", *printable(guide))], [1, 3, 4]
