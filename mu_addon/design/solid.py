"""The printable solid: actuator, lattice, inlet and waveguide as one watertight surface."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import InputError
from . import shapes
from .anchors import Window
from .body import Body, covering, require_path_inside
from .dimensions import Dimensions
from .gates import Gates, check_solid, check_waveguide
from .lattice import Lattice, lattice_of
from .parameters import Unit
from .profile import cavity_polygon, cavity_volume, outer_polygon, revolved_volume
from .rules import check_printed
from .surface import Triangles, Vertices, bad_edges, weld
from .waveguide import Bar, strut_radii, waveguide

QUANTA = (1e-4, 2e-5, 5e-4)
"""Steps in mm that vertices are rounded to; the first that leaves two triangles at every edge is kept."""


@attrs.frozen
class Facets:
    """Numbers of flat pieces: around the z axis, along a quarter chamber, around a strut and along it."""

    around_axis: int
    along_arc: int
    around_strut: int
    along_strut: int


QUALITY = {"interactive": Facets(64, 6, 12, 4), "export": Facets(192, 16, 32, 10)}


@attrs.frozen(eq=False)
class Solid:
    """A printable surface: vertices (n, 3) in mm, triangles (m, 3) facing outward, and the gates it passed.

    window: of its waveguide, None without one and for a path of nodes; bar: its waveguide.
    """

    vertices: Vertices
    triangles: Triangles
    gates: Gates
    window: Window | None
    quality: str
    bar: Bar | None = None

    @property
    def volume_mm3(self) -> float:
        """Volume in mm3 of the printed material."""
        return self.gates.volume_mm3

    def mass_g(self, density_g_per_ml: float) -> float:
        """Mass in g of a resin of that density, a material's `density_g_per_ml`."""
        return self.volume_mm3 / 1000.0 * density_g_per_ml


def build_solid(
    unit: Unit,
    path: Window | ArrayLike | None = None,
    quality: str = "interactive",
    body: Body | None = None,
    take_off: tuple[float, float] = (0.0, 0.0),
) -> Solid:
    """The printable solid of a unit: actuator, lattice, inlet and, if a path is given, the waveguide.

    path: a `Window` of anchors, or lattice nodes (n, 3) in mm. quality: "interactive" or "export", the number
    of facets. body: a closed surface that the lattice is cut to in place of its box; loose ends of struts are
    left out. take_off: print offset in mm, in the plane and along z. The drawing is made smaller by it
    (Minkowski), so that the print has the nominal size.

    Takes some seconds. Raises GateError where a check of the solid fails (genus, components, watertightness),
    and InputError for a path or an offset that does not fit.
    """
    from manifold3d import Manifold, OpType

    if quality not in QUALITY:
        raise InputError(f"there is no quality {quality!r}", "quality", f"choose one of {', '.join(QUALITY)}")
    d, facets = unit.dimensions, QUALITY[quality]
    if body is not None and isinstance(path, Window):
        require_path_inside(body, unit, path)
    d = covering(d, body)
    offset = _drawn_offset(d, take_off)
    xy, z = (0.0, 0.0) if offset is None else (float(offset[0]), float(offset[2]))
    n = facets.around_axis
    lattice = lattice_of(d)
    bare = lattice_solid(d, lattice, facets, offset)

    # Every solid first, every cavity last: a cavity cut early leaves coincident faces, bodies of no volume.
    boss = shapes.cylinder(d.inlet_radius + d.inlet_wall + xy, -d.inlet_length - z, d.base_cap / 2.0, n)
    actuator = [shapes.revolved(outer_polygon(d, facets.along_arc, offset), n), boss]
    bore = shapes.cylinder(d.inlet_radius - xy, -1.5 * d.inlet_length, d.base_cap + d.inlet_radius, n)
    cavities = [shapes.revolved(cavity_polygon(d, facets.along_arc, offset), n), bore]
    bar, guide, holder = None, None, bare
    if path is not None:
        bar = waveguide(unit, path, d)
        holder = with_waveguide(d, lattice, facets, bar, bare, offset)
        cuts = Manifold.batch_boolean(bar.cut_solids(offset), OpType.Add)
        guide = check_waveguide(holder, bar.solid(offset), cuts, actuator, lattice.cycles + bar.loops)
        cavities.append(cuts)
    if body is not None:
        if offset is not None:
            raise InputError(
                "the print offset is not compensated on a user-defined body",
                "body",
                "reduce the body by the print offset in its file",
            )
        holder = holder ^ body.manifold
    filled = Manifold.batch_boolean([holder, *actuator], OpType.Add)
    if body is not None:
        filled = max(filled.decompose(), key=lambda piece: float(piece.volume()))
    vertices, triangles = printable(Manifold.batch_boolean([filled, *cavities], OpType.Subtract))

    cavity = cavity_volume(d) if offset is None else revolved_volume(cavity_polygon(d, 64, offset))
    gates = check_solid(
        vertices,
        triangles,
        plug=shapes.cylinder(
            d.inlet_radius + d.inlet_wall / 2.0, -1.5 * d.inlet_length, -0.5 * d.inlet_length, n
        ),
        sealed_volume=cavity + np.pi * (d.inlet_radius - xy) ** 2 * (d.base_cap + z + 0.5 * d.inlet_length),
        lattice=(bare.genus(), len(bare.decompose())),
        lattice_cycles=lattice.cycles,
        guide=guide,
    )
    window = path if isinstance(path, Window) else None
    return Solid(vertices, triangles, gates, window, quality, bar)


