"""Warp kernels of follower pressure on the faces of a cavity: its volume, force and tangent."""

from __future__ import annotations

import warp as wp

from .kernels import f64, vec3
from .laws.tensors import mat33


@wp.kernel
def enclosed_volume(
    x: wp.array(dtype=vec3),
    faces: wp.array2d(dtype=int),
    dN: wp.array3d(dtype=f64),
    N: wp.array2d(dtype=f64),
    weight: wp.array(dtype=f64),
    out: wp.array(dtype=f64),
):
    """Cavity volume of a face: its normal points out of the solid, into the cavity, hence the sign."""
    f = wp.tid()
    total = f64(0.0)
    for q in range(N.shape[0]):
        r = vec3()
        s = vec3()
        t = vec3()
        for a in range(faces.shape[1]):
            p = x[faces[f, a]]
            r += N[q, a] * p
            s += dN[q, a, 0] * p
            t += dN[q, a, 1] * p
        total -= weight[q] * wp.dot(r, wp.cross(s, t)) / f64(3.0)
    out[f] = total


@wp.kernel
def pressure_force(
    pressure: f64,
    share: wp.array(dtype=f64),
    x: wp.array(dtype=vec3),
    faces: wp.array2d(dtype=int),
    dN: wp.array3d(dtype=f64),
    N: wp.array2d(dtype=f64),
    weight: wp.array(dtype=f64),
    out: wp.array2d(dtype=vec3),
):
    """Internal-minus-external force of each face's share of a follower pressure: + p n da on its nodes."""
    f = wp.tid()
    for a in range(faces.shape[1]):
        out[f, a] = vec3()
    for q in range(N.shape[0]):
        s = vec3()
        t = vec3()
        for a in range(faces.shape[1]):
            p = x[faces[f, a]]
            s += dN[q, a, 0] * p
            t += dN[q, a, 1] * p
        area = share[f] * pressure * weight[q] * wp.cross(s, t)
        for a in range(faces.shape[1]):
            out[f, a] = out[f, a] + N[q, a] * area


@wp.kernel
def pressure_stiffness(
    pressure: f64,
    share: wp.array(dtype=f64),
    x: wp.array(dtype=vec3),
    faces: wp.array2d(dtype=int),
    dN: wp.array3d(dtype=f64),
    N: wp.array2d(dtype=f64),
    weight: wp.array(dtype=f64),
    first: int,
    out: wp.array(dtype=mat33),
):
    """Tangent of `pressure_force`, symmetrised a face.

    On a closed cavity (or one closed by symmetry planes) the assembled tangent is symmetric, because its
    uniform pressure has the potential -p V; the sum of the faces' symmetric parts is therefore the same.
    """
    f = wp.tid()
    n = faces.shape[1]
    start = first + f * ((n * (n + 1)) // 2)
    for q in range(N.shape[0]):
        s = vec3()
        t = vec3()
        for a in range(n):
            p = x[faces[f, a]]
            s += dN[q, a, 0] * p
            t += dN[q, a, 1] * p
        w = share[f] * pressure * weight[q]
        for a in range(n):
            for b in range(a, n):
                # N_a d(s x t) by node b, and the other way round.
                ab = N[q, a] * (dN[q, b, 1] * wp.skew(s) - dN[q, b, 0] * wp.skew(t))
                ba = N[q, b] * (dN[q, a, 1] * wp.skew(s) - dN[q, a, 0] * wp.skew(t))
                block = w * f64(0.5) * (ab + wp.transpose(ba))
                at = start + a * n - (a * (a - 1)) // 2 + (b - a)
                if q == 0:
                    out[at] = block
                else:
                    out[at] = out[at] + block
