"""The printable solid: actuator, lattice, inlet and waveguide as one watertight surface."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from . import shapes
from .anchors import Window
from .gates import Gates, check_solid
from .lattice import Lattice, lattice_of
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
    lattice = lattice_of(d)
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
    """Bare lattice as a Manifold: a ball at each node, a strut along each edge, cut to its box."""
    from manifold3d import Manifold, OpType

    kind, step = lattice.kind, d.cell / lattice.kind.divisions
    radii = lattice.radius(np.linspace(0.0, 1.0, facets.along_strut + 1))
    ball = shapes.ball(float(radii[0]), facets.around_strut)

    def strut(ends: NDArray[np.int64]) -> Any:
        return shapes.spindle((ends[1] - ends[0]) * step, radii, facets.around_strut)

    def placed(body: Any, at: NDArray[np.int64]) -> Any:
        return body.translate((at * step).tolist())

    # Cells are equal, and so are layers of them: uniting one and repeating it is several times faster than
    # uniting every strut. What cells share, the nodes and struts on their faces, is placed once.
    middle = kind.divisions // 2
    own = [placed(ball, node - middle) for node in kind.grid[kind.inside]]
    own += [placed(strut(ends), ends[0] - middle) for ends in kind.grid[kind.struts[~kind.on_face]]]
    low, up = lattice.cells[0, 2], kind.divisions
    layer = []
    if own:
        cell = Manifold.batch_boolean(own, OpType.Add)
        layer += [placed(cell, at + middle) for at in lattice.cells if at[2] == low]
    nodes = lattice.grid[~lattice.inside]
    faces = lattice.grid[lattice.struts[lattice.on_face]]
    layer += [placed(ball, node) for node in nodes if node[2] < low + up]
    layer += [placed(strut(ends), ends[0]) for ends in faces if ends[:, 2].min() < low + up]
    united = Manifold.batch_boolean(layer, OpType.Add)
    united.num_tri()  # manifold3d evaluates late; without this it would unite every strut again
    stack = [united.translate([0.0, 0.0, k * d.cell]) for k in range(d.count)]
    top = low + d.count * up
    stack += [placed(ball, node) for node in nodes if node[2] == top]
    stack += [placed(strut(ends), ends[0]) for ends in faces if ends[:, 2].min() == top]
    box = shapes.box(*np.array(d.bounds).T)
    return Manifold.batch_boolean(stack, OpType.Add) ^ box


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
