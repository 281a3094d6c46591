"""Closed bodies to put around a unit."""

import numpy as np

from mu_addon.design.body import body_of


def arrays(solid):
    mesh = solid.to_mesh64()
    return np.array(mesh.vert_properties)[:, :3], np.asarray(mesh.tri_verts).astype(np.int64)


def cylinder(half_x, half_y, middle_y, low, high, around=64):
    """Elliptic cylinder along z."""
    from manifold3d import Manifold

    solid = Manifold.cylinder(high - low, 1.0, circular_segments=around)
    return body_of(*arrays(solid.scale([half_x, half_y, 1.0]).translate([0.0, middle_y, low])), "cylinder")


def box(low, high):
    from mu_addon.design import shapes

    return body_of(*arrays(shapes.box(low, high)), "box")
