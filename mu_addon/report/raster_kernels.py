"""Warp kernels of the renderer: triangles into a depth buffer, and sky light from depth maps.

Single precision, on the CPU, one triangle after another: a picture is the same every time.
"""

from __future__ import annotations

import warp as wp

from ..fem.kernels import start_warp

start_warp()
wp.set_module_options({"enable_backward": False})


@wp.func
def crossing(a: wp.vec3, b: wp.vec3, y: float, lo: float, hi: float):
    """Span (lo, hi) of pixels, widened to where the edge from a to b crosses the row y; all in pixels."""
    if (a[1] <= y) != (b[1] <= y):
        x = a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        lo = wp.min(lo, x)
        hi = wp.max(hi, x)
    return wp.vec2(lo, hi)


@wp.kernel
def draw(
    screen: wp.array(dtype=wp.vec3),  # pixels right, pixels down, nearness
    beyond: wp.array(dtype=float),  # signed distance past the cutting plane; what is past it is not drawn
    faces: wp.array(dtype=wp.vec3i),
    keep: wp.array(dtype=int),  # 0 leaves a face out
    back_bias: float,  # nearness by which a back wins over a front that coincides with it
    start: int,  # the picture's row that is the first of these
    ceiling: wp.array2d(dtype=float),  # only what lies farther than this is drawn
    depth: wp.array2d(dtype=float),
    owner: wp.array2d(dtype=int),
):
    """Nearest visible face of every pixel (h, w): its nearness into `depth`, its number into `owner`.

    Nearness grows toward the viewer; only faces nearer than `depth` has and farther than `ceiling` are drawn,
    up to the cutting plane. To be launched with dim 1: faces are drawn one after another.
    """
    h = depth.shape[0]
    w = depth.shape[1]
    for f in range(faces.shape[0]):
        if keep[f] == 0:
            continue
        ia = faces[f][0]
        ib = faces[f][1]
        ic = faces[f][2]
        if beyond[ia] > 0.0 and beyond[ib] > 0.0 and beyond[ic] > 0.0:
            continue
        a = screen[ia]
        b = screen[ib]
        c = screen[ic]
        top = wp.max(int(wp.ceil(wp.min(a[1], wp.min(b[1], c[1])) - 0.5)), start)
        bottom = wp.min(int(wp.floor(wp.max(a[1], wp.max(b[1], c[1])) - 0.5)), start + h - 1)
        if top > bottom:
            continue
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0.0:
            continue
        # Rows run downward, so outward faces turn their front to the viewer where this is negative.
        bias = float(0.0)
        if area > 0.0:
            bias = back_bias
        near = wp.max(a[2], wp.max(b[2], c[2]))
        far = wp.min(a[2], wp.min(b[2], c[2]))
        # Nearness and distance past the plane are affine on the screen.
        zx = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area
        zy = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area
        sa = beyond[ia]
        sb = beyond[ib] - sa
        sc = beyond[ic] - sa
        sx = (sb * (c[1] - a[1]) - sc * (b[1] - a[1])) / area
        sy = (sc * (b[0] - a[0]) - sb * (c[0] - a[0])) / area
        for row in range(top, bottom + 1):
            y = float(row) + 0.5
            span = crossing(a, b, y, 1.0e30, -1.0e30)
            span = crossing(b, c, y, span[0], span[1])
            span = crossing(c, a, y, span[0], span[1])
            if span[0] > span[1]:
                continue
            # A thousandth of a pixel wider: neighbours may round their common edge differently.
            first = wp.max(int(wp.ceil(span[0] - 0.501)), 0)
            last = wp.min(int(wp.floor(span[1] - 0.499)), w - 1)
            for column in range(first, last + 1):
                dx = float(column) + 0.5 - a[0]
                dy = y - a[1]
                z = wp.clamp(a[2] + zx * dx + zy * dy, far, near) + bias
                shown = sa + sx * dx + sy * dy <= 0.0
                here = row - start
                if shown and z > depth[here, column] and z < ceiling[here, column]:
                    depth[here, column] = z
                    owner[here, column] = f


@wp.struct
class View:
    """The camera and cutting plane that turn a pixel into a ray: along `towards`, or from the eye."""

    target: wp.vec3
    right: wp.vec3
    up: wp.vec3
    towards: wp.vec3
    scale: float  # pixels per mm in the target's plane
    distance: float  # mm from eye to target; 0: orthographic
    cut: wp.vec3  # normal of the cutting plane; zero: none
    cut_offset: float
    cut_color: wp.vec3  # negative: the part's own


