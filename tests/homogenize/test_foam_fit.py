"""Fitting the lattice's law: curves of known laws, struts of constant length, laws that are not stable."""

import attrs
import numpy as np
import pytest
from scipy.optimize import brentq

from mu_addon.errors import InputError
from mu_addon.fem.law_at_points import evaluate
from mu_addon.fem.laws import Foam
from mu_addon.homogenize.foam_fit import (
    fit_foam,
    lattice_law,
    require_stable,
    stable_pressed,
    stable_shear,
)
from mu_addon.homogenize.foam_response import directions, ellipticity, small_strain, uniaxial
from mu_addon.homogenize.stress_strain_curve import Curve
from tests.fem.cubic import Cubic

STRETCH = np.linspace(0.6, 1.4, 17)
FOAMS = {
    "one modulus": np.array([0.006, 4.0, 0.006, 10.0, 0.02, 2.0]),
    "two moduli": np.array([0.006, 8.0, 0.003, -3.0, 0.002, -5.0]),
}


def curve_of(parameters, diagonal=0.0, stretch=STRETCH):
    stress, lateral = uniaxial(parameters, stretch, diagonal)
    return Curve(stretch, stress, np.column_stack([lateral, lateral]))


def struts(E=2.0, diameter=1.8, size=12.5):
    """A body-centred cell's curve, and C11, C12, C44 in MPa, by the struts' linear bending and stretch.

    Nodes keep their direction by symmetry, so that each strut bends into an S, which shortens its chord by
    3/5 of the square of its ends' transverse offset over its length; stretch along z, equal sides.
    """
    length, area, moment = 3**0.5 / 2 * size, np.pi * diameter**2 / 4, np.pi * diameter**4 / 64
    axial, bend = 8 * E * area * length / size**3, 12 * 8 * E * moment / length / size**3

    def energy(a, b):
        along = (a + 2 * b) / 3
        across = (a * a + 2 * b * b) / 3 - along**2
        return axial / 2 * (along - 1 + 0.6 * across) ** 2 + bend / 2 * across

    def by(a, b, da, db, h=1e-6):
        return (energy(a + h * da, b + h * db) - energy(a - h * da, b - h * db)) / (2 * h)

    lateral = np.array([brentq(lambda b, a=a: by(a, b, 0, 1), 0.5, 1.5) for a in STRETCH])
    stress = np.array([by(a, b, 1, 0) for a, b in zip(STRETCH, lateral, strict=True)])
    # Small strain of four springs along the diagonals, and of bending across them.
    C, B = axial / 9, bend / 9
    moduli = C + 2 * B, C - B, C + B / 2
    return Curve(STRETCH, stress, np.column_stack([lateral, lateral])), moduli


@pytest.mark.parametrize("diagonal", [0.0, 0.05])
@pytest.mark.parametrize("name", FOAMS)
def test_uniaxial_response_is_that_of_the_laws_on_the_mesh(name, diagonal):
    stress, lateral = uniaxial(FOAMS[name], STRETCH, diagonal)
    F = np.stack([STRETCH, lateral, lateral], axis=1)[:, :, None] * np.eye(3)
    law = lattice_law(FOAMS[name], 0.03, diagonal, (0.6, 1.4))
    P = sum(evaluate(one, F, row).stress for one, row in law.layers)
    np.testing.assert_allclose(P[:, 0, 0], stress, atol=1e-12)
    off = P - np.einsum("n,ij->nij", stress, np.diag([1, 0, 0]))
    assert np.abs(off).max() < 1e-12


def test_small_strain_moduli_are_those_of_the_tangent_at_rest():
    row, shear, diagonal = FOAMS["one modulus"], 0.03, 0.05
    law = lattice_law(row, shear, diagonal, (0.6, 1.4))
    C = sum(evaluate(one, np.eye(3), p).tangent[0] for one, p in law.layers).reshape(3, 3, 3, 3)
    C11, C12, C44 = C[0, 0, 0, 0], C[0, 0, 1, 1], C[0, 1, 0, 1]
    expected = (C11 - C12) * (C11 + 2 * C12) / (C11 + C12), C12 / (C11 + C12), C44
    assert small_strain(row, shear, diagonal) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", FOAMS)
def test_the_curve_of_a_foam_gives_its_parameters_back(name):
    row = FOAMS[name]
    # A cell of quite another C12: nothing of it may enter where the foam's own volume does better.
    fit = fit_foam(curve_of(row), 0.04 + 2 * row[0], 0.04, 0.03)
    np.testing.assert_allclose(fit.parameters, row, rtol=1e-6)
    assert fit.diagonal_MPa == 0
    assert fit.shear_MPa == pytest.approx(0.03 - (row[0] + row[2]) / 2, rel=1e-6)
    assert fit.C44_MPa == pytest.approx(0.03)
    assert (fit.parameters[0] == fit.parameters[2]) == (name == "one modulus")
    assert max(attrs.astuple(fit.misfit)) < 1e-7


