"""The lattice region between the membrane and the envelope box, filled by gmsh around given triangles."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import Any

import attrs
import numpy as np

from ..errors import MeshingError
from ..run.supervisor import write_stack_at_crash
from .gmsh_libraries import SYSTEM_LIBRARIES, install_libraries, missing_libraries
from .mesh import Array, boundary_faces

# Elements grow by half their distance from the anchors' line and from the necks.
_GROWTH = 0.5


class GmshUnavailable(MeshingError):
    """gmsh is not installed, or a system library it needs cannot be loaded."""


@attrs.frozen
class Sizes:
    """Element sizes in mm: at the envelope, on the anchors' line x = 0, y = `row`, and at the necks.

    row and neck_radius are positions in mm: of the line, and of the necks' outer surface.
    """

    envelope: float
    anchor: float
    row: float
    neck: float
    neck_radius: float


def load_gmsh() -> Any:
    """The gmsh module. Raises GmshUnavailable, naming the missing part, if it cannot be loaded."""
    try:
        import gmsh
    except ImportError as error:
        raise GmshUnavailable(f"gmsh is not installed: {error}", remedy="pip install gmsh") from error
    except OSError as error:
        raise GmshUnavailable(
            f"gmsh cannot load a system library: {error}",
            remedy=install_libraries(missing_libraries() or SYSTEM_LIBRARIES),
        ) from error
    # Where its wheel was unpacked without the library, gmsh imports all the same and only warns.
    if not hasattr(gmsh.lib, "gmshInitialize"):
        raise GmshUnavailable(
            "gmsh is installed without its library",
            remedy="install gmsh by pip in a separate environment",
        )
    return gmsh


def lattice_mesh(
    nodes: Array, outside: Array, plan: Array, height: float, sizes: Sizes
) -> tuple[Array, Array]:
    """Fill the space between the membrane and its envelope with linear tetrahedra.

    nodes (n, 3) in mm; outside (f, 3), the triangles of the membrane towards the lattice, which the filling
    keeps; plan (k, 2), corners (x, y) in mm of the envelope, from the end of one mirror plane to the end of
    the other; height in mm. Returns additional nodes (a, 3), numbered on from n, and tets (m, 4). Raises
    GmshUnavailable, and MeshingError where gmsh fails or does not keep the given triangles.
    """
    # gmsh numbers its own nodes on from the largest it was given, so these must be dense.
    used, dense = np.unique(outside, return_inverse=True)
    surface = np.reshape(dense, (-1, 3))
    with gmsh_model(load_gmsh()) as gmsh:
        _place_surface(gmsh, nodes[used], surface, height)
        _envelope(gmsh, plan, height, sizes)
        try:
            gmsh.model.mesh.generate(3)
        except Exception as error:
            raise MeshingError(
                f"gmsh could not fill the lattice region: {error}",
                "between the profile and the envelope",
                "refine the mesh, or leave more room between the bladders and the envelope",
            ) from error
        tags, flat, _ = gmsh.model.mesh.getNodes()
        kinds, _, connectivity = gmsh.model.mesh.getElements(3)
    if list(kinds) != [4]:
        raise MeshingError("gmsh returned no tetrahedra", "lattice region", "refine the mesh")
    tags = tags.astype(np.int64)
    fresh = np.sort(tags[tags > len(used)])
    number = np.full(tags.max() + 1, -1)
    number[1 : len(used) + 1] = used
    number[fresh] = len(nodes) + np.arange(len(fresh))
    where = np.empty(tags.max() + 1, np.int64)
    where[tags] = np.arange(len(tags))
    added = flat.reshape(-1, 3)[where[fresh]]
    tets = number[connectivity[0].astype(np.int64).reshape(-1, 4)]
    kept, _ = boundary_faces(tets)
    wanted = {tuple(t) for t in np.sort(outside, axis=1)}
    missing = wanted - {tuple(t) for t in np.sort(kept, axis=1)}
    if missing:
        raise MeshingError(
            f"{len(missing)} triangles of the profile are not in the lattice mesh",
            f"near {np.round(nodes[list(min(missing))].mean(axis=0), 2)} mm",
            "refine the mesh",
        )
    return added, tets


# Every option that decides the mesh.
_OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 1,
    "Mesh.Optimize": 1,
    "Mesh.OptimizeNetgen": 1,
    "Mesh.RandomSeed": 1,
    "Mesh.Renumber": 0,
    "Mesh.ElementOrder": 1,
    "Mesh.MeshSizeExtendFromBoundary": 1,
}


@contextmanager
def gmsh_model(gmsh: Any) -> Iterator[Any]:
    """Context of a new, silent gmsh model with fixed options; gmsh's state is restored afterwards."""
    ours = not gmsh.isInitialized()
    if ours:
        # Personal option files and signal handlers would change results and Ctrl-C.
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        write_stack_at_crash()
    before = {name: gmsh.option.getNumber(name) for name in _OPTIONS}
    current = gmsh.model.getCurrent()
    try:
        gmsh.model.add("mu lattice")
        for name, value in _OPTIONS.items():
            gmsh.option.setNumber(name, value)
        yield gmsh
    finally:
        gmsh.model.remove()
        if ours:
            gmsh.finalize()
        else:
            gmsh.model.setCurrent(current)
            for name, value in before.items():
                gmsh.option.setNumber(name, value)