@wp.kernel
def surface(
    view: View,
    screen: wp.array(dtype=wp.vec3),
    inverse_distance: wp.array(dtype=float),  # per vertex; 1 in an orthographic picture
    faces: wp.array(dtype=wp.vec3i),
    face_normals: wp.array(dtype=wp.vec3),
    whole: wp.array(dtype=int),  # 1: this face's part is left whole by the cut
    corner_normals: wp.array2d(dtype=wp.vec3),
    colors: wp.array(dtype=wp.vec3),
    start: int,  # the picture's row that is the first of these
    height: int,  # rows of the picture
    owner: wp.array2d(dtype=int),
    depth: wp.array2d(dtype=float),  # moved to the plane where a section shows
    position: wp.array2d(dtype=wp.vec3),
    normal: wp.array2d(dtype=wp.vec3),
    color: wp.array2d(dtype=wp.vec3),
):
    """Position in mm, unit normal toward the viewer and colour at every pixel (h, w).

    Where the nearest face shows its back behind a cutting plane, the section is filled. To be launched with
    dim (h, w).
    """
    row, column = wp.tid()
    f = owner[row, column]
    if f < 0:
        return
    ia = faces[f][0]
    ib = faces[f][1]
    ic = faces[f][2]
    a = screen[ia]
    b = screen[ib]
    c = screen[ic]
    x = float(column) + 0.5
    y = float(row + start) + 0.5
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    wb = wp.clamp(((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area, 0.0, 1.0)
    wc = wp.clamp(((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area, 0.0, 1.0 - wb)
    wa = (1.0 - wb - wc) * inverse_distance[ia]
    wb = wb * inverse_distance[ib]
    wc = wc * inverse_distance[ic]
    total = wa + wb + wc
    color[row, column] = (colors[ia] * wa + colors[ib] * wb + colors[ic] * wc) / total

    right = (x - 0.5 * float(owner.shape[1])) / view.scale
    up = (0.5 * float(height) - y) / view.scale
    q = view.target + view.right * right + view.up * up
    away = -view.towards
    if view.distance > 0.0:
        away = q - view.target - view.towards * view.distance
    if wp.length(view.cut) > 0.0 and whole[f] == 0 and wp.dot(face_normals[f], away) > 0.0:
        # The nearest face shows its back: behind the plane the ray starts inside this part.
        t = (view.cut_offset - wp.dot(q, view.cut)) / wp.dot(away, view.cut)
        position[row, column] = q + away * t
        normal[row, column] = view.cut
        if view.cut_color[0] >= 0.0:
            color[row, column] = view.cut_color
        if view.distance > 0.0:
            depth[row, column] = 1.0 / (view.distance * (1.0 + t))
        else:
            depth[row, column] = -t
        return
    if view.distance > 0.0:
        position[row, column] = q + away * (1.0 / (depth[row, column] * view.distance) - 1.0)
    else:
        position[row, column] = q - away * depth[row, column]
    n = wp.normalize(corner_normals[f, 0] * wa + corner_normals[f, 1] * wb + corner_normals[f, 2] * wc)
    if wp.dot(n, away) > 0.0:
        n = -n
    normal[row, column] = n


@wp.kernel
def shade(
    owner: wp.array2d(dtype=int),
    position: wp.array2d(dtype=wp.vec3),
    normal: wp.array2d(dtype=wp.vec3),
    key: wp.vec3,
    up: wp.vec3,
    samples: int,  # pixels of a side that are averaged later: they share the directions out among them
    axes: wp.array2d(dtype=wp.vec3),  # per direction of the sky: right, down, towards it
    radiance: wp.array(dtype=float),  # per direction
    maps: wp.array3d(dtype=float),  # per direction: depth map of the scene, nearness to the sky
    center: wp.vec3,
    scale: float,  # pixels of a depth map per mm
    color: wp.array2d(dtype=wp.vec3),
):
    """Multiply the colours of pixels (h, w) by the light of a lamp and of the unobstructed sky.

    The unblocked share of the sky is found by comparing positions with the depth maps; each pixel takes one
    of samples^2 subsets of the directions. To be launched with dim (h, w).
    """
    row, column = wp.tid()
    if owner[row, column] < 0:
        return
    n = normal[row, column]
    lamp = 0.62 * (0.80 + 0.20 * wp.dot(n, up)) + 0.55 * wp.max(wp.dot(n, key), 0.0)
    # Off the surface by more than a map's pixel, or it would shade itself where light grazes it.
    p = position[row, column] - center + n * (1.5 / scale)
    half = float(maps.shape[1]) * 0.5
    arrives = float(0.0)
    whole = float(0.0)
    for k in range(row % samples * samples + column % samples, axes.shape[0], samples * samples):
        weight = wp.dot(n, axes[k, 2]) * radiance[k]
        if weight > 0.0:
            whole += weight
            # Bilinear over four comparisons: soft edges from small maps.
            u = wp.dot(p, axes[k, 0]) * scale + half - 0.5
            v = wp.dot(p, axes[k, 1]) * scale + half - 0.5
            c = wp.clamp(int(wp.floor(u)), 0, maps.shape[2] - 2)
            r = wp.clamp(int(wp.floor(v)), 0, maps.shape[1] - 2)
            fu = wp.clamp(u - float(c), 0.0, 1.0)
            fv = wp.clamp(v - float(r), 0.0, 1.0)
            z = wp.dot(p, axes[k, 2])
            if z >= maps[k, r, c]:
                arrives += weight * (1.0 - fu) * (1.0 - fv)
            if z >= maps[k, r, c + 1]:
                arrives += weight * fu * (1.0 - fv)
            if z >= maps[k, r + 1, c]:
                arrives += weight * (1.0 - fu) * fv
            if z >= maps[k, r + 1, c + 1]:
                arrives += weight * fu * fv
    if whole > 0.0:
        lamp = lamp * (0.12 + 0.88 * arrives / whole)
    color[row, column] = color[row, column] * lamp
