"""STEP files of a unit's bodies with exact surfaces: cavity, membrane, envelope, waveguide.

Bodies of revolution are swept from half sections of Bezier arcs, the profile's parabolas as quadratic ones,
so that no Boolean operation touches them. Struts are left out: fused as faces they take hours.
"""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from ..arrays import Array
from ..design.block import FACES
from ..design.dimensions import Dimensions
from ..design.profile import cavity_arcs, cavity_volume, outer_arcs, outer_volume
from ..design.waveguide import Bar
from ..errors import InputError, MeshingError
from ..files import output_error, replacing
from ..reading import file_bytes
from .gmsh_model import gmsh_model, load_gmsh

ROUND = 16
"""Elements around a full turn, of order 2, when a STEP file is measured: volumes are then right to 2e-4."""


def bodies(d: Dimensions, bar: Bar | None = None) -> dict[str, float]:
    """Exact volume in mm3 of each body that can be written, by name: cavity, membrane, envelope, waveguide.

    The cavity includes the inlet's bore, the membrane its boss. The waveguide is there if `bar` is given.
    """
    (x0, x1), (y0, y1), (z0, z1) = d.bounds
    bore, boss = np.pi * d.inlet_radius**2, np.pi * (d.inlet_radius + d.inlet_wall) ** 2
    cavity = cavity_volume(d) + bore * (d.inlet_length + d.base_cap)
    found = {
        "cavity": cavity,
        "membrane": outer_volume(d) + boss * d.inlet_length - cavity,
        "envelope": (x1 - x0) * (y1 - y0) * (z1 - z0) - outer_volume(d),
    }
    if bar is not None:
        whole = bar.solid()
        for cut in bar.cut_solids():
            whole -= cut
        found["waveguide"] = float(whole.volume())
    return found


def write_step(name: str, d: Dimensions, path: Path, bar: Bar | None = None) -> None:
    """Write one body as STEP in mm, completely or not at all.

    cavity: chambers and inlet in one; membrane: the wall with caps and inlet; envelope: the lattice's box
    without the actuator; waveguide: bar and seats, with all their cuts. Raises InputError for another name,
    MeshingError where gmsh cannot be loaded (GmshUnavailable) or fails, and OutputError.
    """
    makers: dict[str, Callable[[Any], object]] = {
        "cavity": lambda occ: _revolved(occ, _cavity_section(d)),
        "membrane": lambda occ: _revolved(occ, _membrane_section(d)),
        "envelope": lambda occ: _envelope(occ, d),
        "waveguide": lambda occ: _waveguide(occ, bar),
    }
    if name not in makers:
        raise InputError(f"there is no body {name!r}", "STEP", f"choose one of {', '.join(makers)}")
    with gmsh_model(load_gmsh()) as gmsh, replacing(path) as beside:
        try:
            makers[name](gmsh.model.occ)
            gmsh.model.occ.synchronize()
            _only_solids(gmsh)
            with _quiet():
                gmsh.write(str(beside))
        except Exception as error:
            raise MeshingError(
                f"gmsh could not make the {name}: {error}", path.name, "leave STEP out"
            ) from error


def step_volume(path: Path) -> tuple[int, float]:
    """Number of solids in a STEP file, and their volume in mm3 within a surface mesh of order 2.

    By the divergence theorem over the mesh: the CAD kernel's mass properties are wrong by up to 20 % on some
    swept splines. Raises MeshingError where gmsh cannot be loaded or cannot read the file.
    """
    with gmsh_model(load_gmsh()) as gmsh:
        try:
            gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
            gmsh.model.occ.importShapes(str(path))
            gmsh.model.occ.synchronize()
            solids = gmsh.model.getEntities(3)
            gmsh.option.setNumber("Mesh.ElementOrder", 2)
            kept = gmsh.option.getNumber("Mesh.MeshSizeFromCurvature")
            gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", ROUND)
            try:
                gmsh.model.mesh.generate(2)
            finally:
                gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", kept)
            return len(solids), sum(_enclosed(gmsh, solid) for solid in solids)
        except Exception as error:
            raise MeshingError(
                f"gmsh could not read the STEP file back: {error}", str(path), "leave STEP out"
            ) from error


def step_bytes(name: str, d: Dimensions, bar: Bar | None = None) -> tuple[bytes, int, float]:
    """One body's STEP file as of `write_step`, and what `step_volume` finds in it. Raises their errors."""
    try:
        with tempfile.TemporaryDirectory(prefix="mu-step-") as folder:
            path = Path(folder) / f"{name}.step"
            write_step(name, d, path, bar)
            return file_bytes(path), *step_volume(path)
    except OSError as error:
        raise output_error(error, Path(tempfile.gettempdir())) from error


