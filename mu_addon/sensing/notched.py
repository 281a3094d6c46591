"""Kinks of a bent and stretched bar at its wells, where it is weaker and its centroid is off its axis.

Each section carries the same force N and moment M about the bar's axis. With the area A, its second moment I
and its centroid's distance c from the axis, an Euler-Bernoulli bar with strain e and curvature k of its axis
has N = E A (e + c k) and M = E (A c e + (I + A c^2) k). At a well A and I are those of the section below it,
and c is half its depth: a pulled bar opens its wells though its ends do not turn.
"""

from __future__ import annotations

import numpy as np

from ..arrays import Array
from .embedded_waveguide import WaveguideShape
from .guide import Centreline

_STEPS_A_MM = 8


def with_wells(shape: WaveguideShape, line: Centreline) -> Centreline:
    """The axis of a bar with wells whose mean curvature and stretch are those of `line`.

    Lengths in mm, curvatures in 1/mm. The mean is over the part held by struts, from the line's first
    junction to its last; the rest is unchanged. The far end face is displaced a little from the line's, which
    has no effect on light.
    """
    s, strain, curvature, before = _given_way(shape, line)
    step = np.diff(s)
    turn = np.concatenate([[0.0], np.cumsum((curvature - before) * step)])
    tangent, normals = _frame(line, s)
    sine, cosine = np.sin(turn)[:, None], np.cos(turn)[:, None]
    tangent, normals = cosine * tangent - sine * normals, cosine * normals + sine * tangent
    way = (tangent[1:] + tangent[:-1]) / 2
    way *= ((1 + strain) * step / np.linalg.norm(way, axis=1))[:, None]
    return Centreline(s, line.points[0] + np.vstack([np.zeros(3), np.cumsum(way, axis=0)]), normals)


def well_angles(shape: WaveguideShape, line: Centreline) -> Array:
    """Angle (n,) in radians by which each well on the line bends the bar beyond the line's own curvature."""
    s, _, curvature, before = _given_way(shape, line)
    return shape.well_width * np.interp(
        _on(line, np.asarray(shape.wells)), (s[1:] + s[:-1]) / 2, curvature - before
    )


def _on(line: Centreline, s: Array) -> Array:
    return s[(s >= line.s[0] - 1e-6) & (s <= line.s[-1] + 1e-6)]


def _given_way(shape: WaveguideShape, line: Centreline) -> tuple[Array, Array, Array, Array]:
    """Lengths (n,) along a bar, and between them its strain and curvature, and the line's, (n - 1,)."""
    s = np.linspace(line.s[0], line.s[-1], max(2, int(_STEPS_A_MM * (line.s[-1] - line.s[0]))) + 1)
    middle = (s[1:] + s[:-1]) / 2
    smooth = np.stack([np.interp(middle, line.s, v) for v in (line.stretch - 1, line.curvature)])
    wells = _on(line, np.asarray(shape.wells))
    cut = (np.abs(middle - wells[:, None]) < shape.well_width / 2).any(axis=0)
    flexibility = np.where(
        cut[:, None, None],
        np.linalg.inv(_stiffness(shape.width, shape.height, shape.well_depth)),
        np.linalg.inv(_stiffness(shape.width, shape.height, 0.0)),
    )
    nodes = _on(line, np.array([(a + b) / 2 for a, b in shape.junctions]))
    between = np.ones(len(middle), bool)
    if len(nodes) > 1:
        between = (middle > nodes[0]) & (middle < nodes[-1])
    force = np.linalg.solve(flexibility[between].mean(axis=0), smooth)
    strain, curvature = np.where(between, np.einsum("nij,jn->in", flexibility, force), smooth)
    return s, strain, curvature, smooth[1]


def _stiffness(width: float, height: float, depth: float) -> Array:
    """N and M by the axis' strain and curvature, (2, 2) over the modulus, of a section with a well."""
    left = height - depth
    area, off = width * left, -depth / 2
    return np.array([[area, area * off], [area * off, width * left**3 / 12 + area * off**2]])


def _frame(line: Centreline, s: Array) -> tuple[Array, Array]:
    """Unit tangents and normals (n, 3) of a line at lengths (n,)."""
    tangent = np.gradient(line.points, line.s, axis=0, edge_order=2)
    tangent, normals = (
        np.column_stack([np.interp(s, line.s, column) for column in values.T])
        for values in (tangent, line.normals)
    )
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    normals -= tangent * np.einsum("ni,ni->n", tangent, normals)[:, None]
    return tangent, normals / np.linalg.norm(normals, axis=1)[:, None]
