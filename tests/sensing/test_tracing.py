"""Light against closed forms: slabs, critical angles, absorption, and bends."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from mu_addon.errors import InputError
from mu_addon.sensing.guide import Centreline, Guide, arc, swept
from mu_addon.sensing.optics import Optics
from mu_addon.sensing.tracing import beam, lambertian, trace


def solid(guide: Guide) -> trimesh.Trimesh:
    return trimesh.Trimesh(guide.vertices, guide.triangles, process=False)


def test_the_surface_is_closed_and_has_the_bars_volume() -> None:
    straight = swept(arc(20, 0), 1.5, 1.2, wells=[5, 10, 15], junctions=[(2, 3)])
    assert solid(straight).is_watertight
    assert solid(straight).volume == pytest.approx(20 * 1.5 * 1.2 - 3 * 1.0 * 0.65 * 1.5, rel=1e-6)
    bent = solid(swept(arc(20, 60), 1.5, 1.2))
    # Pappus: the section's centroid travels the centreline's length.
    assert bent.is_watertight
    assert bent.volume == pytest.approx(20 * 1.5 * 1.2, rel=1e-3)


def test_wells_open_as_their_side_is_stretched() -> None:
    def width(angle: float) -> float:
        line = arc(20, angle)
        guide = swept(line, 1.5, 1.5, wells=[10], edge=0.05)
        radius = 20 / np.radians(angle)
        y, z = guide.vertices[:, 1] + radius, guide.vertices[:, 2]
        outer = np.abs(np.hypot(y, z) - radius - 0.75) < 1e-3
        away = np.abs(np.arctan2(z, y)[outer] - np.radians(angle) / 2)
        return float(2 * away.min() * (radius + 0.75))

    assert width(60) == pytest.approx(1 + 0.75 * np.radians(60) / 20, rel=2e-3)


def test_curvature_and_stretch_of_an_arc() -> None:
    line = arc(20, 45)
    np.testing.assert_allclose(line.curvature[3:-3], np.radians(45) / 20, rtol=1e-3)
    np.testing.assert_allclose(line.stretch, 1, rtol=1e-4)
    longer = Centreline(line.s, 1.1 * line.points, line.normals)
    np.testing.assert_allclose(longer.stretch, 1.1, rtol=1e-4)


def test_a_straight_beam_fades_by_beer_lambert_and_fresnel() -> None:
    """Two faces of reflectance R and a medium of one-way transmittance t pass (1 - R)^2 t / (1 - R^2 t^2)."""
    optics = Optics(index=1.5, attenuation_per_mm=0.05, roughness=0.0)
    guide = swept(arc(20, 0), 1.5, 1.5)
    found = trace(guide, optics, beam(guide, 10_000))
    R, t = 0.04, np.exp(-0.05 * 20)
    assert found.detected == pytest.approx((1 - R) ** 2 * t / (1 - R**2 * t**2), abs=4 * found.error)
    assert sum(found.shares.values()) == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("around", [1.0, 1.3])
def test_the_numerical_aperture(around: float) -> None:
    """Light inside at theta to the axis is guided while cos(theta) > n_around / n, and else soon leaves."""
    optics = Optics(index=1.5, attenuation_per_mm=0.0, roughness=0.0, around=around)
    guide = swept(arc(60, 0), 1.5, 1.5)
    critical = np.degrees(np.arccos(around / 1.5))
    largest = 1.5 / around * np.sin(np.radians(critical))
    if largest > 1:
        # In air every ray that enters by the flat end is guided, up to grazing light; both ends reflect.
        r = _reflected_at_entry(80, 1.5)
        returned = trace(guide, optics, beam(guide, 4000, 80)).shares["returned"]
        assert returned == pytest.approx(2 * r / (1 + r), abs=0.03)
        return
    limit = np.degrees(np.arcsin(largest))
    below = trace(guide, optics, beam(guide, 4000, limit - 2))
    above = trace(guide, optics, beam(guide, 4000, limit + 2))
    assert below.detected > 0.97 * (1 - below.shares["returned"]) * 0.97
    assert above.detected < 0.1 * below.detected


def _reflected_at_entry(angle_deg: float, index: float) -> float:
    a = np.radians(angle_deg)
    b = np.arcsin(np.sin(a) / index)
    s = (np.sin(a - b) / np.sin(a + b)) ** 2
    p = (np.tan(a - b) / np.tan(a + b)) ** 2
    return float((s + p) / 2)


@pytest.mark.parametrize("radius", [6.0, 9.0, 14.0, 40.0])
def test_what_a_bend_lets_out(radius: float) -> None:
    """An axial beam in an arc: a ray at distance r from its centre meets the outer wall at sin r / R_out."""
    n, around, h = 1.5, 1.35, 1.5
    optics = Optics(index=n, attenuation_per_mm=0.0, roughness=0.0, around=around)
    # Long enough that each ray has met the wall; only the first meeting counts for light that is let out.
    length = np.radians(120) * radius
    guide = swept(arc(length, 120, steps=2400), h, h, edge=length / 2400)
    found = trace(guide, optics, beam(guide, 6000))
    outer, inner = radius + h / 2, radius - h / 2
    kept = (outer - max(inner, outer * around / n)) / h
    entered = 1 - ((n - around) / (n + around)) ** 2
    assert found.detected / entered**2 == pytest.approx(min(1.0, max(0.0, kept)), abs=0.03)


def test_errors_fall_with_the_root_of_the_rays() -> None:
    guide = swept(arc(30, 40), 1.5, 1.5, wells=[8, 15, 22])
    few, many = (trace(guide, Optics(), lambertian(guide, n)) for n in (2000, 18_000))
    assert few.error / many.error == pytest.approx(3, rel=0.15)
    assert few.detected == pytest.approx(many.detected, abs=4 * few.error)


def test_wells_junctions_and_roughness_cost_light() -> None:
    plain = swept(arc(30, 0), 1.5, 1.5)
    worse = [
        (swept(arc(30, 0), 1.5, 1.5, wells=[8, 15, 22]), Optics()),
        (swept(arc(30, 0), 1.5, 1.5, junctions=[(12, 14)]), Optics()),
        (plain, Optics(roughness=0.1)),
        (plain, Optics(attenuation_per_mm=0.05)),
    ]
    best = trace(plain, Optics(roughness=0.0), lambertian(plain, 6000))
    for guide, optics in worse:
        found = trace(guide, optics, lambertian(guide, 6000))
        assert found.detected < best.detected - 3 * (found.error + best.error)


def test_bad_input_is_named() -> None:
    with pytest.raises(InputError, match="wells overlap"):
        swept(arc(20, 0), 1.5, 1.5, wells=[5, 5.5])
    with pytest.raises(InputError, match="wells overlap"):
        swept(arc(20, 0), 1.5, 1.5, wells=[0.2])
    with pytest.raises(InputError, match="not physical"):
        Optics(index=0.5)