def chamber(unit: Unit) -> tuple[Vertices, Triangles]:
    """The chamber of a unit as a closed surface, (n, 3) in mm and (m, 3), without the inlet."""
    d, facets = unit.dimensions, QUALITY["interactive"]
    return printable(shapes.revolved(cavity_polygon(d, facets.along_arc, None), facets.around_axis))


def _drawn_offset(d: Dimensions, take_off: tuple[float, float]) -> NDArray[np.float64] | None:
    """Outward move (3,) of the drawing's surfaces that undoes a printer's; None for no offset. InputError."""
    xy, z = (float(value) for value in take_off)
    if not xy and not z:
        return None
    if min(xy, z) < 0.0 < max(xy, z):
        raise InputError(
            f"offsets of {xy:g} mm in the plane and {z:g} mm along z have opposite signs",
            "printer's offsets",
            "a part cannot grow and shrink at once: measure again, or set the smaller one to 0",
        )
    check_printed(d, -xy, -z)
    return -np.array([xy, xy, z])


def with_waveguide(
    d: Dimensions,
    lattice: Lattice,
    facets: Facets,
    bar: Bar,
    bare: Any,
    offset: NDArray[np.float64] | None = None,
) -> Any:
    """The lattice united with its waveguide, before wells and pockets are cut, as a Manifold in mm.

    Struts that the bar replaces, and nodes without other struts, are left out of `bare`, the lattice's solid;
    struts that touch the bar are thickened (`strut_radii`). offset (3,): outward move of all surfaces along
    x, y and z in mm.
    """
    from manifold3d import Manifold, OpType

    t = np.linspace(0.0, 1.0, facets.along_strut + 1)
    radii = strut_radii(lattice, bar.met, bar.half, t)
    raised = (radii > lattice.radii(t) + 1e-9).any(axis=1) & ~bar.replaced
    standing = np.zeros(len(lattice.grid), bool)
    standing[lattice.struts[~bar.replaced]] = True
    if (bar.replaced | raised).any():
        bare = lattice_solid(d, lattice, facets, offset, bar.replaced | raised, ~standing)
    parts = [bare, bar.solid(offset)]
    if raised.any():
        thicker = [
            shapes.spindle(end - start, thick, facets.around_strut, offset).translate(start.tolist())
            for (start, end), thick in zip(lattice.nodes[lattice.struts[raised]], radii[raised], strict=True)
        ]
        ball = shapes.ball(bar.half, facets.around_strut, offset)
        met = np.unique(lattice.struts[bar.met])
        thicker += [ball.translate(node.tolist()) for node in lattice.nodes[met[standing[met]]]]
        parts.append(Manifold.batch_boolean(thicker, OpType.Add) ^ _envelope(d, offset))
    united = Manifold.batch_boolean(parts, OpType.Add)
    united.num_tri()  # manifold3d evaluates lazily; without this each use would unite it again
    return united


def _envelope(d: Dimensions, offset: NDArray[np.float64] | None) -> Any:
    low, high = np.array(d.bounds).T
    return shapes.box(low, high) if offset is None else shapes.box(low - offset, high + offset)


