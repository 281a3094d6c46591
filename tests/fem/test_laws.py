"""Every law against its own derivatives, closed forms, linear elasticity and change of frame."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import InputError
from mu_addon.fem import laws
from mu_addon.fem.laws import (
    CubicShear,
    DiagonalStretch,
    Foam,
    Friction,
    Layered,
    MooneyRivlin,
    NeoHooke,
    Ogden,
    OgdenRoxburgh,
    Prony,
    Yeoh,
)
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model

from . import bodies
from .cubic import Cubic
from .derivatives import assert_derivatives
from .guccione import Guccione
from .points import difference, evaluate

FIBRE = [1.0, 2.0, -1.0]
ROWS = {law: np.array(law.example) for law in laws.LAWS.values()} | {
    Guccione: Guccione.parameters(2.0, 8.0, 2.0, 4.0, 100.0, FIBRE)[0],
    Cubic: Cubic.parameters(3.0, 0.25, 0.4, FIBRE, [0, 1, 1])[0],
}
ISOTROPIC = [law for law in ROWS if law.isotropic]
ANISOTROPIC = [law for law in ROWS if not law.isotropic]
LAWS = pytest.mark.parametrize("law", ROWS, ids=lambda law: law.__name__)
rotations = st.integers(0, 2**32 - 1).map(
    lambda seed: np.linalg.qr(np.random.default_rng(seed).standard_normal((3, 3)))[0]
)


def row_of(law, remembered=True):
    """Parameters of a law; with history, some of it too, and a step of 0.7 s."""
    if not law.history:
        return ROWS[law]
    history = np.zeros(law.history)
    if remembered and law is OgdenRoxburgh:
        history[:] = 0.08
    elif remembered:
        tensors = 0.05 * np.random.default_rng(5).standard_normal((law.history // 6, 6))
        tensors[:, :3] -= tensors[:, :3].mean(axis=1, keepdims=True)
        history[:] = tensors.ravel()
    return np.concatenate([ROWS[law], history, [0.7]])


def gradients(seed=0, size=0.15, count=30):
    F = np.eye(3) + size * np.random.default_rng(seed).standard_normal((count, 3, 3))
    return F[np.linalg.det(F) > 0.5]


@LAWS
def test_stress_and_tangent_are_derivatives(law):
    F, row = gradients(), row_of(law)
    law.valid(ROWS[law][None])
    _, P, A = evaluate(law, F, row)
    by_energy = difference(lambda X: evaluate(law, X, row)[0], F, 2e-4).reshape(-1, 3, 3)
    by_stress = difference(lambda X: evaluate(law, X, row)[1].reshape(-1, 9), F, 2e-4)
    assert np.abs(by_energy - P).max() < 1e-9 * np.abs(P).max()
    # Some tangents jump where sliding or softening sets in; no point of these lies within a step of that.
    assert np.abs(by_stress - A).max() < 1e-9 * np.abs(A).max()
    np.testing.assert_allclose(A, A.transpose(0, 2, 1), atol=1e-14 * np.abs(A).max())


@LAWS
def test_no_law_takes_what_is_no_number_or_below_zero_throughout(law):
    for bad in (np.full(len(ROWS[law]), np.nan), -np.abs(ROWS[law])):
        with pytest.raises(InputError, match="must be"):
            law.valid(bad[None])


@LAWS
@settings(max_examples=20)
@given(Q=rotations, seed=st.integers(0, 2**32 - 1))
def test_a_turned_body_has_the_same_energy_and_its_stress_turns(law, Q, seed):
    Q = Q * np.linalg.det(Q)
    F, row = gradients(seed, 0.1, 2), row_of(law)
    W, P, _ = evaluate(law, F, row)
    W_turned, P_turned, _ = evaluate(law, Q @ F, row)
    np.testing.assert_allclose(W_turned, W, rtol=1e-10, atol=1e-14)
    np.testing.assert_allclose(P_turned, Q @ P, atol=1e-11 * max(1, np.abs(P).max()))
    W_rigid, P_rigid, _ = evaluate(law, Q, row_of(law, remembered=False))
    assert abs(W_rigid[0]) < 1e-14 * np.abs(row).max()
    assert np.abs(P_rigid).max() < 1e-13 * np.abs(row).max()


@pytest.mark.parametrize("law", ISOTROPIC, ids=lambda law: law.__name__)
def test_a_body_turned_before_loading_makes_no_difference_where_the_law_is_isotropic(law):
    Q = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    F, row = gradients(), row_of(law, remembered=False)
    np.testing.assert_allclose(evaluate(law, F @ Q.T, row)[1], evaluate(law, F, row)[1] @ Q.T, atol=1e-11)


def test_layers_resist_stretch_of_any_size_either_way():
    """A stretch l along the normal costs across (l^2 + 1/l^2 - 2)/8, one in the plane in_plane times that."""
    n = np.array(FIBRE) / np.linalg.norm(FIBRE)
    along = np.cross(n, [0, 0, 1]) / np.linalg.norm(np.cross(n, [0, 0, 1]))
    for direction, k in ((n, 0.2), (along, 0.7)):
        for stretch in (0.3, 0.99, 1.01, 2.5):
            F = np.eye(3) + (stretch - 1) * np.outer(direction, direction)
            W, P, _ = evaluate(Layered, F[None], ROWS[Layered])
            assert W[0] == pytest.approx(k * (stretch**2 + stretch**-2 - 2) / 8, rel=1e-9)
            assert P[0] @ direction @ direction == pytest.approx(k * (stretch - stretch**-3) / 4, rel=1e-9)
    # Layers that are as stiff across as along are isotropic.
    row = Layered.parameters(0.5, 0.5, FIBRE)[0]
    Q = np.linalg.qr(np.random.default_rng(1).standard_normal((3, 3)))[0]
    F = gradients()
    turned = evaluate(Layered, F @ Q.T, row)[1]
    np.testing.assert_allclose(turned, evaluate(Layered, F, row)[1] @ Q.T, atol=1e-11)


def isotropic_stiffness(mu, kappa):
    one = np.eye(3)
    identity = (np.einsum("ik,jl->ijkl", one, one) + np.einsum("il,jk->ijkl", one, one)) / 2
    volume = np.einsum("ij,kl->ijkl", one, one)
    return (2 * mu * (identity - volume / 3) + kappa * volume).reshape(9, 9)


@pytest.mark.parametrize("law", ISOTROPIC, ids=lambda law: law.__name__)
def test_small_strain_is_linear_elasticity_of_the_stated_moduli(law):
    row = row_of(law, remembered=False).copy()
    if law.history:
        row[-1] = 1e9
    if law is Foam:
        row[2] = row[0]
    mu, kappa = law.small_strain(row[None, : len(law.parameter_names)])[0]
    tangent = evaluate(law, np.eye(3), row)[2][0]
    np.testing.assert_allclose(tangent, isotropic_stiffness(mu, kappa), atol=1e-8 * kappa + 1e-14)


def test_youngs_modulus_and_poissons_ratio_are_as_asked():
    for law, row in ((NeoHooke, NeoHooke.parameters(0.6, 0.4)), (Foam, Foam.parameters(0.6, 0.2, 4.0, 9.0))):
        mu, kappa = law.small_strain(row)[0]
        E, nu = 9 * kappa * mu / (3 * kappa + mu), (3 * kappa - 2 * mu) / (6 * kappa + 2 * mu)
        assert (E, nu) == pytest.approx((0.6, 0.4 if law is NeoHooke else 0.2))


def compliance_in_frame(law, row, frame):
    """6 x 6 compliance, tensor components, in a frame whose axes are the columns."""
    C = evaluate(law, np.eye(3), row)[2][0].reshape(3, 3, 3, 3)
    C = np.einsum("ijkl,ia,jb,kc,ld->abcd", C, *[frame] * 4)
    pairs = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
    factor = np.array([1, 1, 1, 2, 2, 2]) ** 0.5
    mandel = np.array([[C[(*a, *b)] for b in pairs] for a in pairs]) * np.outer(factor, factor)
    return np.linalg.inv(mandel)


def test_cubic_symmetry_has_the_engineering_constants_asked_for():
    row = ROWS[Cubic]
    S = compliance_in_frame(Cubic, row, np.stack([row[3:6], row[6:9], np.cross(row[3:6], row[6:9])], axis=1))
    assert 1 / np.diag(S)[:3] == pytest.approx([3.0] * 3)
    assert -S[1, 0] / S[0, 0] == pytest.approx(0.25)
    assert 1 / (2 * np.diag(S)[3:]) == pytest.approx([0.4] * 3)


@pytest.mark.parametrize("law", ANISOTROPIC, ids=lambda law: law.__name__)
def test_stated_moduli_are_the_average_over_directions(law):
    row = ROWS[law]
    C = evaluate(law, np.eye(3), row)[2][0].reshape(3, 3, 3, 3)
    whole, pressure = np.einsum("ijij", C), np.einsum("iijj", C)
    # C from F has minor symmetry at rest, so its traces are those of the stiffness.
    np.testing.assert_allclose(law.small_strain(row[None])[0], [(3 * whole - pressure) / 30, pressure / 9])


@pytest.mark.parametrize("gap", [0.0, 1e-14, 1e-9, 1e-6, 1e-4, 1.01e-3, 0.1])
@pytest.mark.parametrize("third", [1.0, 0.8], ids=["three", "two"])
def test_ogden_with_equal_stretches_is_mooney_rivlin_to_rounding(gap, third):
    """With exponents 2 and -2 they are one law, whose tangent knows nothing of principal directions."""
    c1, c2, kappa = ROWS[MooneyRivlin]
    Q = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    F = Q @ np.diag([1.2, 1.2 * (1 + gap), 1.2 * third * (1 + 2 * gap)]) @ Q.T
    ogden = evaluate(Ogden, F, [2 * c1, 2.0, -2 * c2, -2.0, 0.0, 1.0, kappa])
    for found, expected in zip(ogden, evaluate(MooneyRivlin, F, ROWS[MooneyRivlin]), strict=True):
        np.testing.assert_allclose(found, expected, atol=2e-12)


@pytest.mark.parametrize("law", [Ogden, Foam], ids=lambda law: law.__name__)
def test_the_tangent_stays_a_derivative_where_stretches_are_equal(law):
    row = ROWS[law].copy()
    Q = np.linalg.qr(np.random.default_rng(4).standard_normal((3, 3)))[0]
    F = np.stack([Q @ np.diag(d) @ Q.T for d in ([1.3, 1.3, 0.9], [1.3, 1.3, 1.3], [0.8, 0.8 + 1e-7, 0.8])])
    A = evaluate(law, F, row)[2]
    found = difference(lambda X: evaluate(law, X, row)[1].reshape(-1, 9), F, 2e-4)
    assert np.abs(found - A).max() < 1e-9 * np.abs(A).max()


def test_foam_without_lateral_strain_follows_its_closed_form_on_either_side():
    """P = 2 mu/alpha (s^(alpha - 1) - 1/s), with the modulus and exponent of the side of 1 that s is on."""
    row = ROWS[Foam].copy()
    row[4] = 0.0
    for stretch in (0.4, 0.7, 0.999, 1.001, 1.5):
        mu, alpha = row[:2] if stretch > 1 else row[2:4]
        P = evaluate(Foam, np.diag([stretch, 1.0, 1.0]), row)[1][0]
        expected = 2 * mu / alpha * (stretch ** (alpha - 1) - 1 / stretch)
        np.testing.assert_allclose(P, np.diag([expected, 0, 0]), atol=1e-12)


def test_cubic_shear_resists_shear_between_axes_and_no_stretch_along_them():
    """Simple shear by s: W = G s^2/2, P_xy = G s; with a stretch a of x they are a^2 times that."""
    (G,), s, a = ROWS[CubicShear], 0.3, 0.8
    W, P, A = evaluate(CubicShear, np.diag([0.6, 1.3, 0.9]), ROWS[CubicShear])
    assert W[0] == 0
    assert not P.any()
    A = A[0].reshape(3, 3, 3, 3)
    stretched = [A[i, i, j, j] for i in range(3) for j in range(3)]
    assert not np.any(stretched)
    F = np.array([[a, s, 0], [0, 1, 0], [0, 0, 1.0]])
    W, P, _ = evaluate(CubicShear, F, ROWS[CubicShear])
    assert W[0] == pytest.approx(G * (a * s) ** 2 / 2)
    # P = F S with S_xy = 2 G E_xy = G a s.
    np.testing.assert_allclose(P[0], G * a * s * np.array([[s, a, 0], [1, 0, 0], [0, 0, 0]]), atol=1e-15)


@pytest.mark.parametrize("law", [Cubic, CubicShear], ids=lambda law: law.__name__)
def test_a_quarter_turn_of_the_body_about_an_axis_changes_nothing_and_another_turn_does(law):
    row = ROWS[law]
    if law is Cubic:
        row = Cubic.parameters(3.0, 0.25, 0.4)[0]
    F = gradients(3)
    W, P, _ = evaluate(law, F, row)
    for a, b in ((0, 1), (1, 2), (2, 0)):
        Q = np.eye(3)
        Q[[a, b]] = Q[[b, a]] * [[-1], [1]]
        turned = evaluate(law, F @ Q.T, row)
        np.testing.assert_allclose(turned[0], W, atol=1e-15)
        np.testing.assert_allclose(turned[1], P @ Q.T, atol=1e-14)
    c, s = np.cos(np.pi / 4), np.sin(np.pi / 4)
    Q = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    assert np.abs(evaluate(law, F @ Q.T, row)[0] - W).max() > 0.01 * np.abs(W).max()


def test_diagonal_stretch_and_cubic_shear_are_springs_along_the_diagonals():
    """W = 9 C/8 times the sum of squared Green strains along the four diagonals of a cube."""
    F = gradients(2)
    E = (np.einsum("nki,nkj->nij", F, F) - np.eye(3)) / 2
    diagonals = np.array([[1, 1, 1], [1, 1, -1], [1, -1, 1], [-1, 1, 1]]) / 3**0.5
    along = np.einsum("di,nij,dj->nd", diagonals, E, diagonals)
    W = sum(evaluate(law, F, [0.5])[0] for law in (DiagonalStretch, CubicShear))
    np.testing.assert_allclose(W, 9 / 8 * 0.5 * (along**2).sum(axis=1), rtol=1e-12)
    kept = np.diag([0.7, 1.1, (3 - 0.7**2 - 1.1**2) ** 0.5])
    assert evaluate(DiagonalStretch, kept, [0.5])[0][0] < 1e-30


@pytest.mark.parametrize(
    ("law", "column", "value", "message"),
    [
        (NeoHooke, 1, -1.0, "kappa_MPa"),
        (NeoHooke, 0, np.nan, "mu_MPa"),
        (MooneyRivlin, 1, -0.5, "c1_MPa"),
        (Yeoh, 2, -0.1, "c3_MPa"),
        (Ogden, 3, 0.0, "alpha2"),
        (Ogden, 0, -9.0, "mu_p"),
        (Foam, 4, -1.0, "lambda_MPa"),
        (Foam, 1, 0.0, "alpha_tension"),
        (Guccione, 5, 3.0, "fibre"),
        (Cubic, 1, 9.0, "C11 - C12"),
        (Cubic, 6, 0.9, "length"),
        (CubicShear, 0, -0.1, "G_MPa"),
        (CubicShear, 0, np.inf, "G_MPa"),
        (DiagonalStretch, 0, -0.1, "C_MPa"),
        (Prony, 4, -0.1, "beta1"),
        (Prony, 5, 0.0, "tau1_s"),
        (OgdenRoxburgh, 4, 0.5, "r = 0.5"),
        (Friction, 1, 0.0, "yield_MPa"),
    ],
)
def test_inadmissible_parameters_are_named(law, column, value, message):
    rows = np.stack([ROWS[law]] * 3)
    rows[1, column] = value
    with pytest.raises(InputError, match=message):
        Layer(law, [4, 5, 6], rows)


@pytest.mark.parametrize("poisson", [0.5, -1.0, np.nan])
def test_a_poissons_ratio_beyond_its_range_is_named(poisson):
    with pytest.raises(InputError, match="Poisson's ratio"):
        NeoHooke.parameters(1.0, poisson)


def test_layers_act_side_by_side_and_miss_no_element():
    """Half of one law and half of another, in two layers, is one law of the mean parameters."""
    mesh = bodies.hollow_box(2, n=3)
    count = len(mesh.tets)
    soft, stiff = NeoHooke.parameters(0.1, 0.3), NeoHooke.parameters(2.0, 0.3)
    share = np.linspace(0, 1, count)
    blended = bodies.uniform(mesh, 0.1, 0.3).blended(share, NeoHooke, stiff)
    assert [len(layer.elements) for layer in blended.layers] == [count - 1, count - 1]
    rows = (1 - share)[:, None] * soft + share[:, None] * stiff
    mixed = Materials((Layer(NeoHooke, np.arange(count), rows),))
    np.testing.assert_allclose(blended.small_strain(count), mixed.small_strain(count), rtol=1e-12)
    model = Model(mesh)
    u = 0.02 * np.random.default_rng(0).standard_normal(mesh.nodes.shape)
    a, b = (model.parameters(materials) for materials in (blended, mixed))
    assert model.potential(u, 0.01, a) == pytest.approx(model.potential(u, 0.01, b), rel=1e-13)
    np.testing.assert_allclose(model.residual(u, 0.01, a), model.residual(u, 0.01, b), atol=1e-13)
    np.testing.assert_allclose(model.tangent(u, 0.01, a), model.tangent(u, 0.01, b), atol=1e-12)
    assert blended.hash() != mixed.hash()
    with pytest.raises(InputError, match=f"1 of {count} elements have no material"):
        model.parameters(Materials((blended.layers[0],)))
    with pytest.raises(InputError, match="listed twice"):
        Layer(NeoHooke, [0, 0], np.repeat(soft, 2, axis=0))
    with pytest.raises(InputError, match="shape"):
        Layer(NeoHooke, [0, 1], soft)
    with pytest.raises(InputError, match="share"):
        blended.blended(share + 0.1, NeoHooke, soft)


@pytest.mark.nightly("test_stress_and_tangent_are_derivatives")
def test_an_assembled_body_of_all_laws_has_a_potential_and_a_symmetric_tangent():
    """Every law in every element at once, those with history after a step they remember."""
    mesh = bodies.hollow_box(2, n=3, clamp=False)
    elements = np.arange(len(mesh.tets))
    layers = [Layer(law, elements, np.tile(row, (len(elements), 1)), 0.1) for law, row in ROWS.items()]
    model = Model(mesh)
    m = model.parameters(Materials(tuple(layers)))
    rng = np.random.default_rng(0)
    m.dt_s = 0.5
    model.commit(0.02 * rng.standard_normal(mesh.nodes.shape), m)
    u, d = 0.02 * rng.standard_normal((2, *mesh.nodes.shape))
    # `matrix` mirrors one triangle: that it is the derivative shows that nothing unsymmetric was dropped.
    assert_derivatives(model, m, u, d, 0.03, tangent=1e-7)