def test_the_curve_of_diagonal_stretch_gives_its_parameters_back():
    row = np.array([0.006, 5.0, 0.006, 3.0, 0.0, 1.0])
    fit = fit_foam(curve_of(row, 0.07), 0.082, 0.07, 0.05)
    np.testing.assert_allclose(fit.parameters, row, rtol=1e-6)
    assert fit.diagonal_MPa == 0.07
    assert max(attrs.astuple(fit.misfit)) < 1e-7
    assert (fit.E_MPa, fit.poisson) == pytest.approx((fit.cell_E_MPa, fit.cell_poisson))


@pytest.mark.nightly("test_the_curve_of_diagonal_stretch_gives_its_parameters_back")
def test_slender_struts_are_followed_and_a_foam_alone_cannot_follow_their_sides():
    """The squares of the stretches of an inextensible lattice add up to 3, so that tension shrinks it too."""
    curve, (C11, C12, C44) = struts()
    kept = curve.stretch**2 + 2 * curve.lateral[:, 0] ** 2
    assert np.abs(kept - 3).max() < 0.07
    fit = fit_foam(curve, C11, C12, C44)
    assert fit.parameters[0] == fit.parameters[2]
    assert fit.diagonal_MPa == C12
    assert fit.misfit.tension < 0.02
    assert fit.misfit.compression < 0.01
    assert fit.misfit.lateral < 0.05
    assert fit.E_MPa == pytest.approx(fit.cell_E_MPa, rel=0.05)
    assert fit.poisson == pytest.approx(fit.cell_poisson, abs=0.01)
    assert fit.C44_MPa == pytest.approx(C44)
    # A foam's volume grows under tension, whatever its parameters; this body's does not.
    pulled = curve.stretch > 1
    for row in FOAMS.values():
        _, lateral = uniaxial(row, curve.stretch)
        assert (curve.stretch * lateral**2)[pulled].min() > 1
    assert (curve.stretch * curve.lateral[:, 0] ** 2)[pulled].max() < 1


def test_a_foam_stiffer_in_shear_than_the_cell_keeps_its_own():
    fit = fit_foam(curve_of(FOAMS["one modulus"]), 0.032, 0.02, 0.002)
    assert fit.shear_MPa == 0
    assert len(fit.law.layers) == 1
    assert (fit.C44_MPa, fit.cell_C44_MPa) == pytest.approx((0.006, 0.002))


def test_curves_that_determine_nothing_are_named():
    row = FOAMS["one modulus"]
    with pytest.raises(InputError, match="0 points under tension"):
        fit_foam(curve_of(row, stretch=np.linspace(0.6, 1.0, 9)), 0.03, 0.02, 0.03)


def test_unstable_laws_are_named():
    """A foam of exponent -6 in tension has its largest force where a^-6 (6 + 1) = 1 and lambda = 0."""
    falling = np.array([0.006, -6.0, 0.006, 4.0, 0.0, 1.0])
    top = 7 ** (1 / 6)
    with pytest.raises(InputError, match=r"its force falls from stretch 1\.3[89]"):
        require_stable(lattice_law(falling, 0.0, 0.0, (0.6, 1.4)))
    require_stable(lattice_law(falling, 0.0, 0.0, (0.6, top - 0.01)))
    # Struts forty times as stiff as what keeps them from buckling sideways under the pull of their sides.
    soft = np.array([1e-4, 4.0, 1e-4, 10.0, 0.0, 1.0])
    with pytest.raises(InputError, match="loses ellipticity"):
        require_stable(lattice_law(soft, 0.1, 0.1, (0.6, 1.4)))


def test_ellipticity_at_rest_is_the_least_of_the_elastic_constants():
    """Plane waves in a cubic body are slowest, here, along [110] polarised along [1-10]: (C11 - C12)/2."""
    mu, shear, diagonal = 0.006, 0.05, 0.04
    law = lattice_law(np.array([mu, 4.0, mu, 10.0, 0.0, 1.0]), shear, diagonal, (0.6, 1.4))
    assert ellipticity(law, np.eye(3)[None])[0] == pytest.approx(mu, rel=1e-9)
    cubic = Cubic.parameters(3.0, 0.25, 0.4)[0]
    A = evaluate(Cubic, np.eye(3), cubic).tangent.reshape(3, 3, 3, 3)
    acoustic = np.einsum("ijkl,dj,dl->dik", A, directions(), directions())
    assert np.linalg.eigvalsh(acoustic).min() == pytest.approx(min(0.4, (cubic[0] - cubic[1]) / 2))


@pytest.mark.parametrize("ratio", [0.02, 0.05, 0.1])
def test_struts_lose_stability_in_shear_and_under_pressure_at_about_the_foams_share(ratio):
    """To first order where the compression by shear, G s, and by pressure, 3 C e, is the foam's mu."""
    mu, stiff = 0.005, 0.005 / ratio
    law = lattice_law(np.array([mu, 2.0, mu, 2.0, 0.0, 1.0]), stiff, stiff, (0.6, 1.4))
    assert stable_shear(law) == pytest.approx(ratio, rel=0.35, abs=0.006)
    assert stable_pressed(law) == pytest.approx(ratio / 3, rel=0.35, abs=0.006)
    assert stable_shear(lattice_law(Foam.parameters(0.018, 0.3, 4.0, 6.0)[0], 0.0, 0.0, (0.6, 1.4))) == 0.6
