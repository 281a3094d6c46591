"""The printable solid: actuator, lattice, inlet and waveguide as one watertight surface."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np

from ..errors import InputError
from . import shapes
from .anchors import Window
from .gates import Gates, check_solid
from .lattice import DIRECTIONS, Lattice, body_centred
from .parameters import Dimensions, Unit
from .profile import cavity_polygon, cavity_volume, outer_polygon
from .surface import Triangles, Vertices, bad_edges, weld
from .waveguide import waveguide

QUANTA = (1e-4, 2e-5, 5e-4)
"""Steps in mm that vertices are rounded to; the first that leaves every edge to two triangles is kept."""


@attrs.frozen
class Facets:
    """Number of flat pieces around the axis, along a quarter chamber, around a strut and along it."""

    around_axis: int
    along_arc: int
    around_strut: int
    along_strut: int


QUALITY = {"interactive": Facets(64, 6, 12, 4), "export": Facets(192, 16, 32, 10)}


@attrs.frozen(eq=False)
class Solid:
    """Outward oriented surface: vertices (n, 3) in mm, triangles (m, 3), and the gates it passed."""

    vertices: Vertices
    triangles: Triangles
    gates: Gates
    window: Window | None
    quality: str


def build_solid(unit: Unit, window: Window | None = None, quality: str = "interactive") -> Solid:
    """Printable solid, with the waveguide along `window` if one is given; GateError if a gate fails."""
    from manifold3d import Manifold, OpType

    if quality not in QUALITY:
        raise InputError(f"there is no quality {quality!r}", "quality", f"choose one of {', '.join(QUALITY)}")
    d, facets = unit.dimensions, QUALITY[quality]
    n = facets.around_axis
    lattice = body_centred(d)
    bare = lattice_solid(d, lattice, facets)

    # Every solid first, every cavity last: a cavity cut early leaves coincident faces, bodies of no volume.
    boss = shapes.cylinder(d.inlet_radius + d.inlet_wall, -d.inlet_length, d.base_cap / 2.0, n)
    solids = [bare, shapes.revolved(outer_polygon(d, facets.along_arc), n), boss]
    bore = shapes.cylinder(d.inlet_radius, -1.5 * d.inlet_length, d.base_cap + d.inlet_radius, n)
    cavities = [shapes.revolved(cavity_polygon(d, facets.along_arc), n), bore]
    if window is not None:
        bar = waveguide(unit, window)
        solids.append(shapes.box(*bar.box))
        cavities += [shapes.box(*well) for well in bar.wells]
    filled = Manifold.batch_boolean(solids, OpType.Add)
    vertices, triangles = printable(Manifold.batch_boolean([filled, *cavities], OpType.Subtract))

    gates = check_solid(
        vertices,
        triangles,
        plug=shapes.cylinder(
            d.inlet_radius + d.inlet_wall / 2.0, -1.5 * d.inlet_length, -0.5 * d.inlet_length, n
        ),
        sealed_volume=cavity_volume(d) + np.pi * d.inlet_radius**2 * (d.base_cap + 0.5 * d.inlet_length),
        lattice=(bare.genus(), len(bare.decompose())),
        lattice_cycles=lattice.cycles,
    )
    return Solid(vertices, triangles, gates, window, quality)


def lattice_solid(d: Dimensions, lattice: Lattice, facets: Facets) -> Any:
    """Bare lattice as a Manifold: a ball at each node, a tapered strut along each edge, cut to its box."""
    from manifold3d import Manifold, OpType

    radii = lattice.radius(np.linspace(0.0, 1.0, facets.along_strut + 1))
    ball = shapes.ball(lattice.junction_radius, facets.around_strut)
    struts = [shapes.spindle(sign * d.cell / 2.0, radii, facets.around_strut) for sign in DIRECTIONS]
    cell = Manifold.batch_boolean([ball, *struts], OpType.Add)

    # Layers of cells are equal: uniting one and stacking it is several times faster than uniting every strut.
    centres, corners = lattice.nodes[lattice.is_centre], lattice.nodes[~lattice.is_centre]
    layer = [cell.translate(node.tolist()) for node in centres if node[2] < d.cell]
    layer += [ball.translate(node.tolist()) for node in corners if node[2] < 0.5 * d.cell]
    united = Manifold.batch_boolean(layer, OpType.Add)
    united.num_tri()  # manifold3d evaluates late; without this it would unite every strut again
    stack = [united.translate([0.0, 0.0, k * d.cell]) for k in range(d.count)]
    stack += [ball.translate(node.tolist()) for node in corners if node[2] > d.height - 0.5 * d.cell]
    low, high = np.array(d.bounds).T
    return Manifold.batch_boolean(stack, OpType.Add) ^ shapes.box(low, high)


def printable(solid: Any) -> tuple[Vertices, Triangles]:
    """Surface of a Manifold, simplified, rounded and welded so that it stays closed in single precision."""
    for quantum in QUANTA:
        # Slivers between nearly coincident facets would weld into edges of four triangles: collapse them.
        mesh = solid.simplify(quantum).to_mesh64()
        vertices = np.asarray(mesh.vert_properties)[:, :3]
        welded = weld(vertices, np.asarray(mesh.tri_verts).astype(np.int64), quantum)
        if bad_edges(welded[1]) == 0:
            break
    return welded
