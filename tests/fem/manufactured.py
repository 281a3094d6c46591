"""Smooth displacements of the unit cube, the body force that holds them, and the error of an answer."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from mu_addon.fem.elements import reference_gradients, shape_functions, shape_gradients
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import NeoHooke
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings

from . import bodies


@attrs.frozen
class Field:
    """A displacement (..., 3) of places X (..., 3), its gradient du_i / dX_j, and a material (E in MPa)."""

    displacement: Callable
    gradient: Callable
    modulus: float
    poisson: float

    def stress(self, X):
        """First Piola-Kirchhoff stress (..., 3, 3) of the neo-Hookean law, for complex X too."""
        mu, kappa = NeoHooke.parameters(np.array([self.modulus]), np.array([self.poisson]))[0]
        F = np.eye(3) + self.gradient(X)
        J = np.linalg.det(F)[..., None, None]
        B = np.swapaxes(np.linalg.inv(F), -1, -2)
        I1 = (F * F).sum(axis=(-2, -1))[..., None, None]
        return mu * J ** (-2 / 3) * (F - I1 / 3 * B) + kappa * (J - 1) * J * B

    def body_force(self, X):
        """-Div P in N/mm3, by a complex step: exact to rounding, without a difference of large numbers."""
        h = 1e-30
        return -sum(self.stress(X + 1j * h * axis)[..., j].imag / h for j, axis in enumerate(np.eye(3)))


AMPLITUDE = np.array([0.06, -0.05, 0.04])
NUMBERS = np.array([[2.1, 0.8, -1.3], [-0.9, 2.4, 1.1], [1.2, -1.6, 1.9]])
PHASES = np.array([0.3, 1.1, -0.5])


def _waves(X):
    return AMPLITUDE * np.sin(X @ NUMBERS.T + PHASES)


def _waves_gradient(X):
    return (AMPLITUDE * np.cos(X @ NUMBERS.T + PHASES))[..., None] * NUMBERS


# What `_shears` adds of `_waves`: times a bulk modulus of 1667 MPa, a pressure like the shear modulus.
SQUEEZE = 1e-3


def _shears(X):
    """Three shears one after the other, each of a coordinate by the other two: J is 1, but for a squeeze."""
    x = np.array(X)
    for i, (a, k, c) in enumerate(zip(AMPLITUDE, NUMBERS, PHASES, strict=True)):
        j, n = (i + 1) % 3, (i + 2) % 3
        x[..., i] += a * np.sin(k[j] * x[..., j] + k[n] * x[..., n] + c)
    return x - X + SQUEEZE * _waves(X)


def _shears_gradient(X):
    x, F = np.array(X), np.broadcast_to(np.eye(3), (*X.shape, 3)).astype(X.dtype)
    for i, (a, k, c) in enumerate(zip(AMPLITUDE, NUMBERS, PHASES, strict=True)):
        j, n = (i + 1) % 3, (i + 2) % 3
        angle = k[j] * x[..., j] + k[n] * x[..., n] + c
        F[..., i, :] += a * np.cos(angle)[..., None] * (k[j] * F[..., j, :] + k[n] * F[..., n, :])
        x[..., i] += a * np.sin(angle)
    return F - np.eye(3) + SQUEEZE * _waves_gradient(X)


# Neither displacement nor traction vanishes on the boundary.
WAVES = Field(_waves, _waves_gradient, 1.0, 0.3)
SHEARS = Field(_shears, _shears_gradient, 1.0, 0.4999)


def fine_rule(count=4):
    """Barycentric points (q, 4) and weights (q,), summing to 1/6, exact to degree 2 count - 3.

    Gauss points of a cube collapsed to the tetrahedron.
    """
    g, w = np.polynomial.legendre.leggauss(count)
    g, w = (g + 1) / 2, w / 2
    a, b, c = (x.ravel() for x in np.meshgrid(g, g, g, indexing="ij"))
    weights = np.einsum("i,j,k->ijk", w, w, w).ravel() * (1 - a) ** 2 * (1 - b)
    points = np.stack([a, b * (1 - a), c * (1 - a) * (1 - b)], axis=1)
    return np.column_stack([1 - points.sum(axis=1), points]), weights


def solve(n, order, field=WAVES, **options):
    """Mesh and displacement (k, 3) of a distorted cube of n cells a side, its boundary moved exactly."""
    mesh = bodies.box((n, n, n), order=order, jiggle=0.15)
    boundary = ((mesh.nodes == 0) | (mesh.nodes == 1)).any(axis=1)
    model = Model(mesh, supports=np.repeat(boundary[:, None], 3, axis=1), **options)
    points, weights = fine_rule()
    N = shape_functions(points, order)
    volume = 6 * reference_gradients(mesh.nodes, mesh.tets).volumes.sum(axis=1)
    force = field.body_force(np.einsum("qn,mni->mqi", N, mesh.nodes[mesh.tets]))
    load = np.zeros_like(mesh.nodes)
    np.add.at(load, mesh.tets, np.einsum("mqi,qn,q,m->mni", force, N, weights, volume))
    model.load = load
    count = len(mesh.tets)
    materials = Materials.neo_hooke(np.full(count, field.modulus), np.full(count, field.poisson))
    settings = NewtonSettings(tolerance=1e-10, regularisation=(0.03, 0.3, 3.0))
    equilibrium = Equilibrium(model, materials, settings)
    return mesh, equilibrium.newton(field.displacement(mesh.nodes), 0.0).u


def errors(mesh, u, field=WAVES):
    """Root mean square of the error of u (k, 3), in mm, and of its gradient's."""
    points, weights = fine_rule()
    N, dN = shape_functions(points, mesh.order), shape_gradients(points, mesh.order)
    x = mesh.nodes[mesh.tets]
    jacobian = np.einsum("mni,qnj->mqij", x, dN)
    dV = np.linalg.det(jacobian) * weights
    at = np.einsum("qn,mni->mqi", N, x)
    wrong = np.einsum("qn,mni->mqi", N, u[mesh.tets]) - field.displacement(at)
    slope = np.einsum("mni,qnj,mqjk->mqik", u[mesh.tets], dN, np.linalg.inv(jacobian))
    steep = slope - field.gradient(at)
    return (
        float(np.sqrt(np.einsum("mqi,mqi,mq->", wrong, wrong, dV))),
        float(np.sqrt(np.einsum("mqik,mqik,mq->", steep, steep, dV))),
    )
