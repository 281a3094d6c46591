"""Pictures of a unit in a report: cut open along its plane of bending, at rest and in motion."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..design.dimensions import Dimensions
from ..design.profile import outer_radius
from ..design.rigid_body import RigidBody
from ..meshing.mesh import LATTICE, MEMBRANE, Mesh, boundary_faces
from .render import Camera, Cut, Floats, Image, Part, framed, png, render
from .results import Picture, SideView
from .shapes import ball, tube

MEMBRANE_COLOR = (0.93, 0.78, 0.58)
LATTICE_COLOR = (0.62, 0.69, 0.77)
PATH_COLOR = (0.835, 0.369, 0.0)  # plots.CHOSEN
ANCHOR_COLOR = (0.10, 0.11, 0.16)
OBSTACLE_COLOR = (0.47, 0.45, 0.43)
COLORS = {MEMBRANE: MEMBRANE_COLOR, LATTICE: LATTICE_COLOR}
MIRROR_PLANE = Cut((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), color=(0.95, 0.86, 0.72))
WHITE = (1.0, 1.0, 1.0)

# Node between two corners of a second-order tetrahedron, in VTK's order.
_MIDDLE = np.array([[-1, 4, 6, 7], [4, -1, 5, 8], [6, 5, -1, 9], [7, 8, 9, -1]])


def unit_parts(d: Dimensions, vertices: Floats, triangles: NDArray[np.integer]) -> list[Part]:
    """The printable surface, vertices (n, 3) in mm, triangles (m, 3), as membrane with inlet, and lattice."""
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    z = vertices[:, 2]
    membrane = (radius <= outer_radius(d, np.clip(z, 0.0, d.height)) + 1e-3 * d.cell) | (z < 0.0)
    inside = membrane[triangles].all(axis=1)
    return [
        Part(vertices, triangles[inside], MEMBRANE_COLOR),
        Part(vertices, triangles[~inside], LATTICE_COLOR),
    ]


def side_view(
    parts: Sequence[Part], anchors: Floats, path: ArrayLike, radius: float, width: int = 900
) -> SideView:
    """The section x = 0 of the unit seen along -x, to scale, with anchors (n, 3) and a path (k, 3) in mm.

    radius: of the sensor along the path in mm, 1.6 of it for the anchors' balls; a path of fewer than two
    points is not drawn; width: of the image in pixels.
    """
    seen = [*parts, *_sensor(anchors, np.asarray(path, float), radius)]
    camera, aspect = _framed(seen, (1.0, 0.0, 0.0))
    image = render(seen, camera, width, round(width / aspect), cut=MIRROR_PLANE)
    return SideView(image, camera.extent(aspect), anchors[:, 1:])


def portrait(
    parts: Sequence[Part], anchors: Floats, path: ArrayLike, radius: float, width: int = 900
) -> Image:
    """Image (h, width, 4) of the unit cut open, from the front, above and the lattice's side, on white.

    anchors (n, 3), path (k, 3) and radius in mm as in `side_view`; width in pixels.
    """
    seen = [*parts, *_sensor(anchors, np.asarray(path, float), radius)]
    camera, aspect = _framed(seen, (1.0, 0.55, 0.30))
    return render(seen, camera, width, round(width / aspect), cut=MIRROR_PLANE, background=WHITE)


def _framed(parts: Sequence[Part], towards: tuple[float, float, float]) -> tuple[Camera, float]:
    """Camera that frames `parts` after that cut, and the aspect they fill."""
    behind = np.array([0.0, np.inf, np.inf])
    left = [part if part.whole else Part(np.minimum(part.vertices, behind), part.faces) for part in parts]
    return framed(left, towards, margin=0.015)


def motion(
    mesh: Mesh,
    states: Sequence[tuple[Floats, str, str]],
    width: int = 560,
    beside: Sequence[RigidBody] = (),
    colors: Sequence[dict[int, Floats]] = (),
    outside: bool = False,
) -> list[Picture]:
    """One picture for each state, all to one scale, of the mesh cut open along its plane of bending.

    outside: show the half from the other side, uncut.

    A state is displacement (n, 3) in mm, caption and alternative text. beside: rigid bodies, of which the
    part at x <= 0 and within the picture is shown; width: in pixels. colors: for each state, by region, sRGB
    (n, 3) of the nodes, in place of one colour a region; other regions are left out.
    """
    skins, plain = skins_of(mesh), COLORS
    # A half mesh lies at x >= 0; its mirror image shows the same section to a viewer at +x.
    flip = mesh.nodes[:, 0].min() > -1e-9
    scenes = []
    for number, (displacement, _, _) in enumerate(states):
        color = colors[number] if colors else plain
        nodes = mesh.nodes + displacement
        if flip:
            nodes = nodes * [-1.0, 1.0, 1.0]
        scenes.append(
            [
                Part(nodes, faces[:, ::-1] if flip else faces, color[region])
                for region, faces in skins.items()
                if region in color
            ]
        )
    every = [part for scene in scenes for part in scene]
    standing = _behind(beside)
    camera, aspect = _framed(every, (-1.0 if outside else 1.0, 0.25, 0.12))
    cut = None if flip or outside else Cut(MIRROR_PLANE.point, MIRROR_PLANE.normal)
    return [
        Picture(
            png(
                render(
                    [*scene, *standing],
                    camera,
                    width,
                    round(width / aspect),
                    cut=cut,
                    background=WHITE,
                )
            ),
            caption,
            alt,
        )
        for scene, (_, caption, alt) in zip(scenes, states, strict=True)
    ]


def _behind(bodies: Sequence[RigidBody]) -> list[Part]:
    """Part of some bodies at x <= 0, where the cut unit is."""
    found = []
    for rigid in bodies:
        mesh = rigid.body.manifold.trim_by_plane([-1.0, 0.0, 0.0], 0.0).to_mesh64()
        if len(mesh.tri_verts):
            vertices = np.array(mesh.vert_properties)[:, :3]
            found.append(
                Part(vertices, np.asarray(mesh.tri_verts).astype(np.int64), OBSTACLE_COLOR, whole=True)
            )
    return found


def region_skin(mesh: Mesh, region: int) -> NDArray[np.int64]:
    """Outward triangles (f, 3) on the boundary of a region of a mesh, four for a face with mid nodes.

    Struts of a printed mesh end where they are tied: their parts within the wall are left out.
    """
    triangles = skin(mesh.tets[mesh.region == region])
    return triangles[~np.isin(triangles, mesh.tied).all(axis=1)]


def skins_of(mesh: Mesh) -> dict[int, NDArray[np.int64]]:
    """`region_skin` of a unit's wall and of its lattice, by region."""
    return {region: region_skin(mesh, region) for region in (MEMBRANE, LATTICE)}


def skin(tets: NDArray[np.integer]) -> NDArray[np.int64]:
    """Outward triangles (f, 3) on the boundary of tetrahedra (m, 4 | 10), four for a face with mid nodes."""
    corners, owner = boundary_faces(tets)
    if tets.shape[1] == 4:
        return corners.astype(np.int64)
    nodes = tets[owner]
    local = np.argmax(corners[:, :, None] == nodes[:, None, :4], axis=2)
    a, b, c = corners.T
    ab, bc, ca = (
        np.take_along_axis(nodes, _MIDDLE[local[:, i], local[:, j]][:, None], axis=1)[:, 0]
        for i, j in ((0, 1), (1, 2), (2, 0))
    )
    return np.stack([a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca], axis=1).reshape(-1, 3).astype(np.int64)


def _sensor(anchors: Floats, path: Floats, radius: float) -> list[Part]:
    """Anchors as balls and the sensor as a tube; neither is cut."""
    balls = [Part(*ball(point, 1.6 * radius), ANCHOR_COLOR, whole=True) for point in anchors]
    sensor = [Part(*tube(path, radius), PATH_COLOR, whole=True)] if len(path) > 1 else []
    return sensor + balls
