"""A user-defined body as a closed surface: read, checked, and cut to serve as a unit's envelope."""

from __future__ import annotations

import hashlib
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..arrays import ranges
from ..errors import InputError
from ..reading import file_bytes
from . import shapes
from .dimensions import Dimensions
from .printing.crossing import MOST_CROSSINGS, crossings
from .profile import outer_polygon
from .surface import UNITS, Triangles, Vertices, odd_edges, volume, weld
from .surface_reading import SUFFIXES, read_surface, require_mesh

if TYPE_CHECKING:
    from .anchors import Window
    from .parameters import Unit

MOST_TRIANGLES = 60_000
"""Limit on a body's triangles: a finer body would take minutes to examine, and the mesh is coarser by far."""
MOST_BYTES = 1 << 25
"""Limit on a body's file: twice that many triangles as text. Reading it takes 1.3 GB at most."""
MOST_MM = 1_000_000.0
"""Limit on a coordinate: anything farther away has other units, or is damaged."""
QUANTUM_MM = 1e-5
"""Vertices closer than that are one: files repeat them for every triangle."""
AROUND = 96
"""Number of flat pieces around the actuator in the test for a body that contains it."""
SLACK_MM = 1e-3
"""Distance by which a body may miss an end plane."""


@attrs.frozen
class Flaw:
    """Fault of a surface: what is wrong, what to do, and the places (n, 3) in mm."""

    what: str
    remedy: str
    places: NDArray[np.float64] = attrs.field(eq=False, factory=lambda: np.empty((0, 3)))


@attrs.frozen(eq=False, repr=False)
class Body:
    """A surface of triangles (m, 3) between vertices (n, 3) in mm, in the unit's frame.

    Raises InputError where it is empty, has a coordinate that is not finite or beyond MOST_MM, or more than
    MOST_TRIANGLES triangles. `flaws` checks that the surface is closed.
    """

    vertices: Vertices
    triangles: Triangles
    name: str = "body"

    def __attrs_post_init__(self) -> None:
        if not (len(self.triangles) and np.isfinite(self.vertices).all()):
            raise InputError(
                "the file contains no surface, or a coordinate is not a number",
                self.name,
                "give a closed mesh of triangles",
            )
        if (farthest := float(np.abs(self.vertices).max(initial=0.0))) > MOST_MM:
            raise InputError(
                f"a coordinate of {farthest:.3g} mm lies beyond {MOST_MM:g} mm",
                self.name,
                "give it in mm, near the unit's frame",
            )
        if len(self.triangles) > MOST_TRIANGLES:
            raise InputError(
                f"it has {len(self.triangles)} triangles",
                self.name,
                f"simplify it to {MOST_TRIANGLES} at most; the analysis mesh is coarser still",
            )

    def __repr__(self) -> str:
        # Caches use it: the same surface under any name, with every digit.
        return f"Body({self.hash})"

    @property
    def bounds(self) -> NDArray[np.float64]:
        """Lowest and highest corner (2, 3) in mm."""
        return np.stack([self.vertices.min(axis=0), self.vertices.max(axis=0)])

    @cached_property
    def hash(self) -> str:
        """SHA-256 of the surface, in hexadecimal."""
        return hashlib.sha256(self.text().encode()).hexdigest()

    def text(self) -> str:
        """The surface as a Wavefront OBJ in mm, with every digit."""
        lines = ["# closed surface, millimetres"]
        lines += [f"v {x!r} {y!r} {z!r}" for x, y, z in self.vertices.tolist()]
        lines += [f"f {a} {b} {c}" for a, b, c in (self.triangles + 1).tolist()]
        return "\n".join(lines) + "\n"

    @cached_property
    def manifold(self) -> Any:
        """The body as a manifold3d.Manifold, in mm."""
        from manifold3d import Manifold, Mesh64

        return Manifold(Mesh64(self.vertices, self.triangles.astype(np.uint64)))


def body_of(vertices: ArrayLike, triangles: ArrayLike, name: str = "body") -> Body:
    """Body of triangles (m, 3) and vertices (n, 3) in mm; vertices that agree to QUANTUM_MM are merged.

    A closed surface whose faces all look inward is reversed. Raises InputError as `Body` does.
    """
    given = np.asarray(vertices, float).reshape(-1, 3), np.asarray(triangles, np.int64).reshape(-1, 3)
    if not (len(given[1]) and np.isfinite(given[0]).all() and np.abs(given[0]).max(initial=0.0) <= MOST_MM):
        # It reports the fault; welding would change such numbers.
        return Body(*given, name)
    points, faces = weld(*given, QUANTUM_MM)
    if len(faces) and not len(odd_edges(faces)[0]) and volume(points, faces) < 0.0:
        faces = faces[:, ::-1]
    return Body(points, faces, name)


