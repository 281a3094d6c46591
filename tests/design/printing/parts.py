"""The smallest real unit, and faults put into it where they can be looked for."""

from functools import cache

import numpy as np

from mu_addon.design import shapes
from mu_addon.design.parameters import Chambers, Unit
from mu_addon.design.solid import build_solid, printable


def small_unit():
    return Unit(chambers=Chambers(count=3))


@cache
def small_solid():
    return build_solid(small_unit())


def arrays(body):
    """Vertices and triangles of a Manifold, closed in single precision."""
    return printable(body)


def manifold(vertices, triangles):
    from manifold3d import Manifold, Mesh64

    return Manifold(Mesh64(vertices, triangles.astype(np.uint64)))


def small_body():
    s = small_solid()
    return manifold(s.vertices, s.triangles)


# Apex of the second chamber's wall, on the side where no strut meets it.
APEX = np.array([12.05 * np.cos(0.35), -12.05 * np.sin(0.35), 18.75])


def drilled(diameter):
    """A hole through the wall at APEX."""
    drill = shapes.cylinder(diameter / 2.0, -1.5, 1.5, 24).rotate([0, 90, 0])
    drill = drill.rotate([0, 0, -np.degrees(0.35)]).translate(APEX.tolist())
    return arrays(small_body() - drill)


def thin_walled(left):
    """A pocket, 3 mm wide, cut into the wall from outside, that leaves `left` mm of it at APEX."""
    radius = np.linalg.norm(APEX[:2]) - 0.45 + left
    tool = shapes.cylinder(1.5, 0.0, 3.0, 32).rotate([0, 90, 0]).translate([radius, 0, 0])
    return arrays(small_body() - tool.rotate([0, 0, -np.degrees(0.35)]).translate([0, 0, float(APEX[2])]))


def plugged():
    """The inlet stopped from z = -4 to -2."""
    return arrays(small_body() + shapes.cylinder(2.4, -4.0, -2.0, 64))


def narrowed(diameter):
    """The inlet narrowed to a bore of that diameter from z = -4 to -2."""
    ring = shapes.cylinder(2.4, -4.0, -2.0, 64) - shapes.cylinder(diameter / 2.0, -5.0, -1.0, 48)
    return arrays(small_body() + ring)


def with_floating_strut(middle):
    """A rod of 4 mm that touches nothing."""
    rod = shapes.cylinder(0.75, -2.0, 2.0, 24).rotate([30, 40, 0]).translate(list(middle))
    vertices, triangles = small_solid().vertices, small_solid().triangles
    other = arrays(rod)
    return joined((vertices, triangles), other)


def joined(one, other):
    """Two surfaces in one file, not united."""
    return np.concatenate([one[0], other[0]]), np.concatenate([one[1], other[1] + len(one[0])])


def near(vertices, triangles, place, radius):
    """Triangles whose middles lie within a distance of a place."""
    return np.linalg.norm(vertices[triangles].mean(axis=1) - place, axis=1) < radius
