"""How the residual's work changes with mesh and stiffness, against differences of residuals."""

import attrs
import numpy as np
import pytest

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.fem import Layer, NeoHooke, Yeoh
from mu_addon.fem.laws import CubicShear
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.sensitivity import of_residual
from mu_addon.meshing.settings import MeshSettings
from tests.fem.bodies import box

PRESSURE = 0.01


def printed(solid):
    unit = load_preset("mu-1.0x")
    small = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3))
    return mesh_printed(small, MeshSettings(refine=0.2), solid=solid)


def followed(model, u, v):
    """Displacements and a change of them, with tied and carried nodes following."""
    u = model.following(u.copy())
    return u, model.passed_back(u, v.reshape(-1, 1).copy()).reshape(u.shape)


def materials(mesh, weight=1.0):
    """Struts of one law, and a wall of two side by side, of which one splits its volume off and one not."""
    wall, struts = np.flatnonzero(mesh.region == 1), np.flatnonzero(mesh.region == 2)
    weight = np.broadcast_to(weight, len(mesh.tets))
    rows = np.tile([0.4, -0.01, 0.001, 8.0], (len(wall), 1))
    stiff = np.tile(NeoHooke.parameters(2.0, 0.45), (len(struts), 1))
    shear = np.full((len(wall), 1), 0.02)
    layers = [Layer(Yeoh, wall, rows, 0.6 * weight[wall]), Layer(CubicShear, wall, shear, 0.4 * weight[wall])]
    if len(struts):
        layers.append(Layer(NeoHooke, struts, stiff, weight[struts]))
    return Materials(tuple(layers))


def work(mesh, u, v, made):
    model = Model(mesh, threads=1)
    forces = model.residual(model.following(u.copy()), PRESSURE, model.parameters(made))
    return np.vdot(v.ravel()[model.free], forces.ravel()[model.free])


def work_of_beams(mesh, u, v, made):
    model = Model(mesh, threads=1)
    beams = model.beams_of(made)
    if beams is None:
        return 0.0
    return np.vdot(model.unknowns_of_beams(v), beams.forces(model.unknowns_of_beams(u)))


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(
            lambda: printed(True),
            marks=pytest.mark.nightly("test_it_is_the_derivative_by_places_shares_ties_and_stiffness"),
        ),
        lambda: printed(False),
        lambda: box((2, 2, 3), (4.0, 5.0, 6.0), clamp=True),
    ],
    ids=["solid struts", "beams", "box"],
)
def test_it_is_the_derivative_by_places_shares_ties_and_stiffness(make):
    mesh = make()
    model, random = Model(mesh, threads=1), np.random.default_rng(1)
    small = 0.05 * np.cbrt(model.volumes.min() / model.volumes.mean()) if mesh.of_printed_body else 0.05
    u, v = (np.zeros_like(mesh.nodes) for _ in range(2))
    u.ravel()[model.free] = small * random.standard_normal(len(model.free))
    v.ravel()[model.free] = random.standard_normal(len(model.free))
    made = materials(mesh)
    u_all, v_all = followed(model, u, v)
    [found] = of_residual(model, u_all, PRESSURE, model.parameters(made), [v_all])
    plane = mesh.nodes[:, 0] == 0.0
    way = random.standard_normal(mesh.nodes.shape)
    way[plane, 0] = 0.0
    changes = {"nodes": way}
    if mesh.of_printed_body:
        changes |= {
            name: random.standard_normal(getattr(mesh, name).shape) for name in ("filled", "tied_weights")
        }
    for name, change in changes.items():
        step = 1e-6
        first, second = (
            attrs.evolve(mesh, **{name: getattr(mesh, name) + sign * step * change}) for sign in (1, -1)
        )
        expected, of_beams = (of(first, u, v, made) - of(second, u, v, made) for of in (work, work_of_beams))
        # What beams do as their ends move is left out.
        expected -= of_beams
        assert found.between(first, second) == pytest.approx(expected, rel=1e-5), name
    change = random.standard_normal(len(mesh.tets))
    sides = [work(mesh, u, v, materials(mesh, np.exp(sign * 1e-4 * change))) for sign in (1, -1)]
    assert found.stiffness @ change == pytest.approx((sides[0] - sides[1]) / 2e-4, rel=1e-6)