def read_body(path: str | Path) -> Body:
    """Body in an STL, OBJ or PLY file in mm; polygons are split into triangles.

    Raises InputError for another file type, a file that cannot be read, and as `Body` does.
    """
    path = Path(path)
    remedy = "give a closed surface as STL, OBJ or PLY, in mm"
    try:
        content = file_bytes(path, MOST_BYTES)
        if path.suffix.lower() not in SUFFIXES:
            require_mesh(content[:64], path.name)
            raise InputError(f"the file type {path.suffix or '(none)'} is not supported", path.name, remedy)
        return body_of(*read_surface(content, path.name), path.name)
    except OSError as error:
        why = error.strerror or error
        raise InputError(f"no body can be read from it: {why}", str(path), remedy) from error
    except InputError as error:
        raise InputError(f"no body can be read from it: {error.what}", str(path), error.remedy) from error


def flaws(body: Body) -> list[Flaw]:
    """Reasons why a surface does not bound one solid body; empty if it does.

    Checked are open and inconsistently oriented edges, edges of more than two faces and self-intersection.
    Without these faults the number of separate bodies and the sign of the volume are checked.
    """
    v, t = body.vertices, body.triangles
    open_, crowded = odd_edges(t)
    found = []
    if len(open_):
        found.append(
            Flaw(
                f"{len(open_)} edges are open or have inconsistently oriented neighbours",
                "fill the holes and make all faces look outward",
                v[open_].mean(axis=1),
            )
        )
    if len(crowded):
        found.append(
            Flaw(
                f"{len(crowded)} edges belong to more than two faces",
                "remove inner and doubled faces",
                v[crowded].mean(axis=1),
            )
        )
    crossing = crossings(v, t)
    if len(crossing):
        found.append(
            Flaw(
                f"the surface intersects itself in {len(crossing)} places"
                + (" or more" if len(crossing) == MOST_CROSSINGS else ""),
                "unite the parts, or move them apart",
                crossing,
            )
        )
    if found:
        return found
    shells = body.manifold.decompose()
    if len(shells) != 1:
        places = np.array([_middle(s) for s in shells])
        found.append(Flaw(f"there are {len(shells)} separate bodies", "unite them, or give one", places))
    elif body.manifold.volume() <= 0.0:
        found.append(Flaw("the surface encloses no volume", "make its faces look outward"))
    return found


def misfits(body: Body, d: Dimensions) -> list[Flaw]:
    """Reasons why a body without `flaws` cannot be the envelope of a unit of these dimensions.

    Checked are a size that suggests another unit of length, the extent along z against the unit's height, and
    the chambers' position inside.
    """
    low, high = body.bounds
    size, own = float(np.ptp(body.bounds, axis=0).max()), float(np.ptp(np.array(d.bounds), axis=1).max())
    if not 0.3 < size / own < 3.0:
        # Only guesses that would pass the checks below, best first.
        by_size = sorted(UNITS.items(), key=lambda item: abs(np.log(size * item[0] / own)))
        fits = {f: unit for f, unit in by_size if size * f / own < 3.0 and _spans(f * body.bounds, d)}
        if fits:
            return [
                Flaw(
                    f"it is {size:.4g} mm long, the unit {own:.4g} mm: it seems to be in "
                    + " or ".join(fits.values()),
                    "scale it by " + " or ".join(f"{factor:g}" for factor in fits),
                    np.stack([low, high]),
                )
            ]
    found = []
    if low[2] > SLACK_MM or high[2] < d.height - SLACK_MM:
        found.append(
            Flaw(
                f"it reaches from z = {low[2]:.4g} to {high[2]:.4g} mm, the unit from 0 to {d.height:.4g} mm",
                "move it, or lengthen it past both ends; the parts beyond them are cut off flat",
                np.array([[0.0, 0.0, z] for z in (low[2], high[2])]),
            )
        )
    # A little less than its length: at its end faces would coincide.
    near = 2.0 * SLACK_MM
    between = shapes.box([-2.0 * d.R, -2.0 * d.R, near], [2.0 * d.R, 2.0 * d.R, d.height - near])
    outside = (shapes.revolved(outer_polygon(d, 6), AROUND) ^ between) - body.manifold
    pieces = [piece for piece in outside.decompose() if piece.volume() > 1e-6 * d.cell**3]
    if pieces and not found:
        found.append(
            Flaw(
                f"the chambers protrude from it in {len(pieces)} places",
                f"widen it: the chambers are {2.0 * d.R:.4g} mm wide around the z axis",
                np.array([_vertex(piece) for piece in pieces]),
            )
        )
    return found