def lattice_solid(
    d: Dimensions,
    lattice: Lattice,
    facets: Facets,
    offset: NDArray[np.float64] | None = None,
    without: NDArray[np.bool_] | None = None,
    gone: NDArray[np.bool_] | None = None,
) -> Any:
    """Bare lattice as a Manifold in mm: a ball at each node, a strut along each edge, cut to the envelope.

    offset (3,): outward move of its surfaces along x, y and z in mm; without (E,) and gone (N,): mark struts
    and nodes to leave out.
    """
    from manifold3d import Manifold, OpType

    gone = np.zeros(len(lattice.grid), bool) if gone is None else gone
    if lattice.factors is not None:
        return _graded_solid(d, lattice, facets, offset, without, gone)
    kind, step = lattice.kind, d.cell / lattice.kind.divisions
    radii = lattice.radius(np.linspace(0.0, 1.0, facets.along_strut + 1))
    ball = shapes.ball(float(radii[0]), facets.around_strut, offset)
    left_out = set() if without is None else {_ends(ends) for ends in lattice.grid[lattice.struts[without]]}

    def strut(ends: NDArray[np.int64]) -> Any:
        return shapes.spindle((ends[1] - ends[0]) * step, radii, facets.around_strut, offset)

    def placed(body: Any, at: NDArray[np.int64]) -> Any:
        return body.translate((at * step).tolist())

    # Cells are equal, and so are layers of them: uniting one and repeating it is several times faster than
    # uniting every strut. What cells share, the nodes and struts on their faces, is placed once.
    up, inner = kind.divisions, kind.grid[kind.struts[~kind.on_face]]
    balls = [placed(ball, node) for node in kind.grid[kind.inside]]
    whole = [*balls, *(placed(strut(ends), ends[0]) for ends in inner)]
    cell = Manifold.batch_boolean(whole, OpType.Add) if whole else None
    nodes = lattice.grid[~lattice.inside & ~gone]
    bare = {tuple(node) for node in lattice.grid[gone].tolist()}
    faces = lattice.grid[lattice.struts[lattice.on_face]]
    faces = faces[[_ends(ends) not in left_out for ends in faces]] if left_out else faces
    low, top = lattice.cells[0, 2], lattice.cells[0, 2] + d.count * up

    def layer(floor: int) -> Any:
        found = []
        for at in lattice.cells[lattice.cells[:, 2] == floor] if cell is not None else ():
            kept = [ends for ends in inner if _ends(at + ends) not in left_out]
            if len(kept) == len(inner):
                found.append(placed(cell, at))
            else:
                own = kind.grid[kind.inside]
                parts = [placed(ball, node) for node in own if tuple((at + node).tolist()) not in bare]
                parts += [placed(strut(ends), ends[0]) for ends in kept]
                found.append(placed(Manifold.batch_boolean(parts, OpType.Add), at))
        found += [placed(ball, node) for node in nodes if floor <= node[2] < floor + up]
        found += [placed(strut(ends), ends[0]) for ends in faces if floor <= ends[:, 2].min() < floor + up]
        united = Manifold.batch_boolean(found, OpType.Add)
        united.num_tri()  # as above
        return united

    if left_out:
        stack = [layer(low + k * up) for k in range(d.count)]
    else:
        first = layer(low)
        stack = [first.translate([0.0, 0.0, k * d.cell]) for k in range(d.count)]
    stack += [placed(ball, node) for node in nodes if node[2] == top]
    stack += [placed(strut(ends), ends[0]) for ends in faces if ends[:, 2].min() == top]
    return Manifold.batch_boolean(stack, OpType.Add) ^ _envelope(d, offset)


def _graded_solid(
    d: Dimensions,
    lattice: Lattice,
    facets: Facets,
    offset: NDArray[np.float64] | None,
    without: NDArray[np.bool_] | None,
    gone: NDArray[np.bool_],
) -> Any:
    """`lattice_solid` of graded struts: a half, strut by strut, and its mirror image across x = 0."""
    from manifold3d import Manifold, OpType

    nodes, t = lattice.nodes, np.linspace(0.0, 1.0, facets.along_strut + 1)
    kept = np.ones(len(lattice.struts), bool) if without is None else ~without
    # A waveguide off the bending plane leaves out struts on one side alone.
    half = without is None
    slack = 1e-9 * d.cell
    x = nodes[lattice.struts][:, :, 0]
    right = (x.max(axis=1) > slack) | (np.abs(x) <= slack).all(axis=1)
    chosen = kept & right if half else kept
    low = nodes[lattice.struts[chosen, 0]]
    way = nodes[lattice.struts[chosen, 1]] - low
    parts = [
        (low[n, 2], shapes.spindle(way[n], radii, facets.around_strut, offset).translate(low[n].tolist()))
        for n, radii in enumerate(lattice.radii(t, chosen))
    ]
    at = ~gone & (nodes[:, 0] > -slack if half else True)
    parts += [
        (node[2], shapes.ball(float(radius), facets.around_strut, offset).translate(node.tolist()))
        for node, radius in zip(nodes[at], lattice.node_radii[at], strict=True)
    ]
    # Layer by layer first: bodies that are far apart are cheap to unite.
    floors = np.floor(np.array([z for z, _ in parts]) / d.cell + 1e-9)
    layers = [
        Manifold.batch_boolean(
            [body for (_, body), f in zip(parts, floors, strict=True) if f == floor], OpType.Add
        )
        for floor in np.unique(floors)
    ]
    whole = Manifold.batch_boolean(layers, OpType.Add)
    if half:
        whole += whole.mirror([1.0, 0.0, 0.0])
    return whole ^ _envelope(d, offset)


def _ends(ends: NDArray[np.int64]) -> frozenset[tuple[int, ...]]:
    """A strut (2, 3) of the grid, with its ends in either order."""
    return frozenset(tuple(end) for end in ends.tolist())


def printable(solid: Any) -> tuple[Vertices, Triangles]:
    """Surface of a Manifold as vertices (n, 3) in mm and triangles (m, 3), closed also in single precision.

    Vertices are simplified, rounded and welded to the first step of QUANTA that leaves no bad edge, or else
    to the last.
    """
    for quantum in QUANTA:
        # Slivers between nearly coincident facets would weld into edges of four triangles: collapse them.
        mesh = solid.simplify(quantum).to_mesh64()
        vertices = np.asarray(mesh.vert_properties)[:, :3]
        welded = weld(vertices, np.asarray(mesh.tri_verts).astype(np.int64), quantum)
        if bad_edges(welded[1]) == 0:
            break
    return welded
