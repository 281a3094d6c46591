"""Sensitivity of the residual's work along given displacements to mesh, ties and materials.

With u and v fixed, g = v . r(u) is a sum over quadrature points, of F = 1 + grad u and H = grad v:

g = sum dV f [P : H + p cof F : H],    p = kappa (mean J - 1) the part of the pressure by the mean,

so that its derivatives by every node's position, every point's filled share and every tie's weight take one
pass over the elements for any number of freedoms. Source: the shape derivative in material form, e.g. Haftka
and Guerdal, Elements of Structural Optimization, ch. 7.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np
import warp as wp

from ..arrays import Array
from .laws.tensors import mat33

if TYPE_CHECKING:
    from ..meshing.mesh import Mesh
    from .model import LayerData, MaterialData, Model


@attrs.frozen(eq=False)
class Sensitivity:
    """Derivatives of a number by a mesh, at fixed displacements of its untied nodes.

    nodes (n, 3) by positions, per mm; for ends of beams only the part by carried nodes; filled (m, q) by
    shares of volume; tied_weights (t, k) by weights of ties; stiffness (m,) by the logarithm of each
    element's stiffness.
    """

    nodes: Array
    filled: Array
    tied_weights: Array
    stiffness: Array

    def between(self, first: Mesh, second: Mesh) -> float:
        """Difference of the number between two meshes of the same elements, to first order."""
        found = float(np.vdot(self.nodes, first.nodes - second.nodes))
        if first.of_printed_body:
            found += float(np.vdot(self.filled, first.filled - second.filled))
            found += float(np.vdot(self.tied_weights, first.tied_weights - second.tied_weights))
        return found


def of_residual(
    model: Model, u: Array, pressure: float, m: MaterialData, along: Sequence[Array]
) -> list[Sensitivity]:
    """Sensitivities of v . r(u), in mJ, r the elements' and the pressure's forces, for each v of `along`.

    u and each v: displacements (n, 3) in mm that tied and carried nodes follow, v to first order about u;
    pressure in MPa. Forces of contact, dead loads and beams are left out: their derivatives are computed
    elsewhere.
    """
    mesh = model.mesh
    G, dV = model.reference.at.gradients, model.reference.resisting_volumes
    slope_u = _slopes(mesh, G, u)
    F = np.eye(3) + slope_u
    J, cofactor = np.linalg.det(F), _cofactors(F)
    whole = dV.sum(axis=1)
    # Elements replaced by a waveguide have no volume, and no mean.
    share = np.divide(dV, whole[:, None], out=np.zeros_like(dV), where=whole[:, None] > 0.0)
    excess = J - ((share * J).sum(axis=1) if model._takes_means else np.ones(len(J)))[:, None]
    mean = J[:, 0] - excess[:, 0]
    slopes = [_slopes(mesh, G, v) for v in along]
    grown = [(share * _dot(cofactor, H)).sum(axis=1) for H in slopes]
    # Of each point: what multiplies dH, and for each v what multiplies dF, and the relative change of dV.
    S = np.zeros_like(F)
    D, s = np.zeros((len(along), *F.shape)), np.zeros((len(along), *J.shape))
    for layer in m.layers:
        e, weight, kappa = layer.elements.numpy(), layer.weight.numpy(), layer.mean_kappa.numpy()
        stress, changes = _points(model, u, layer, along, m.dt_s)
        by_mean = (kappa * (mean[e] - 1.0))[:, None, None, None]
        stress += by_mean * cofactor[e]
        S[e] += weight[:, None, None, None] * stress
        for k, (H, mean_growth) in enumerate(zip(slopes, grown, strict=True)):
            further = kappa * mean_growth[e]
            # Cofactors are quadratic.
            turned = _cofactors(F[e] + H[e]) - cofactor[e] - _cofactors(H[e])
            change = changes[k] + by_mean * turned + further[:, None, None, None] * cofactor[e]
            D[k][e] += weight[:, None, None, None] * change
            s[k][e] += weight[:, None] * (_dot(stress, H[e]) + further[:, None] * excess[e])
    pressing = _of_pressure(model, u, pressure, along)
    of_beams = _of_beams(model, u, m, along)
    volumes = model.reference.at.volumes
    found = []
    for k, (H, v) in enumerate(zip(slopes, along, strict=True)):
        moved = -(_turned(slope_u) @ D[k]) - _turned(H) @ S
        moved[..., range(3), range(3)] += s[k][..., None]
        ties = np.zeros_like(mesh.tied_weights)
        nodes = _gathered(mesh, G, dV, moved, slice(None)) + pressing[k]
        followers = np.concatenate([mesh.tied, mesh.carried])
        if len(followers):
            around = np.isin(mesh.tets, followers).any(axis=1)
            force, stiff = (_gathered(mesh, G, dV, part, around) for part in (S, D[k]))
            ties = np.einsum("ti,tki->tk", force[mesh.tied], v[mesh.tied_to])
            ties += np.einsum("ti,tki->tk", stiff[mesh.tied], u[mesh.tied_to])
            nodes += model.by_places(u, stiff) + model.by_places(u, force, v)
        stiffness = (dV * _dot(S, H)).sum(axis=1) + of_beams[k]
        found.append(Sensitivity(nodes, volumes * s[k], ties, stiffness))
    return found


def _of_beams(model: Model, u: Array, m: MaterialData, along: Sequence[Array]) -> Array:
    """Derivatives (v, m) of the beams' part by the logarithm of each element's stiffness."""
    found = np.zeros((len(along), len(model.mesh.tets)))
    if m.beams is None:
        return found
    forces = m.beams.forces(model.unknowns_of_beams(u))
    part, share = model.shares_of_beams
    for k, v in enumerate(along):
        work = np.einsum("ei,ei->e", forces, model.unknowns_of_beams(v))
        found[k, part] = share * work[model.mesh.beam_of[part]]
    return found


def _slopes(mesh: Mesh, G: Array, u: Array) -> Array:
    """Gradients (m, q, 3, 3) of displacements (n, 3) at the quadrature points."""
    return np.asarray(_turned(u[mesh.tets])[:, None] @ G)


def _gathered(mesh: Mesh, G: Array, dV: Array, tensors: Array, elements: Any) -> Array:
    """Sums (n, 3) over the points of some elements of dV T . grad N, of tensors (m, q, 3, 3)."""
    parts = (dV[elements][..., None, None] * tensors[elements]) @ _turned(G[elements])
    of_node = _turned(parts.sum(axis=1)).reshape(-1, 3)
    numbers, count = mesh.tets[elements].ravel(), len(mesh.nodes)
    return np.stack([np.bincount(numbers, column, count) for column in of_node.T], axis=1)


def _points(
    model: Model, u: Array, layer: LayerData, along: Sequence[Array], dt_s: float
) -> tuple[Array, Array]:
    """Stress (k, q, 3, 3) of a layer's law at u, and its changes (v, k, q, 3, 3) along each v."""
    device, (gradients, _) = model.device, model.reference.on_device
    rows, points = layer.elements.shape[0], gradients.shape[1]
    others = wp.array(np.ascontiguousarray(along), dtype=wp.vec3d, device=device)
    stress = wp.empty((rows, points), dtype=mat33, device=device)
    change = wp.empty((len(along), rows, points), dtype=mat33, device=device)
    model._place(u)
    inputs = [layer.elements, layer.rows, layer.mean_kappa, layer.history, dt_s]
    inputs += [model._u, model._tets, gradients, others, stress, change]
    model._launch(layer.kernels.along, rows, inputs)
    return stress.numpy(), change.numpy()