def _spans(bounds: NDArray[np.float64], d: Dimensions) -> bool:
    """Return True if a box (2, 3) in mm reaches past both end planes of a unit and around its chambers."""
    low, high = bounds
    aside = (low[:2] <= -d.R).all() and (high[:2] >= d.R).all()
    return bool(aside and low[2] <= SLACK_MM and high[2] >= d.height - SLACK_MM)


def overlaps(body: Body, d: Dimensions, own: Body | None = None) -> list[Flaw]:
    """Overlap of a body without `flaws` with a unit of these dimensions: one Flaw with all places, or empty.

    own: the body that replaces the lattice's box as envelope. The lattice counts as filled, since that is how
    it is simulated.
    """
    lattice = shapes.box(*np.transpose(d.bounds)) if own is None else own.manifold
    common = (lattice + shapes.revolved(outer_polygon(d, 6), AROUND)) ^ body.manifold
    pieces = [piece for piece in common.decompose() if piece.volume() > 1e-9 * d.cell**3]
    if not pieces:
        return []
    deep = max(float(np.ptp(np.reshape(p.bounding_box(), (2, 3)), axis=0).min()) for p in pieces)
    return [
        Flaw(
            f"it overlaps the unit by up to {deep:.2g} mm deep",
            "move it away from the unit",
            np.array([_middle(piece) for piece in pieces]),
        )
    ]


def envelope(body: Body, d: Dimensions) -> Body:
    """The body cut flat at the unit's end planes, z = 0 and z = d.height.

    Raises InputError with the first of its `flaws` or `misfits`.
    """
    require_sound(body, [*flaws(body)] or misfits(body, d))
    low, high = body.bounds
    slab = shapes.box([*low[:2] - 1.0, 0.0], [*high[:2] + 1.0, d.height])
    return _body_from(body.manifold ^ slab, body.name, d.height)


def section(body: Body) -> list[NDArray[np.float64]]:
    """Outlines (n, 2) of the body in the plane x = 0, y and z in mm."""
    turned = body.manifold.rotate([0.0, -90.0, 0.0]).slice(0.0).to_polygons()
    return [np.column_stack([np.asarray(p)[:, 1], -np.asarray(p)[:, 0]]) for p in turned]


def require_sound(body: Body, found: list[Flaw], role: str = "an envelope") -> None:
    """Raise InputError for the first of these flaws and its first place; do nothing for an empty list.

    role: the body's intended use, for the message.
    """
    if found:
        flaw = found[0]
        at = ", first at ({:.2f}, {:.2f}, {:.2f}) mm".format(*flaw.places[0]) if len(flaw.places) else ""
        raise InputError(f"the body cannot be {role}: {flaw.what}", f"{body.name}{at}", flaw.remedy)


def require_path_inside(body: Body, unit: Unit, window: Window) -> None:
    """Raise InputError where the waveguide along a window leaves the body, or cannot be built in it."""
    from .waveguide import waveguide

    bar = waveguide(unit, window, covering(unit.dimensions, body)).solid()
    if (bar - body.manifold).volume() > 1e-6 * bar.volume():
        raise InputError(
            f"the waveguide along {window.name} leaves the body",
            f"{body.name}; [waveguide] row",
            "choose a row nearer to the axis, or a wider body",
        )


def covering(d: Dimensions, body: Body | None) -> Dimensions:
    """Dimensions with enough cells in the envelope to contain the body, to which the lattice is then cut.

    Without a body those given.
    """
    if body is None:
        return d
    low, high = body.bounds
    half_x = _cells(max(-low[0], high[0]), d.cell)
    return attrs.evolve(
        d,
        cells_x=2 * half_x + 1,
        cells_y_minus=_cells(-low[1], d.cell),
        cells_y_plus=_cells(high[1], d.cell),
    )