def _enclosed(gmsh: Any, solid: tuple[int, int]) -> float:
    """Volume in mm3 within the meshed faces of a solid, which gmsh turns outward."""
    places, weights = gmsh.model.mesh.getIntegrationPoints(9, "Gauss4")
    total = 0.0
    for _, face in gmsh.model.getBoundary([solid], oriented=False):
        tangents, _, points = gmsh.model.mesh.getJacobians(9, places, face)
        tangents, points = np.reshape(tangents, (-1, 3, 3)), np.reshape(points, (-1, 3))
        normals = np.cross(tangents[:, 0], tangents[:, 1])
        weight = np.tile(weights, len(points) // len(weights))
        total += float(np.sum(weight * np.einsum("ij,ij->i", points, normals))) / 3.0
    return total


@contextmanager
def _quiet() -> Iterator[None]:
    """Discard standard output: the STEP writer prints there at every verbosity of gmsh."""
    sys.stdout.flush()
    try:
        kept = os.dup(1)
    except OSError:  # closed, as in a process without a console
        yield
        return
    with open(os.devnull, "w", encoding="utf-8") as nowhere:
        os.dup2(nowhere.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


# A half section is a list of arcs, each a list of Bezier poles (radius, z), from one end to the next.
Section = list[Array]


def _cavity_section(d: Dimensions) -> Section:
    arcs = [np.asarray(arc) for arc in cavity_arcs(d)]
    low, high = arcs[0][0], arcs[-1][-1]
    corners = [
        [0.0, high[1]],
        [0.0, -d.inlet_length],
        [d.inlet_radius, -d.inlet_length],
        [d.inlet_radius, low[1]],
    ]
    return arcs + _lines([high, *corners, low])


def _membrane_section(d: Dimensions) -> Section:
    outer = [np.asarray(arc) for arc in outer_arcs(d)]
    inner = [np.asarray(arc)[::-1] for arc in cavity_arcs(d)[::-1]]
    top, bottom = inner[0][0], inner[-1][-1]
    boss = d.inlet_radius + d.inlet_wall
    over = _lines([outer[-1][-1], [0.0, d.height], [0.0, top[1]], top])
    under = [
        bottom,
        [d.inlet_radius, bottom[1]],
        [d.inlet_radius, -d.inlet_length],
        [boss, -d.inlet_length],
        [boss, 0.0],
    ]
    start = outer[0][0]
    if boss < start[0] - 1e-9:
        under.append(start)
    return outer + over + inner + _lines(under)


def _lines(points: Sequence[Any]) -> Section:
    """Straight pieces between points, without those of zero length."""
    at = [np.asarray(p, float) for p in points]
    return [np.stack([a, b]) for a, b in pairwise(at) if np.linalg.norm(b - a) > 1e-12]


def _revolved(occ: Any, section: Section) -> list[tuple[int, int]]:
    """A closed half section turned once about z: each arc sweeps one face."""
    first = [occ.addPoint(float(arc[0, 0]), 0.0, float(arc[0, 1])) for arc in section]
    curves = []
    for arc, start, end in zip(section, first, [*first[1:], first[0]], strict=True):
        poles = [start, *(occ.addPoint(float(r), 0.0, float(z)) for r, z in arc[1:-1]), end]
        curves.append(occ.addLine(*poles) if len(poles) == 2 else occ.addBezier(poles))
    face = occ.addPlaneSurface([occ.addCurveLoop(curves)])
    swept = occ.revolve([(2, face)], 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 2.0 * np.pi)
    return [entity for entity in swept if entity[0] == 3]


def _envelope(occ: Any, d: Dimensions) -> None:
    (x0, x1), (y0, y1), (z0, z1) = d.bounds
    outer = [np.asarray(arc) for arc in outer_arcs(d)]
    axis = _lines([outer[-1][-1], [0.0, d.height], [0.0, 0.0], outer[0][0]])
    box = occ.addBox(x0, y0, z0, x1 - x0, y1 - y0, z1 - z0)
    occ.cut([(3, box)], _revolved(occ, outer + axis))


def _waveguide(occ: Any, bar: Bar | None) -> None:
    if bar is None:
        raise InputError("a waveguide needs a path", "waveguide", "name a path")
    legs = [_hexahedron(occ, corners) for corners in bar.legs]
    parts = [*legs, *(_hull(occ, seat.solid()) for seat in bar.seats)]
    whole = parts[:1]
    if len(parts) > 1:
        whole, _ = occ.fuse(whole, parts[1:])
    occ.cut(whole, [_hexahedron(occ, cut.corners) for cut in bar.cuts])


def _hexahedron(occ: Any, corners: Array) -> tuple[int, int]:
    """A solid of six flat faces from eight corners in the order of `Block.corners`."""
    return _faced(occ, corners, FACES.tolist())


def _hull(occ: Any, solid: Any) -> tuple[int, int]:
    """A convex Manifold as a solid of triangles."""
    mesh = solid.to_mesh64()
    corners = np.asarray(mesh.vert_properties)[:, :3]
    return _faced(occ, corners, np.asarray(mesh.tri_verts).astype(int).tolist())


def _faced(occ: Any, corners: Array, faces: list[list[int]]) -> tuple[int, int]:
    points = [occ.addPoint(*(float(c) for c in corner)) for corner in corners]
    lines: dict[tuple[int, int], int] = {}

    def line(a: int, b: int) -> int:
        if (b, a) in lines:
            return -lines[b, a]
        return lines.setdefault((a, b), occ.addLine(points[a], points[b]))

    sides = [
        occ.addPlaneSurface([occ.addCurveLoop([line(a, b) for a, b in zip(f, [*f[1:], f[0]], strict=True)])])
        for f in faces
    ]
    return 3, occ.addVolume([occ.addSurfaceLoop(sides)])


def _only_solids(gmsh: Any) -> None:
    """Remove the points and curves left by construction, so that a file holds its body alone."""
    for dim in (2, 1, 0):
        bounds = {entity for solid in gmsh.model.getEntities(3) for entity in _boundary(gmsh, solid, dim)}
        loose = [entity for entity in gmsh.model.getEntities(dim) if entity[1] not in bounds]
        if loose:
            gmsh.model.occ.remove(loose)
    gmsh.model.occ.synchronize()


def _boundary(gmsh: Any, solid: tuple[int, int], dim: int) -> list[int]:
    found = [solid]
    for _ in range(3 - dim):
        found = gmsh.model.getBoundary(found, combined=False, oriented=False)
    return [tag for _, tag in found]