def _of_pressure(model: Model, u: Array, pressure: float, along: Sequence[Array]) -> Array:
    """Derivatives (v, n, 3) of the pressure's part by the nodes' places: L . (s x t) by s and t.

    s, t: a face's tangents, L the mean of v at a point of it.
    """
    places, count = model.mesh.nodes + u, len(model.mesh.nodes)
    derivative, shape, rule = (a.numpy() for a in model._face_rule)
    found = np.zeros((len(along), count, 3))
    nodes, share = model.mesh.cavity, pressure * model._shares.numpy()
    s, t = np.einsum("fni,qnk->kfqi", places[nodes], derivative)
    for k, v in enumerate(along):
        moved = np.einsum("f,q,qn,fni->fqi", share, rule, shape, v[nodes])
        parts = np.einsum("fqi,qn->fni", np.cross(t, moved), derivative[..., 0])
        parts += np.einsum("fqi,qn->fni", np.cross(moved, s), derivative[..., 1])
        np.add.at(found[k], nodes, parts)
    return found


def _cofactors(F: Array) -> Array:
    """det F F^-T (..., 3, 3), of singular matrices as well."""
    a, b, c = (F[..., row, :] for row in range(3))
    return np.stack([np.cross(b, c), np.cross(c, a), np.cross(a, b)], axis=-2)


def _turned(a: Array) -> Array:
    return np.swapaxes(a, -1, -2)


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(axis=(-1, -2)))