def half(body: Body) -> Body | None:
    """The part at x >= 0 of a body that is symmetric about x = 0; None for any other body.

    Symmetric means that less than 1e-4 of the volume lies outside the mirror image. Raises InputError where
    the cut surface is no valid `Body`.
    """
    whole = body.manifold
    mirrored = whole.mirror([1.0, 0.0, 0.0])
    if (whole - mirrored).volume() > 1e-4 * whole.volume():
        return None
    low, high = body.bounds
    right = whole ^ shapes.box([0.0, *low[1:] - 1.0], high + 1.0)
    return _body_from(right, body.name)


def inside(body: Body, points: ArrayLike) -> NDArray[np.bool_]:
    """True where points (..., 3) in mm lie in a closed body, shape (...,), by ray casting along z.

    A point is inside if its ray leaves through an odd number of triangles. Rays are shifted by two nanometres
    in an irrational direction, so that they miss the edges of drawn bodies. Triangles are found through the
    columns of a grid across z.
    """
    at = np.asarray(points, float)
    p = at.reshape(-1, 3) + np.array([1e-6 * np.sqrt(2.0), 1e-6 * np.sqrt(3.0), 0.0])
    corners = body.vertices[body.triangles]
    low, high = corners[..., :2].min(axis=1), corners[..., :2].max(axis=1)
    origin = low.min(axis=0)
    n = max(1, int(np.sqrt(len(corners))))
    step = np.maximum((high.max(axis=0) - origin) / n, 1e-12)
    first, last = (np.clip(((c - origin) / step).astype(int), 0, n - 1) for c in (low, high))
    spans = last - first + 1
    count = spans.prod(axis=1)
    which, nth = ranges(count)
    column = (first[which, 0] + nth // spans[which, 1]) * n + first[which, 1] + nth % spans[which, 1]
    order = np.argsort(column, kind="stable")
    which, starts = which[order], np.searchsorted(column[order], np.arange(n * n + 1))

    place = ((p[:, :2] - origin) / step).astype(int)
    near = ((p[:, :2] >= origin) & (place < n)).all(axis=1)
    found = np.zeros(len(p), bool)
    rows = np.flatnonzero(near)
    cell = place[rows, 0] * n + place[rows, 1]
    for some in np.array_split(np.arange(len(rows)), max(1, len(rows) // 20_000)):
        many = starts[cell[some] + 1] - starts[cell[some]]
        point, nth = ranges(many, starts[cell[some]])
        point = rows[some][point]
        a, b, c = np.moveaxis(corners[which[nth]], 1, 0)
        q = p[point]
        areas = [_area(q, b, c), _area(q, c, a), _area(q, a, b)]
        whole = areas[0] + areas[1] + areas[2]
        within = np.all([s * np.sign(whole) > 0.0 for s in areas], axis=0)
        height = sum(s * corner[:, 2] for s, corner in zip(areas, (a, b, c), strict=True))
        above = within & (height * np.sign(whole) > q[:, 2] * np.abs(whole))
        found[rows[some]] = np.bincount(point[above], minlength=len(p))[rows[some]] % 2 == 1
    return found.reshape(at.shape[:-1])


def _area(p: NDArray[np.float64], q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.float64]:
    """Twice the signed area of triangles seen along z."""
    return np.asarray((q[:, 0] - p[:, 0]) * (r[:, 1] - p[:, 1]) - (q[:, 1] - p[:, 1]) * (r[:, 0] - p[:, 0]))


def _middle(piece: Any) -> list[float]:
    """Centre of a Manifold's bounding box."""
    box = np.reshape(piece.bounding_box(), (2, 3))
    return [float(c) for c in box.mean(axis=0)]


def _vertex(piece: Any) -> NDArray[np.float64]:
    """The vertex of a Manifold that is nearest to the mean of all."""
    vertices = np.asarray(piece.to_mesh64().vert_properties)[:, :3]
    return np.asarray(vertices[np.linalg.norm(vertices - vertices.mean(axis=0), axis=1).argmin()])


def _cells(reach: float, cell: float) -> int:
    """Number of cells on one side of the middle one that cover a distance from the axis."""
    return max(1, int(np.ceil(reach / cell - 0.5 - 1e-9)))


def _body_from(solid: Any, name: str, height: float | None = None) -> Body:
    """Surface of a Manifold, its ends put exactly on the planes it was cut at."""
    mesh = solid.simplify(QUANTUM_MM).to_mesh64()
    vertices = np.array(mesh.vert_properties)[:, :3]
    if height is not None:
        for plane in (0.0, height):
            vertices[np.abs(vertices[:, 2] - plane) < 1e-6, 2] = plane
    return body_of(vertices, np.asarray(mesh.tri_verts).astype(np.int64), name)
