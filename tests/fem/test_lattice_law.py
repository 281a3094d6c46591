"""A lattice of several laws in parallel: one body of all of them."""

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.fem.lattice_law import LatticeLaw, deformation_gradients, stretches
from mu_addon.fem.laws import CubicShear, DiagonalStretch, Foam
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model

from .bodies import box
from .cubic import Cubic

FOAM = np.array([0.006, 5.0, 0.006, 4.0, 0.01, -2.0])
LAW = LatticeLaw("test", ((Foam, FOAM), (CubicShear, np.array([0.02])), (DiagonalStretch, np.array([0.02]))))


@pytest.fixture(scope="module")
def mesh():
    return box(clamp=True, jiggle=0.2)


def test_foam_and_struts_side_by_side_are_at_small_strain_a_cubic_body(mesh):
    """Tangents at rest, element by element, against one cubic law of C11, C12 and C44 added up."""
    mu, lame = FOAM[0], FOAM[4]
    C = [lame + 0.02 + 2 * mu, lame + 0.02, mu + 0.02]
    law = LatticeLaw("cubic", ((Cubic, np.array([*C, 1, 0, 0, 0, 1, 0])),))
    model = Model(mesh)
    a, b = (
        model.tangent(
            np.zeros_like(mesh.nodes), 0.0, model.parameters(Materials(one.fill(np.arange(len(mesh.tets)))))
        )
        for one in (LAW, law)
    )
    np.testing.assert_allclose(a, b, atol=1e-11 * np.abs(a).max())
    expected = Cubic.small_strain(law.layers[0][1][None])[0]
    found = sum(one.small_strain(row[None])[0] for one, row in LAW.layers)
    assert found == pytest.approx(expected)


def test_principal_stretches_of_a_homogeneous_deformation(mesh):
    Q = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    F = Q @ np.diag([0.7, 1.1, 1.3]) @ Q.T
    u = mesh.nodes @ (F - np.eye(3)).T
    found, volume = deformation_gradients(mesh, u, np.arange(5))
    np.testing.assert_allclose(stretches(found), np.broadcast_to([0.7, 1.1, 1.3], (5, found.shape[1], 3)))
    assert volume.shape == found.shape[:2]


def test_a_lattice_without_a_law_or_with_an_inadmissible_one_is_named():
    with pytest.raises(InputError, match="no layer"):
        LatticeLaw("none", ())
    with pytest.raises(InputError, match="lambda_MPa"):
        LatticeLaw("bad", ((Foam, np.array([0.006, 5.0, 0.006, 4.0, -0.01, -2.0])),))
