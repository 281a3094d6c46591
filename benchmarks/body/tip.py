"""The tip's rotation read off parts of its plane, which in a printed unit are a cap and ends of struts."""

from __future__ import annotations

import numpy as np

from mu_addon.design.dimensions import Dimensions
from mu_addon.fem.bending_angle import TipSection
from mu_addon.meshing.mesh import TET_EDGES, Mesh, boundary_faces

# Facets of a remeshed cap may end outside its circle by this share of its radius.
_RIM = 0.01


def cap_angle_deg(mesh: Mesh, u, d: Dimensions) -> float:
    """Best-fit rotation in degrees of the tip cap's end, (n, 3) in mm, whatever else lies in its plane."""
    return tip_section(mesh, d, "cap").angle_deg(u)


def tip_section(mesh: Mesh, d: Dimensions, part: str = "plane") -> TipSection:
    """The end plane at the tip: all that lies in it ("plane"), the actuator's "cap", or all but it ("rest").

    Elements of which less than half is filled at their four points are left out.
    """
    faces, owner = boundary_faces(mesh.tets)
    corners = mesh.nodes[faces]
    on = (np.abs(corners[:, :, 2] - d.height) < 1e-9).all(axis=1)
    if mesh.of_printed_body:
        on &= mesh.filled[owner].mean(axis=1) > 0.5
    cap = (np.hypot(corners[..., 0], corners[..., 1]) <= d.r * (1.0 + _RIM)).all(axis=1)
    on &= {"plane": np.ones_like(cap), "cap": cap, "rest": ~cap}[part]
    faces, owner, corners = faces[on], owner[on], corners[on]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    if mesh.order == 2:
        ends = mesh.tets[owner][:, TET_EDGES]
        in_face = (ends[..., None] == faces[:, None, None]).any(axis=3).all(axis=2)
        faces = mesh.tets[owner][:, 4:][in_face].reshape(-1, 3)
    weight = np.zeros(len(mesh.nodes))
    np.add.at(weight, faces, area[:, None] / 3)
    nodes = np.flatnonzero(weight)
    return TipSection(nodes, mesh.nodes[nodes], weight[nodes])
