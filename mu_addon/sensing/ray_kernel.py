"""Warp kernel of light rays in a closed surface; see `tracing`. Single precision, on the CPU or a device."""

from __future__ import annotations

import warp as wp

from ..fem.kernels import start_warp
from .guide import ENTRY, EXIT, JUNCTION

start_warp()
wp.set_module_options({"enable_backward": False})

# Where a ray ended: at the detector, out of the entry, out of a wall, in a strut, faded, or lost count of.
DETECTED, RETURNED, ESCAPED, LEAKED, ABSORBED, UNFINISHED = range(6)
FATES = ("detected", "returned", "escaped", "leaked", "absorbed", "unfinished")
_FAINT = 1e-4
_MOST_HITS = 5000


@wp.func
def fresnel(cosine: float, n1: float, n2: float):
    """Reflected share of unpolarised light, 1 beyond the critical angle (Fresnel's equations).

    cosine: of the angle of incidence; n1, n2: refractive index before and behind the surface.
    """
    sine = n1 / n2 * wp.sqrt(wp.max(0.0, 1.0 - cosine * cosine))
    if sine >= 1.0:
        return float(1.0)
    other = wp.sqrt(1.0 - sine * sine)
    s = (n1 * cosine - n2 * other) / (n1 * cosine + n2 * other)
    p = (n1 * other - n2 * cosine) / (n1 * other + n2 * cosine)
    return 0.5 * (s * s + p * p)


@wp.kernel
def trace_rays(
    mesh: wp.uint64,
    kinds: wp.array(dtype=int),
    starts: wp.array(dtype=wp.vec3),
    directions: wp.array(dtype=wp.vec3),
    index: float,
    around: float,
    attenuation: float,
    roughness: float,
    seed: int,
    fate: wp.array(dtype=int),
    weight: wp.array(dtype=float),
    absorbed: wp.array(dtype=float),
):
    """Follow each of n rays from outside the entry to its end.

    starts, directions (n): in mm, and of unit length; kinds (f): of the mesh's faces; index, around:
    refractive indices inside and outside; attenuation in 1/mm; roughness: standard deviation of the wall's
    slope (no unit). Written: fate (n), weight (n), the share of its light left, and absorbed (n), the share
    absorbed.
    """
    ray = wp.tid()
    state = wp.rand_init(seed, ray)
    p = starts[ray]
    d = directions[ray]
    w = float(1.0)
    inside = int(0)
    entered = int(0)
    ended = int(UNFINISHED)
    for _ in range(_MOST_HITS):
        hit = wp.mesh_query_ray(mesh, p, d, 1.0e4)
        if not hit.result:
            ended = int(ESCAPED)
            if entered == 0:
                ended = int(RETURNED)
            break
        if inside == 1:
            w = w * wp.exp(-attenuation * hit.t)
            if w < _FAINT:
                ended = int(ABSORBED)
                break
        kind = kinds[hit.face]
        n = hit.normal
        cosine = -wp.dot(d, n)
        # The surface is closed and its normals point out: the face tells on which side the ray is.
        inside = int(0)
        if cosine < 0.0:
            inside = int(1)
            n = -n
            cosine = -cosine
        at = p + hit.t * d
        if kind == JUNCTION and inside == 1:
            ended = int(LEAKED)
            break
        flat = n
        if roughness > 0.0 and kind != ENTRY and kind != EXIT:
            side = wp.cross(n, wp.vec3(1.0, 0.0, 0.0))
            if wp.length(side) < 0.1:
                side = wp.cross(n, wp.vec3(0.0, 1.0, 0.0))
            side = wp.normalize(side)
            other = wp.cross(n, side)
            tilted = n + roughness * (wp.randn(state) * side + wp.randn(state) * other)
            tilted = wp.normalize(tilted)
            if -wp.dot(d, tilted) > 1.0e-3:
                n = tilted
                cosine = -wp.dot(d, n)
        n1 = around
        n2 = index
        if inside == 1:
            n1 = index
            n2 = around
        if wp.randf(state) < fresnel(cosine, n1, n2):
            d = d + 2.0 * cosine * n
            # A tilted wall cannot send light through itself.
            into = wp.dot(d, flat)
            if into < 1.0e-4:
                d = d + (1.0e-4 - into) * flat
            d = wp.normalize(d)
            p = at + 1.0e-4 * flat
        else:
            if inside == 1 and kind == EXIT:
                ended = int(DETECTED)
                break
            if inside == 1 and kind == ENTRY:
                ended = int(RETURNED)
                break
            ratio = n1 / n2
            along = wp.sqrt(wp.max(0.0, 1.0 - ratio * ratio * (1.0 - cosine * cosine)))
            d = wp.normalize(ratio * d + (ratio * cosine - along) * n)
            into = wp.dot(d, flat)
            if into > -1.0e-4:
                d = wp.normalize(d - (into + 1.0e-4) * flat)
            p = at - 1.0e-4 * flat
            inside = 1 - inside
            entered = int(1)
    fate[ray] = ended
    weight[ray] = w
    absorbed[ray] = 1.0 - w
