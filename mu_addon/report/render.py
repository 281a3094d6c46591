"""Pictures of triangle meshes without a graphics card, a window or a graphics library.

Triangles are drawn into a depth buffer. Light comes from the viewer's upper left and from the sky; each
visible point gets the share of the sky that no opaque part blocks.
"""

from __future__ import annotations

import io
from collections.abc import Sequence
from copy import copy
from typing import Any

import attrs
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating[Any]]
Image = NDArray[np.uint8]

CREASE_DEG = 40.0  # faces that meet at less than this are shaded as one smooth surface
SKY_DIRECTIONS = 160
SKY_MAP_PIXELS = 256
FAR = -1.0e30
# Values a band of rows has: a whole picture's take a quarter of a gigabyte.
BAND = 400_000


@attrs.frozen(eq=False)
class Part:
    """A triangle mesh with a colour: one sRGB triple, 0 .. 1, or one for each vertex (n, 3); opacity 0 .. 1.

    A closed part shows a filled section where it is cut; a part that is `whole` is not cut.
    """

    vertices: Floats  # (n, 3) mm
    faces: NDArray[np.integer[Any]]  # (m, 3), counter-clockwise from outside
    color: Any = (0.62, 0.66, 0.72)
    opacity: float = 1.0
    whole: bool = False


@attrs.frozen(eq=False)
class Camera:
    """A camera that looks at `target` (3,) from the side `towards` (3,), with `up` (3,) upward; in mm.

    height: extent of the target's plane in mm that fills the picture; distance: from eye to target in mm,
    None for an orthographic picture.
    """

    target: Any
    towards: Any
    up: Any
    height: float
    distance: float | None = None

    @property
    def axes(self) -> Floats:
        """Orthonormal unit vectors as rows (3, 3): right, up and toward the viewer."""
        towards = np.asarray(self.towards, float) / np.linalg.norm(self.towards)
        right = np.cross(np.asarray(self.up, float), towards)
        right /= np.linalg.norm(right)
        return np.array([right, np.cross(towards, right), towards])

    def extent(self, aspect: float) -> tuple[float, float, float, float]:
        """Left, right, bottom and top of the picture in mm along `axes`; aspect: width over height."""
        x, y = self.axes[:2] @ np.asarray(self.target, float)
        half = 0.5 * self.height
        return x - half * aspect, x + half * aspect, y - half, y + half


@attrs.frozen(eq=False)
class Cut:
    """A cutting plane through `point` (3,) in mm: the side of its `normal` (3,) is not drawn.

    color: sRGB of the sections, 0 .. 1, or None for that of their part.
    """

    point: Any
    normal: Any
    color: Any = None


def fit(
    parts: Sequence[Part], towards: Any, up: Any = (0.0, 0.0, 1.0), aspect: float = 1.0, margin: float = 0.04
) -> Camera:
    """The orthographic camera that shows all `parts`, with a margin given as a share of the picture.

    towards, up (3,): as in `Camera`; aspect: width over height of the picture.
    """
    axes = Camera((0, 0, 0), towards, up, 1.0).axes
    seen = np.vstack([np.asarray(part.vertices, float) for part in parts]) @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    width, height = (high - low)[:2]
    return Camera(0.5 * (low + high) @ axes, towards, up, max(height, width / aspect) / (1.0 - 2.0 * margin))


def framed(
    parts: Sequence[Part], towards: Any, up: Any = (0.0, 0.0, 1.0), margin: float = 0.04
) -> tuple[Camera, float]:
    """The camera of `fit` for a picture of the parts' own width over height, within 0.35 to 2.5; and that."""
    axes = Camera((0, 0, 0), towards, up, 1.0).axes
    width, height = np.ptp(np.vstack([np.asarray(p.vertices) for p in parts]) @ axes.T, axis=0)[:2]
    aspect = float(np.clip(width / height, 0.35, 2.5))
    return fit(parts, towards, up, aspect, margin), aspect


