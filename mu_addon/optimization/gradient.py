"""Derivatives of quantities by freedoms, semi-analytic: one adjoint solution a quantity and condition.

With r(u, p) = 0 the equilibrium at freedoms p, a quantity q(u, p) changes by

    dq/dp = dq/dp |u - lambda . dr/dp |u,    K lambda = dq/du,

K the tangent at the state, whose factor serves every quantity. The derivatives at fixed displacements are
central differences between two bodies with the freedom moved a little either way and the same elements (a
mesh morphed, not made anew), so that no mesher's noise is in them: two assemblies a freedom and condition.
Source: the discrete semi-analytic adjoint, e.g. Haftka and Guerdal, Elements of Structural Optimization,
ch. 7; its known trouble, the error of forward differences under large rotations, is one of first order in
the step that central differences do not have.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import attrs
import numpy as np

from ..design.quantity import in_MPa
from ..fem.elementwise import element_forces
from ..fem.model import Model
from .structure import WITHOUT, Condition, Quantity, States, Structure

Array = np.ndarray[Any, Any]

Pair = tuple[Structure, Structure, float]
"""The body with one freedom moved up, and down, and the difference of the freedom between the two."""


@attrs.frozen(eq=False)
class Adjoint:
    """Solutions of the adjoint problem: for each condition the quantities it serves and lambda (free, k)."""

    of: dict[Condition, tuple[tuple[int, ...], Array]]


def adjoint(structure: Structure, states: States, quantities: Sequence[Quantity]) -> Adjoint:
    """One factorisation a condition, and one solution a quantity that has a `slope` there.

    Raises IndefiniteError at an unstable state.
    """
    wanted: dict[Condition, list[tuple[int, Array]]] = {}
    for number, quantity in enumerate(quantities):
        if hasattr(quantity, "slope"):
            for condition, slope in quantity.slope(structure, states).items():
                wanted.setdefault(condition, []).append((number, slope))
    found = {}
    for condition, served in wanted.items():
        factor, model = _tangent_factor(structure, states, condition)
        loads = np.stack([model.mesh.folded(slope).ravel()[model.free] for _, slope in served], axis=1)
        found[condition] = tuple(n for n, _ in served), factor.solve(loads)
    return Adjoint(found)


def gradients(
    structure: Structure,
    states: States,
    quantities: Sequence[Quantity],
    pairs: Sequence[Callable[[], Pair]],
    solved: Adjoint | None = None,
) -> Array:
    """Derivatives (q, f) of q quantities by f freedoms at a body's states.

    pairs: for each freedom a function that makes the two bodies; called in order, one held at a time. A
    freedom that makes elements stiffer or softer and does no more takes no assembly (`by_element`). solved:
    `adjoint` of the same quantities, found here where it is not given. Raises IndefiniteError at an unstable
    state, and what making a body raises.
    """
    solved = solved or adjoint(structure, states, quantities)
    direct = [q for q in quantities if q.conditions and not hasattr(q, "slope") and not hasattr(q, "change")]
    own = {condition for q in direct for condition in q.conditions}
    found = np.zeros((len(quantities), len(pairs)))
    forces: dict[Condition, list[Array]] = {c: [] for c in own}
    held: list[Pair] = []
    by_stiffness: Array | None = None
    for f, make in enumerate(pairs):
        plus, minus, step = make()
        weights = None if direct else _weights_change(structure, plus, minus)
        if weights is not None:
            if by_stiffness is None:
                by_stiffness = by_element(structure, states, quantities, solved)
            found[:, f] = by_stiffness @ weights / step
        for condition in {*solved.of, *own} if weights is None else ():
            change = _residual_change(plus, minus, condition, states) / step
            if condition in own:
                forces[condition].append(change)
            if condition in solved.of:
                numbers, lam = solved.of[condition]
                found[list(numbers), f] -= lam.T @ change
        for number, q in enumerate(quantities):
            if hasattr(q, "change"):
                found[number, f] += q.change(structure, states, plus, minus) / step
            elif q not in direct:
                ahead, behind = (
                    q.value(side, {c: side.following(states[c]) for c in q.conditions})
                    for side in (plus, minus)
                )
                found[number, f] += (ahead - behind) / step
        if direct:
            held.append((plus, minus, step))
    if direct and held:
        moving = _displacement_derivatives(structure, states, forces)
        for f, (plus, minus, step) in enumerate(held):
            forward = {c: states[c] + 0.5 * step * moving[c][f] for c in own}
            backward = {c: states[c] - 0.5 * step * moving[c][f] for c in own}
            for number, q in enumerate(quantities):
                if q in direct:
                    found[number, f] = (q.value(plus, forward) - q.value(minus, backward)) / step
    return found


def _weights_change(structure: Structure, plus: Structure, minus: Structure) -> Array | None:
    """Difference (m,) of the logarithm of each element's stiffness between two bodies, None where that is
    not all that differs: of one mesh and load, each element of one law with the same parameters."""
    model = structure.model
    models = plus.model, minus.model
    if any(m.mesh is not model.mesh or m.self_contact is not None for m in models):
        return None
    first, second = (np.zeros(1) if m.load is None else m.load for m in models)
    layers = [s.materials[WITHOUT].layers for s in (plus, minus)]
    if len(structure.materials) > 1 or not np.array_equal(first, second) or len(layers[0]) != len(layers[1]):
        return None
    change, covered = np.zeros(len(model.mesh.tets)), np.zeros(len(model.mesh.tets), int)
    for one, other in zip(*layers, strict=True):
        alike = one.law is other.law and np.array_equal(one.elements, other.elements)
        if not alike or not np.array_equal(one.parameters, other.parameters):
            return None
        change[one.elements] = 2.0 * (one.weight - other.weight) / (one.weight + other.weight)
        covered[one.elements] += 1
    return change if (covered == 1).all() else None


def by_element(
    structure: Structure, states: States, quantities: Sequence[Quantity], solved: Adjoint | None = None
) -> Array:
    """Derivatives (q, m) of quantities with a `slope` by the logarithm of each element's stiffness.

    As many freedoms as elements for one assembly a condition: -lambda . f_e, f_e the element's own forces.
    """
    solved = solved or adjoint(structure, states, quantities)
    model = structure.model
    found = np.zeros((len(quantities), len(model.mesh.tets)))
    for condition, (numbers, lam) in solved.of.items():
        data = model.parameters(structure.materials[condition.materials])
        forces = element_forces(model, states[condition], data)
        for number, column in zip(numbers, lam.T, strict=True):
            whole = _everywhere(structure, column)
            found[number] -= np.einsum("eai,eai->e", forces, whole[model.mesh.tets])
    return found


def _everywhere(structure: Structure, free: Array) -> Array:
    """A vector (free,) as one at the nodes (n, 3)."""
    model = structure.model
    found = np.zeros(model.mesh.nodes.size)
    found[model.free] = free
    return np.asarray(model.mesh.following(found.reshape(-1, 3)))


def _residual_change(plus: Structure, minus: Structure, condition: Condition, states: States) -> Array:
    """Difference (free,) in N of the residual between two bodies at the same displacements."""
    pressure, u = in_MPa(condition.pressure_kPa), states[condition]
    sides = []
    for s in (plus, minus):
        model = s.under(condition)
        data = model.parameters(s.materials[condition.materials])
        sides.append(model.residual(s.following(u), pressure, data).ravel()[model.free])
    return np.asarray(sides[0] - sides[1])


def _tangent_factor(structure: Structure, states: States, condition: Condition) -> tuple[Any, Model]:
    """The factor of the tangent at a condition's state, and the condition's model."""
    model = structure.under(condition)
    data = model.parameters(structure.materials[condition.materials])
    values = model.tangent(states[condition], in_MPa(condition.pressure_kPa), data)
    return model.factor.factor(values), model


def _displacement_derivatives(
    structure: Structure, states: States, forces: dict[Condition, list[Array]]
) -> dict[Condition, list[Array]]:
    """Derivatives (n, 3) of the displacements by each freedom, a list for every condition: -K^-1 dr/dp."""
    found = {}
    for condition, changes in forces.items():
        factor, _ = _tangent_factor(structure, states, condition)
        moved = factor.solve(-np.stack(changes, axis=1))
        found[condition] = [_everywhere(structure, column) for column in moved.T]
    return found