def _rim(nodes: Array, outside: Array, height: float) -> list[Array]:
    """The four border curves of the profile surface as node lists: first meridian up, arc at the top,
    second meridian up, arc at the base; meridians go from z = 0, arcs from the first meridian."""
    directed = outside[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    _, first, count = np.unique(np.sort(directed, axis=1), axis=0, return_index=True, return_counts=True)
    border = np.unique(directed[first[count == 1]])
    angle = np.arctan2(nodes[border, 0], nodes[border, 1])
    z = nodes[border, 2]
    last = angle.max()
    curves = []
    for chosen, key in (
        (angle == 0, z),
        (z == height, angle),
        (angle == last, z),
        (z == 0, angle),
    ):
        curves.append(border[chosen][np.argsort(key[chosen])])
    return curves


def _place_surface(gmsh: Any, nodes: Array, outside: Array, height: float) -> None:
    """Add the profile as discrete surface 1 with its border, curves 1..4; a node's tag is its id + 1."""
    rim = _rim(nodes, outside, height)
    first, _, second, _ = rim
    ends = [first[0], first[-1], second[-1], second[0]]
    for point, node in enumerate(ends, start=1):
        gmsh.model.addDiscreteEntity(0, point)
        gmsh.model.setCoordinates(point, *nodes[node])
        gmsh.model.mesh.addNodes(0, point, [node + 1], nodes[node])
        gmsh.model.mesh.addElementsByType(point, 15, [], [node + 1])
    for curve, (line, bounds) in enumerate(zip(rim, ([1, 2], [2, 3], [4, 3], [1, 4]), strict=True), start=1):
        gmsh.model.addDiscreteEntity(1, curve, bounds)
        gmsh.model.mesh.addNodes(1, curve, line[1:-1] + 1, nodes[line[1:-1]].ravel())
        pairs = np.column_stack([line[:-1], line[1:]]) + 1
        gmsh.model.mesh.addElementsByType(curve, 1, [], pairs.ravel())
    gmsh.model.addDiscreteEntity(2, 1, [1, 2, 3, 4])
    inside = np.setdiff1d(np.arange(len(nodes)), np.concatenate(rim))
    gmsh.model.mesh.addNodes(2, 1, inside + 1, nodes[inside].ravel())
    gmsh.model.mesh.addElementsByType(1, 2, [], (outside + 1).ravel())


def _envelope(gmsh: Any, plan: Array, height: float, sizes: Sizes) -> None:
    """Close the space between profile and envelope: planes from the border curves to the box."""
    geo = gmsh.model.geo
    first, top, second, base = 1, 2, 3, 4
    low = [geo.addPoint(x, y, 0.0, sizes.envelope) for x, y in plan]
    high = [geo.addPoint(x, y, height, sizes.envelope) for x, y in plan]
    rise = [geo.addLine(a, b) for a, b in zip(low, high, strict=True)]
    floor = [geo.addLine(a, b) for a, b in pairwise(low)]
    roof = [geo.addLine(a, b) for a, b in pairwise(high)]
    # Spokes join the border's four end points to the box along the mirror planes.
    spoke = [
        geo.addLine(1, low[0]),
        geo.addLine(2, high[0]),
        geo.addLine(3, high[-1]),
        geo.addLine(4, low[-1]),
    ]
    loops = [
        [first, spoke[1], -rise[0], -spoke[0]],
        [second, spoke[2], -rise[-1], -spoke[3]],
        [base, spoke[3], *[-c for c in floor[::-1]], -spoke[0]],
        [top, spoke[2], *[-c for c in roof[::-1]], -spoke[1]],
    ]
    loops += [[f, rise[i + 1], -roof[i], -rise[i]] for i, f in enumerate(floor)]
    planes = [geo.addPlaneSurface([geo.addCurveLoop(loop)]) for loop in loops]
    geo.addVolume([geo.addSurfaceLoop([1, *planes])])
    geo.synchronize()
    # Sizes of the given triangles spread inward by themselves, but not along the lines that end on them.
    field = gmsh.model.mesh.field
    laws = [
        f"{sizes.anchor!r} + {_GROWTH} * Sqrt(x*x + (y - {sizes.row!r})*(y - {sizes.row!r}))",
        f"{sizes.neck!r} + {_GROWTH} * Fabs(Sqrt(x*x + y*y) - {sizes.neck_radius!r})",
    ]
    parts = []
    for law in laws:
        parts.append(field.add("MathEval"))
        field.setString(parts[-1], "F", law)
    least = field.add("Min")
    field.setNumbers(least, "FieldsList", parts)
    field.setAsBackgroundMesh(least)
