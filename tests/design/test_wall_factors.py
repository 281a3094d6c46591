"""Walls that differ from chamber to chamber: the text, the cavity, its mesh, print and rules."""

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.body.printed_mesh import Sizes, wall_mesh
from mu_addon.design import load_preset
from mu_addon.design.parameters import from_toml, to_toml
from mu_addon.design.profile import (
    OFFSET_TOLERANCE,
    cavity_polygon,
    cavity_radius,
    cavity_volume,
    inner_arcs,
    membrane_volume,
    outer_radius,
    revolved_volume,
)
from mu_addon.design.wall_factors import WALLS, factor_at
from mu_addon.errors import InputError
from mu_addon.meshing.quality import cavity_enclosed, element_volumes

PLAIN = load_preset("mu-1.0x")


def with_factors(text, **chambers):
    return attrs.evolve(PLAIN, chambers=attrs.evolve(PLAIN.chambers, wall_factors=text, **chambers))


UNEVEN = with_factors("2: 0.6; 5: 1.5")
APICES = 12.5 * (np.arange(6) + 0.5)


@given(st.dictionaries(st.integers(1, 24), st.floats(0.5, 2.0)))
def test_a_text_has_one_form_and_comes_back(factors):
    text = WALLS.canonical(WALLS.text({(k,): f for k, f in factors.items()}))
    assert WALLS.canonical(text) == text
    assert WALLS.parsed(text) == {(k,): f for k, f in sorted(factors.items()) if f != 1.0}


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ("2", "not a chamber and a factor"),
        ("2: thin", "not a chamber and a factor"),
        ("2: nan", "not a chamber and a factor"),
        ("2: 0.8; 2: 0.9", "lists '2' twice"),
        ("2: 2.5", "out of bounds"),
        ("7: 0.8", "no chamber 7"),
        ("0: 0.8", "no chamber 0"),
    ],
)
def test_a_text_that_means_nothing_is_refused(text, what):
    with pytest.raises(InputError, match=what) as refused:
        with_factors(text)
    assert "wall_factors" in str(refused.value)


def test_a_unit_keeps_its_factors_and_one_without_its_file():
    assert from_toml(to_toml(UNEVEN)) == UNEVEN
    assert "wall_factors" not in to_toml(PLAIN)
    assert with_factors("3: 1.0").hash() == PLAIN.hash()


def test_every_apex_has_its_own_wall():
    d = UNEVEN.dimensions
    wall = outer_radius(d, APICES) - cavity_radius(d, APICES)
    np.testing.assert_allclose(wall, 0.9 * np.array([1.0, 0.6, 1.0, 1.0, 1.5, 1.0]), rtol=1e-12)
    # Half way between two apices it is their mean.
    assert d.wall_at(12.5)[0] == pytest.approx(0.9 * 0.8)
    z = np.linspace(-1.0, 76.0, 500)
    values, slopes = factor_at(d.wall_factors, d.cell, z)
    np.testing.assert_allclose(np.gradient(values, z)[1:-1], slopes[1:-1], atol=2e-3)


def test_the_cavity_is_smooth_and_as_exact_as_that_of_an_even_wall():
    d = UNEVEN.dimensions
    arcs = np.array(inner_arcs(d))
    leaving, arriving = arcs[:-1, 3] - arcs[:-1, 2], arcs[1:, 1] - arcs[1:, 0]
    turn = leaving[:, 0] * arriving[:, 1] - leaving[:, 1] * arriving[:, 0]
    assert np.abs(turn).max() < 1e-12
    t = np.linspace(0.0, 1.0, 33)[:, None, None]
    points = (1 - t) ** 3 * arcs[:, 0] + 3 * t * (1 - t) ** 2 * arcs[:, 1]
    points = points + 3 * t**2 * (1 - t) * arcs[:, 2] + t**3 * arcs[:, 3]
    # Radially, where the tolerance is along the normal.
    off = np.abs(points[..., 0] - cavity_radius(d, points[..., 1]))
    assert off.max() < 2.0 * OFFSET_TOLERANCE
    assert cavity_volume(d) == pytest.approx(revolved_volume(cavity_polygon(d, 200)), rel=2e-6)


def test_print_adds_to_every_wall_alike():
    grown = attrs.evolve(UNEVEN, print=attrs.evolve(UNEVEN.print, offset_xy_mm=0.1, offset_z_mm=0.1))
    d, p = grown.dimensions, grown.printed
    np.testing.assert_allclose(p.wall_at(APICES)[0], d.wall_at(APICES)[0] + 0.2, rtol=1e-12)
    assert p.thinnest_wall == pytest.approx(0.54 + 0.2)
    assert p.thickest_wall == pytest.approx(1.35 + 0.2)


def test_a_mesh_has_the_wall_that_is_drawn():
    """As near as that of even walls is held to in `tests/body/test_wall`."""
    mesh = wall_mesh(UNEVEN.printed, Sizes())
    assert 2 * element_volumes(mesh).sum() == pytest.approx(membrane_volume(UNEVEN.dimensions), rel=2e-4)
    assert 2 * cavity_enclosed(mesh) == pytest.approx(cavity_volume(UNEVEN.dimensions), rel=1e-4)


def test_the_thickest_and_the_thinnest_chamber_obey_the_rules():
    with pytest.raises(InputError, match="thickest chamber") as refused:
        with_factors("3: 2.0", wall_mm=2.5)
    fits = float(str(refused.value).split("fits is ")[1].split()[0])
    with_factors("3: 2.0", wall_mm=fits)
    thin = with_factors("3: 0.5", wall_mm=0.3)
    with pytest.raises(InputError, match=r"walls of 0\.15 mm"):
        attrs.evolve(thin, print=attrs.evolve(thin.print, offset_xy_mm=-0.08, offset_z_mm=-0.08))
