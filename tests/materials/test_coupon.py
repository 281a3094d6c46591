"""What laws answer to a tensile machine, against closed forms and limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon.errors import ConvergenceError, InputError
from mu_addon.fem.law_at_points import evaluate
from mu_addon.fem.laws import Foam, MooneyRivlin, NeoHooke, Ogden, Prony, Yeoh
from mu_addon.materials.coupon import (
    MODES,
    Coupon,
    equivalent_stretch,
    incompressible,
    isochoric_stretches,
    response,
    stretch_of_equivalent,
)
from tests.fem.cubic import Cubic

STRETCH = np.array([0.4, 0.7, 0.95, 1.0, 1.3, 2.0, 4.5])


def invariants(mode, a):
    """I1, I2 and their derivatives by the stretch of axis 1, halved where two axes are pulled, by hand."""
    if mode == "uniaxial":
        return a**2 + 2 / a, 2 * a + a**-2, 2 * (a - a**-2), 2 * (1 - a**-3)
    if mode == "equibiaxial":
        return 2 * a**2 + a**-4, a**4 + 2 * a**-2, 2 * (a - a**-5), 2 * (a**3 - a**-3)
    return a**2 + 1 + a**-2, a**2 + 1 + a**-2, 2 * (a - a**-3), 2 * (a - a**-3)


def closed_form(law, row, mode, a):
    I1, _, dI1, dI2 = invariants(mode, a)
    if law is NeoHooke:
        return row[0] / 2 * dI1
    if law is MooneyRivlin:
        return row[0] * dI1 + row[1] * dI2
    if law is Yeoh:
        x = I1 - 3
        return (row[0] + 2 * row[1] * x + 3 * row[2] * x**2) * dI1
    other = {"uniaxial": a**-0.5, "equibiaxial": a**-2.0, "pure_shear": a**-1.0}[mode]
    return sum(row[2 * p] * (a ** row[2 * p + 1] - other ** row[2 * p + 1]) / a for p in range(3))


ROWS = {
    NeoHooke: np.array([0.9, 1.0]),
    MooneyRivlin: np.array([0.3, 0.1, 1.0]),
    Yeoh: np.array([0.5, -0.02, 0.003, 1.0]),
    Ogden: np.array([0.63, 1.3, 0.0012, 5.0, -0.01, -2.0, 1.0]),
}


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("law", ROWS, ids=lambda law: law.name)
def test_stress_at_constant_volume_is_the_closed_form(law, mode):
    found = incompressible(law, ROWS[law], mode, STRETCH)
    wanted = closed_form(law, ROWS[law], mode, STRETCH)
    assert found == pytest.approx(wanted, rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("law", ROWS, ids=lambda law: law.name)
def test_a_stiff_bulk_modulus_comes_to_constant_volume_in_proportion(law, mode):
    stretch = np.array([0.8, 1.5, 2.5])
    limit = incompressible(law, ROWS[law], mode, stretch)
    off = []
    for kappa in (1e3, 1e4):
        row = np.append(ROWS[law][:-1], kappa)
        found = response(law, row, mode, stretch)
        off.append(found.stress_MPa / limit - 1)
        assert np.prod(found.stretches, axis=1) == pytest.approx(1, abs=20 / kappa)
    assert off[0] / off[1] == pytest.approx(10, rel=0.05)


@pytest.mark.parametrize("mode", MODES)
def test_a_small_stretch_is_hookes(mode):
    E, nu, e = 2.7, 0.3, 1e-7
    row = NeoHooke.parameters(E, nu)[0]
    found = response(NeoHooke, row, mode, [1 + e])
    modulus = {"uniaxial": E, "equibiaxial": E / (1 - nu), "pure_shear": E / (1 - nu**2)}[mode]
    lateral = {"uniaxial": -nu, "equibiaxial": -2 * nu / (1 - nu), "pure_shear": -nu / (1 - nu)}[mode]
    assert found.stress_MPa[0] / e == pytest.approx(modulus, rel=1e-5)
    assert (found.stretches[0, 2] - 1) / e == pytest.approx(lateral, rel=1e-5)


@given(
    st.floats(0.01, 10),
    st.floats(0.0, 0.45),
    st.floats(-4, 8).filter(lambda a: abs(a) > 0.3),
    st.lists(st.floats(0.5, 2.0), min_size=1, max_size=5),
)
def test_hyperfoam_has_the_closed_form_of_its_one_term(mu, nu, alpha, stretch):
    # Storakers (1986): lateral stretch a^-nu, so J = a^(1 - 2 nu);
    # stress 2 mu/alpha (a^alpha - J^(-alpha beta))/a.
    a = np.array(stretch)
    row = Foam.parameters(2 * mu * (1 + nu), nu, alpha, alpha)[0]
    found = response(Foam, row, "uniaxial", a)
    beta = nu / (1 - 2 * nu)
    assert found.stretches[:, 1:] == pytest.approx(np.repeat(a[:, None] ** -nu, 2, axis=1), rel=1e-8)
    wanted = 2 * mu / alpha * (a**alpha - a ** (-alpha * beta * (1 - 2 * nu))) / a
    assert found.stress_MPa == pytest.approx(wanted, rel=1e-7, abs=1e-9 * mu)


@pytest.mark.parametrize("mode", MODES)
def test_stress_is_the_slope_of_the_energy_along_the_path(mode):
    row = Foam.parameters(0.02, 0.2, 1.5, 9.0)[0]
    h = 1e-5
    energy = []
    for stretch in (1.2 - h, 1.2 + h):
        lengths = response(Foam, row, mode, [stretch]).stretches
        energy.append(evaluate(Foam, np.diag(lengths[0])[None], row).energy[0])
    axes = 2 if mode == "equibiaxial" else 1
    slope = (energy[1] - energy[0]) / (2 * h) / axes
    assert response(Foam, row, mode, [1.2]).stress_MPa[0] == pytest.approx(slope, rel=1e-8)


def test_a_cubic_law_on_its_axes_has_the_modulus_of_its_axis_and_oblique_is_refused():
    row = Cubic.parameters(0.5, 0.2, 0.4)[0]
    e = 1e-7
    assert response(Cubic, row, "uniaxial", [1 + e]).stress_MPa[0] / e == pytest.approx(0.5, rel=1e-5)
    oblique = Cubic.parameters(0.5, 0.2, 0.4, (1, 0.5, 0.2), (0, 1, 1))[0]
    with pytest.raises(InputError, match="makes a shear stress"):
        response(Cubic, oblique, "uniaxial", [1.1])


@pytest.mark.parametrize("mode", MODES)
def test_equivalent_stretches(mode):
    a = np.array([1.0, 1.7, 3.0])
    e = np.log(isochoric_stretches(mode, a))
    wanted = np.exp(np.sqrt(2 / 3 * (e**2).sum(axis=1)))
    assert equivalent_stretch(mode, a) == pytest.approx(wanted)
    assert stretch_of_equivalent(mode, wanted) == pytest.approx(a)


def test_what_has_no_answer_is_refused():
    with pytest.raises(InputError, match="unknown mode 'planar'"):
        incompressible(NeoHooke, ROWS[NeoHooke], "planar", [1.1])
    with pytest.raises(InputError, match="not positive"):
        response(NeoHooke, ROWS[NeoHooke], "uniaxial", [1.1, 0.0])
    with pytest.raises(InputError, match="does not split"):
        incompressible(Foam, Foam.parameters(1, 0.3, 2, 2)[0], "uniaxial", [1.1])
    with pytest.raises(InputError, match="history"):
        response(Prony, np.ones(len(Prony.parameter_names)), "uniaxial", [1.1])
    with pytest.raises(ConvergenceError, match="no lateral stretch"):
        # Green strain and a linear law: squeezed this far, no lateral stretch bears the bulk.
        response(Cubic, Cubic.parameters(1.0, 0.45, 0.3)[0], "equibiaxial", [2.0])
    with pytest.raises(InputError, match="2 stretches and 1 stresses"):
        Coupon("a", "uniaxial", [1, 2], [0])