def render(
    parts: Sequence[Part],
    camera: Camera,
    width: int,
    height: int,
    *,
    cut: Cut | None = None,
    background: tuple[float, float, float] | None = None,
    samples: int = 2,
    layers: int = 2,
    ambient: bool = True,
) -> Image:
    """Picture (height, width, 4) of `parts` in pixels: 8-bit sRGB with straight alpha.

    background: sRGB, 0 .. 1, None for transparent; samples: squared, the number of values averaged for a
    pixel; layers: number of translucent surfaces shown behind each other; ambient: let parts shade each
    other.
    """
    scene = _Scene(parts, cut)
    shot = _Shot(scene, camera, width * samples, height * samples)
    opaque = scene.opacity == 1.0
    sky = _Sky.around(scene, opaque, camera) if ambient and opaque.any() else _Sky.clear()
    rows = samples * max(1, BAND // (shot.width * samples))
    return np.concatenate(
        [
            _band(shot.rows(first, min(first + rows, shot.height)), opaque, sky, background, samples, layers)
            for first in range(0, shot.height, rows)
        ]
    )


def _band(
    shot: _Shot,
    opaque: NDArray[np.bool_],
    sky: _Sky,
    background: tuple[float, float, float] | None,
    samples: int,
    layers: int,
) -> Image:
    """Rows of a picture covered by `shot`; see `render`."""
    scene = shot.scene
    solid = shot.draw(opaque)
    shot.shade(solid, sky, samples)
    rgb = np.zeros((*shot.shape, 3), np.float32)
    through = np.ones(shot.shape, np.float32)
    ceiling = None
    for _ in range(layers if not opaque.all() else 0):
        film = shot.draw(~opaque, ceiling, solid.depth)
        hit = film.hit
        if not hit.any():
            break
        shot.shade(film, _Sky.clear(), samples)
        # A film seen at a slant is thicker, so outlines stand out.
        facing = np.maximum(np.abs(film.normal[hit] @ shot.axes[2].astype(np.float32)), 0.2)
        opacity = 1.0 - (1.0 - scene.opacity[film.owner[hit]]) ** (1.0 / facing)
        rgb[hit] += (through[hit] * opacity)[:, None] * film.color[hit]
        through[hit] *= 1.0 - opacity
        ceiling = np.where(hit, film.depth, FAR).astype(np.float32)
    hit = solid.hit
    rgb[hit] += through[hit][:, None] * solid.color[hit]
    through[hit] = 0.0
    alpha = 1.0 - through
    if background is not None:
        rgb += through[..., None] * _linear(np.asarray(background, np.float32))
        alpha[:] = 1.0
    return _resolve(rgb, alpha, samples)


def png(image: Image) -> bytes:
    """Content of a PNG file of an image (h, w, 3 or 4) of 8 bits."""
    from PIL import Image as Pillow

    stream = io.BytesIO()
    Pillow.fromarray(image).save(stream, "PNG", compress_level=6)
    return stream.getvalue()


class _Scene:
    """All parts as one mesh, with the arrays that the kernels need."""

    def __init__(self, parts: Sequence[Part], cut: Cut | None) -> None:
        offsets = np.cumsum([0] + [len(part.vertices) for part in parts[:-1]])
        counts = [len(part.faces) for part in parts]
        self.vertices = np.vstack([np.asarray(part.vertices, np.float64) for part in parts])
        self.faces = np.vstack(
            [np.asarray(part.faces, np.int32) + offset for part, offset in zip(parts, offsets, strict=True)]
        ).astype(np.int32)
        self.colors = np.vstack(
            [
                np.broadcast_to(_linear(np.asarray(part.color, np.float32)), (len(part.vertices), 3))
                for part in parts
            ]
        )
        self.opacity = np.repeat(np.array([part.opacity for part in parts], np.float32), counts)
        self.whole = np.repeat(np.array([part.whole for part in parts], np.int32), counts)
        a, b, c = (self.vertices[self.faces[:, i]] for i in range(3))
        areas = np.cross(b - a, c - a)
        self.face_normals = areas.astype(np.float32)
        self.corner_normals = _corner_normals(self.faces, areas, len(self.vertices))
        self.cut_normal, self.cut_offset = np.zeros(3), 0.0
        self.cut_color = np.full(3, -1.0)
        self.beyond = np.full(len(self.vertices), -1.0, np.float32)
        if cut is not None:
            self.cut_normal = np.asarray(cut.normal, float) / np.linalg.norm(cut.normal)
            self.cut_offset = float(self.cut_normal @ np.asarray(cut.point, float))
            if cut.color is not None:
                self.cut_color = _linear(np.asarray(cut.color, np.float32))
            beyond = self.vertices @ self.cut_normal - self.cut_offset
            left_whole = np.repeat([part.whole for part in parts], [len(part.vertices) for part in parts])
            self.beyond = np.where(left_whole, -1.0, beyond).astype(np.float32)


@attrs.frozen(eq=False)
class _Layer:
    """First face seen by every pixel; the colour is lit only after `_Shot.shade`."""

    depth: NDArray[np.float32]
    owner: NDArray[np.int32]
    position: NDArray[np.float32]
    normal: NDArray[np.float32]
    color: NDArray[np.float32]

    @property
    def hit(self) -> NDArray[np.bool_]:
        return self.owner >= 0


class _Shot:
    """A scene seen by a camera on a screen of so many pixels; `shape` of the rows from `first` on."""

    def __init__(self, scene: _Scene, camera: Camera, width: int, height: int) -> None:
        self.scene = scene
        self.width, self.height = width, height
        self.first, self.shape = 0, (height, width)
        self.axes = camera.axes
        self.target = np.asarray(camera.target, float)
        self.distance = camera.distance
        self.scale = height / camera.height
        # Where cut parts touch, one ends as the next begins; the plane lies in the one that ends.
        self.back_bias = 0.0
        if scene.cut_normal.any():
            self.back_bias = 1e-4 * camera.height / (self.distance or 1.0) ** 2
        x, y, z = ((scene.vertices - self.target) @ self.axes.T).T
        inverse = np.ones_like(z)
        if self.distance is not None:
            inverse = 1.0 / np.maximum(self.distance - z, 1e-3 * self.distance)
            x, y, z = x * inverse * self.distance, y * inverse * self.distance, inverse
        screen = np.stack([0.5 * width + self.scale * x, 0.5 * height - self.scale * y, z], axis=1)
        self.screen = screen.astype(np.float32)
        self.inverse_distance = inverse.astype(np.float32)

    def rows(self, first: int, last: int) -> _Shot:
        """The same, of rows first .. last - 1 alone."""
        part = copy(self)
        part.first, part.shape = first, (last - first, self.width)
        return part

    def draw(
        self,
        keep: NDArray[np.bool_],
        ceiling: NDArray[np.float32] | None = None,
        floor: NDArray[np.float32] | None = None,
    ) -> _Layer:
        """Nearest of the faces `keep` that lie farther than `ceiling` and nearer than `floor`."""
        import warp as wp

        from .raster_kernels import View, draw, surface

        scene = self.scene
        shape = self.shape
        layer = _Layer(
            depth=np.full(shape, FAR, np.float32) if floor is None else floor.copy(),
            owner=np.full(shape, -1, np.int32),
            position=np.zeros((*shape, 3), np.float32),
            normal=np.zeros((*shape, 3), np.float32),
            color=np.zeros((*shape, 3), np.float32),
        )
        if ceiling is None:
            ceiling = np.full(shape, -FAR, np.float32)
        view = View()
        view.target = wp.vec3(*self.target)
        view.right, view.up, view.towards = (wp.vec3(*axis) for axis in self.axes)
        view.scale = self.scale
        view.distance = self.distance or 0.0
        view.cut = wp.vec3(*scene.cut_normal)
        view.cut_offset = scene.cut_offset
        view.cut_color = wp.vec3(*scene.cut_color)
        with wp.ScopedDevice("cpu"):
            screen = wp.array(self.screen, dtype=wp.vec3, copy=False)
            faces = wp.array(scene.faces, dtype=wp.vec3i, copy=False)
            owner = wp.array(layer.owner, dtype=int, copy=False)
            depth = wp.array(layer.depth, dtype=float, copy=False)
            wp.launch(
                draw,
                dim=1,
                inputs=[
                    screen,
                    wp.array(scene.beyond, dtype=float, copy=False),
                    faces,
                    wp.array(keep.astype(np.int32), dtype=int, copy=False),
                    self.back_bias,
                    self.first,
                    wp.array(ceiling, dtype=float, copy=False),
                    depth,
                    owner,
                ],
            )
            wp.launch(
                surface,
                dim=shape,
                inputs=[
                    view,
                    screen,
                    wp.array(self.inverse_distance, dtype=float, copy=False),
                    faces,
                    wp.array(scene.face_normals, dtype=wp.vec3, copy=False),
                    wp.array(scene.whole, dtype=int, copy=False),
                    wp.array(scene.corner_normals, dtype=wp.vec3, copy=False),
                    wp.array(scene.colors, dtype=wp.vec3, copy=False),
                    self.first,
                    self.height,
                    owner,
                    depth,
                    wp.array(layer.position, dtype=wp.vec3, copy=False),
                    wp.array(layer.normal, dtype=wp.vec3, copy=False),
                    wp.array(layer.color, dtype=wp.vec3, copy=False),
                ],
            )
        return layer

    def shade(self, layer: _Layer, sky: _Sky, samples: int) -> None:
        """Light the colours of `layer`."""
        import warp as wp

        from .raster_kernels import shade

        key = np.array([-0.45, 0.55, 0.70]) @ self.axes
        with wp.ScopedDevice("cpu"):
            wp.launch(
                shade,
                dim=self.shape,
                inputs=[
                    wp.array(layer.owner, dtype=int, copy=False),
                    wp.array(layer.position, dtype=wp.vec3, copy=False),
                    wp.array(layer.normal, dtype=wp.vec3, copy=False),
                    wp.vec3(*(key / np.linalg.norm(key))),
                    wp.vec3(*self.axes[1]),
                    samples,
                    wp.array(sky.axes, dtype=wp.vec3, copy=False),
                    wp.array(sky.radiance, dtype=float, copy=False),
                    wp.array(sky.maps, dtype=float, copy=False),
                    wp.vec3(*sky.center),
                    sky.scale,
                    wp.array(layer.color, dtype=wp.vec3, copy=False),
                ],
            )


@attrs.frozen(eq=False)
class _Sky:
    """Depth maps of the opaque parts from all around."""

    axes: NDArray[np.float32]  # (k, 3, 3): right, down, towards the sky
    radiance: NDArray[np.float32]  # (k,)
    maps: NDArray[np.float32]  # (k, p, p) mm
    center: Floats
    scale: float  # pixels per mm

    @classmethod
    def clear(cls) -> _Sky:
        """A sky without any occlusion."""
        empty = np.zeros((0, 3, 3), np.float32)
        return cls(empty, empty[:, 0, 0], empty, np.zeros(3), 1.0)

    @classmethod
    def around(cls, scene: _Scene, opaque: NDArray[np.bool_], camera: Camera) -> _Sky:
        """The sky occluded by the opaque faces; it is brighter above and behind the viewer."""
        import warp as wp

        from .raster_kernels import draw

        used = scene.vertices[np.unique(scene.faces[opaque])]
        center = 0.5 * (used.min(axis=0) + used.max(axis=0))
        scale = 0.48 * SKY_MAP_PIXELS / float(np.linalg.norm(used - center, axis=1).max())
        towards = _directions(SKY_DIRECTIONS) @ camera.axes
        # Parts behind the picture light nothing visible.
        towards = towards[towards @ camera.axes[2] > -0.7]
        aside = np.where(np.abs(towards[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
        right = np.cross(aside, towards)
        right /= np.linalg.norm(right, axis=1, keepdims=True)
        axes = np.stack([right, np.cross(towards, right), towards], axis=1)
        radiance = 0.7 + 0.3 * (towards @ camera.axes[1]) + 0.4 * np.clip(towards @ camera.axes[2], 0.0, 1.0)
        shape = (SKY_MAP_PIXELS, SKY_MAP_PIXELS)
        maps = np.full((len(axes), *shape), FAR, np.float32)
        with wp.ScopedDevice("cpu"):
            beyond = wp.array(scene.beyond, dtype=float, copy=False)
            faces = wp.array(scene.faces, dtype=wp.vec3i, copy=False)
            keep = wp.array(opaque.astype(np.int32), dtype=int, copy=False)
            ceiling = wp.full(shape, -FAR, dtype=float)
            owner = wp.zeros(shape, dtype=int)
            for k, frame in enumerate(axes):
                screen = (scene.vertices - center) @ frame.T * [scale, scale, 1.0]
                screen[:, :2] += 0.5 * SKY_MAP_PIXELS
                points = wp.array(screen.astype(np.float32), dtype=wp.vec3, copy=False)
                depth = wp.array(maps[k], dtype=float, copy=False)
                wp.launch(draw, dim=1, inputs=[points, beyond, faces, keep, 0.0, 0, ceiling, depth, owner])
        return cls(axes.astype(np.float32), radiance.astype(np.float32), maps, center, scale)


def _directions(count: int) -> Floats:
    """Unit vectors (count, 3) spread evenly over the sphere, on a Fibonacci spiral."""
    i = np.arange(count) + 0.5
    z = 1.0 - 2.0 * i / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * i
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(turn), r * np.sin(turn), z], axis=1)


def _corner_normals(faces: NDArray[np.int32], areas: Floats, vertices: int) -> NDArray[np.float32]:
    """Normals (m, 3, 3) of the faces' corners: the mean of the faces around that meet at a small angle."""
    lengths = np.linalg.norm(areas, axis=1, keepdims=True)
    units = areas / np.maximum(lengths, 1e-30)
    order = np.argsort(faces.ravel(), kind="stable")
    around = order // 3
    counts = np.bincount(faces.ravel(), minlength=vertices)
    starts = np.concatenate([[0], np.cumsum(counts)])
    normals = np.zeros((len(faces) * 3, 3))
    smooth = np.cos(np.deg2rad(CREASE_DEG))
    corner_start, corner_count = starts[faces.ravel()], counts[faces.ravel()]
    own = units[np.arange(len(faces) * 3) // 3]
    for i in range(int(counts.max(initial=0))):
        has = corner_count > i
        face = around[corner_start[has] + i]
        alike = np.einsum("ij,ij->i", units[face], own[has]) > smooth
        normals[has] += np.where(alike[:, None], areas[face], 0.0)
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30)
    return normals.reshape(-1, 3, 3).astype(np.float32)


def _linear(srgb: NDArray[np.float32]) -> NDArray[np.float32]:
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)


def _resolve(rgb: NDArray[np.float32], alpha: NDArray[np.float32], samples: int) -> Image:
    """Average `samples` squared values a pixel and encode them as sRGB with straight alpha."""
    h, w = alpha.shape
    blocks = (h // samples, samples, w // samples, samples)
    rgb = rgb.reshape(*blocks, 3).mean(axis=(1, 3))
    alpha = alpha.reshape(blocks).mean(axis=(1, 3))
    straight = np.clip(rgb / np.maximum(alpha, 1e-6)[..., None], 0.0, 1.0)
    srgb = np.where(straight <= 0.0031308, 12.92 * straight, 1.055 * straight ** (1 / 2.4) - 0.055)
    return np.round(255.0 * np.concatenate([srgb, alpha[..., None]], axis=2)).astype(np.uint8)
