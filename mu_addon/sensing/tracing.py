"""Rays of light through a guide: refraction, total reflection, absorption and rough walls, by Monte Carlo.

At each surface a ray is reflected with Fresnel's probability for unpolarised light, else refracted. In air it
continues and may re-enter across a well. Its weight falls by Beer and Lambert inside. A rough wall tilts the
normal by a Gaussian slope. Light that leaves through JUNCTION faces is lost in the struts.
"""

from __future__ import annotations

import attrs
import numpy as np
import warp as wp

from ..arrays import Array
from .guide import Guide
from .optics import Optics
from .ray_kernel import ABSORBED, DETECTED, FATES, trace_rays


@attrs.frozen
class Light:
    """Shares (0 to 1) of the light sent toward the entry, by where it ended.

    detected: the share that reaches the detector; error: its standard error; shares: by the names in FATES.
    """

    detected: float
    error: float
    shares: dict[str, float]


def lambertian(guide: Guide, rays: int, seed: int = 0) -> tuple[Array, Array]:
    """Starts in mm and unit directions (rays, 3) of light from a diffuse source that touches the whole entry.

    rays: their number; seed: of the random numbers.
    """
    random = np.random.default_rng(seed)
    right, up, inward = guide.entry_frame
    u, v = random.random((2, rays))
    a, b = random.random((2, rays))
    radius, turn = np.sqrt(a), 2 * np.pi * b
    e1, e2 = right / np.linalg.norm(right), up / np.linalg.norm(up)
    directions = (
        (radius * np.cos(turn))[:, None] * e1
        + (radius * np.sin(turn))[:, None] * e2
        + np.sqrt(1 - a)[:, None] * inward
    )
    return guide.entry_corner + u[:, None] * right + v[:, None] * up - 1e-3 * inward, directions


def beam(guide: Guide, rays: int, angle_deg: float = 0.0, seed: int = 0) -> tuple[Array, Array]:
    """Starts in mm and unit directions (rays, 3) of parallel light on the entry.

    angle_deg: tilt in degrees toward the side of the wells; rays: their number; seed: of the starts.
    """
    starts, _ = lambertian(guide, rays, seed)
    _, up, inward = guide.entry_frame
    a = np.radians(angle_deg)
    direction = np.cos(a) * inward + np.sin(a) * up / np.linalg.norm(up)
    return starts, np.tile(direction, (rays, 1))


def trace(guide: Guide, optics: Optics, rays: tuple[Array, Array], seed: int = 0) -> Light:
    """Trace rays through a guide by Monte Carlo until they are detected, lost or absorbed.

    rays: starts in mm and directions, (n, 3) each, from `lambertian` or `beam`. seed: of the random
    numbers, so that equal calls give equal results.
    """
    starts, directions = rays
    n = len(starts)
    mesh = wp.Mesh(
        points=wp.array(guide.vertices.astype(np.float32), dtype=wp.vec3, device="cpu"),
        indices=wp.array(guide.triangles.astype(np.int32).ravel(), dtype=int, device="cpu"),
    )
    fate = wp.zeros(n, dtype=int, device="cpu")
    weight, absorbed = (wp.zeros(n, dtype=float, device="cpu") for _ in range(2))
    wp.launch(
        trace_rays,
        dim=n,
        inputs=[
            mesh.id,
            wp.array(guide.kinds.astype(np.int32), dtype=int, device="cpu"),
            wp.array(starts.astype(np.float32), dtype=wp.vec3, device="cpu"),
            wp.array(directions.astype(np.float32), dtype=wp.vec3, device="cpu"),
            optics.index,
            optics.around,
            optics.attenuation_per_mm,
            optics.roughness,
            seed,
            fate,
            weight,
            absorbed,
        ],
        device="cpu",
    )
    ended, w = fate.numpy(), weight.numpy().astype(float)
    shares = {name: float(w[ended == k].sum() / n) for k, name in enumerate(FATES)}
    shares["absorbed"] = float((absorbed.numpy().sum() + w[ended == ABSORBED].sum()) / n)
    detected = np.where(ended == DETECTED, w, 0.0)
    return Light(float(detected.mean()), float(detected.std() / np.sqrt(n)), shares)
