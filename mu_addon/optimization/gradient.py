"""Derivatives of quantities by freedoms: one adjoint solution a quantity and condition.

With r(u, p) = 0 the equilibrium at freedoms p, a quantity q(u, p) changes by

    dq/dp = dq/dp |u - lambda . dr/dp |u,    K lambda = dq/du,

K the tangent at the state, whose factor serves every quantity. lambda . dr at fixed u is linear in the places
of the nodes, shares and ties, so one pass over the elements (`fem.sensitivity`) gives it for all freedoms. A
freedom then costs no assembly: it takes the difference of these between two bodies with the freedom moved a
little either way. Both have the same elements: the mesh is morphed, not made again, so there is no meshing
noise in it. Source: the discrete semi-analytic adjoint, e.g. Haftka and Guerdal, Elements of Structural
Optimization, ch. 7. Its known error under large rotations is of first order in the step; central differences
do not have it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from ..errors import MeshingError
from ..fem.model import Model
from .residual_change import ResidualChange
from .structure import WITHOUT, Condition, Quantity, States, Structure

Pair = tuple[Structure, Structure, float]
"""The body with one freedom moved up, and down, and the difference of the freedom between the two."""


def _adjoint(
    structure: Structure, states: States, quantities: Sequence[Quantity]
) -> dict[Condition, tuple[tuple[int, ...], Array]]:
    """For each condition the quantities with a `slope` there, and lambda (free, k): one factor, k solutions.

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
        slopes = np.stack([slope.ravel() for _, slope in served], axis=1)
        loads = model.passed_on(states[condition], slopes)[model.free]
        found[condition] = tuple(n for n, _ in served), factor.solve(np.ascontiguousarray(loads))
    return found


def gradients(
    structure: Structure,
    states: States,
    quantities: Sequence[Quantity],
    pairs: Sequence[Callable[[], Pair]],
) -> Array:
    """Derivatives (q, f) of q quantities by f freedoms at a body's states.

    pairs: for each freedom a function that makes the two bodies; called in order, one held at a time but for
    quantities without a slope. nan where a freedom changes which struts a sensor meets. Raises
    IndefiniteError at an unstable state, and the errors of making a body.
    """
    changes = _changes(structure, states, quantities)
    direct = [q for q in quantities if q.conditions and not hasattr(q, "slope") and not hasattr(q, "change")]
    own = {condition for q in direct for condition in q.conditions}
    found = np.zeros((len(quantities), len(pairs)))
    forces: dict[Condition, list[Array]] = {c: [] for c in own}
    held: list[Pair] = []
    for f, make in enumerate(pairs):
        plus, minus, step = make()
        for numbers, change in changes.values():
            try:
                found[numbers, f] -= change(plus, minus) / step
            except MeshingError:
                found[numbers, f] = np.nan
        for condition in own:
            forces[condition].append(_residual_change(plus, minus, condition, states) / step)
        for number, q in enumerate(quantities):
            if np.isnan(found[number, f]):
                continue
            if hasattr(q, "change"):
                found[number, f] += q.change(structure, states, plus, minus) / step
            elif q not in direct:
                ahead, behind = (
                    q.value(side, {c: side.of(c.path).following(states[c]) for c in q.conditions})
                    for side in (plus, minus)
                )
                found[number, f] += (ahead - behind) / step
        if direct:
            held.append((plus, minus, step))
    if direct and held:
        moving = _displacement_derivatives(structure, states, forces)
        for f, (plus, minus, step) in enumerate(held):
            forward = {c: plus.following(states[c] + 0.5 * step * moving[c][f]) for c in own}
            backward = {c: minus.following(states[c] - 0.5 * step * moving[c][f]) for c in own}
            for number, q in enumerate(quantities):
                if q in direct:
                    found[number, f] = (q.value(plus, forward) - q.value(minus, backward)) / step
    return found


def _changes(
    structure: Structure, states: States, quantities: Sequence[Quantity]
) -> dict[Condition, tuple[list[int], Callable[[Structure, Structure], Array]]]:
    """Quantities that each condition of an adjoint serves, and the change of lambda . r between two bodies.

    Of a body with a sensor by both residuals: its ties may go to other nodes in a neighbour.
    """
    found: dict[Condition, tuple[list[int], Callable[[Structure, Structure], Array]]] = {}
    for condition, (numbers, lam) in _adjoint(structure, states, quantities).items():
        if condition.path != WITHOUT:
            found[condition] = list(numbers), partial(_along, lam, condition, states)
            continue
        u = states[condition]
        along = _everywhere(structure, u, lam)
        found[condition] = list(numbers), ResidualChange(structure, condition, u, along).between
    return found


def _along(lam: Array, condition: Condition, states: States, plus: Structure, minus: Structure) -> Array:
    """Difference (k,) of lambda . r, lambda (free, k), between two bodies at the same displacements."""
    return np.asarray(lam.T @ _residual_change(plus, minus, condition, states))


def _everywhere(structure: Structure, u: Array, free: Array) -> list[Array]:
    """Changes (free, k) of the displacements u (n, 3) as k at the nodes, (n, 3) each."""
    changes = np.zeros((free.shape[1], *u.shape))
    for change, column in zip(changes, free.T, strict=True):
        change.ravel()[structure.model.free] = column
    return structure.following_changes(u, list(changes))


def _residual_change(plus: Structure, minus: Structure, condition: Condition, states: States) -> Array:
    """Difference (free,) in N of the residual between two bodies at the same displacements."""
    pressure, u = in_MPa(condition.pressure_kPa), states[condition]
    sides = []
    for s in (plus, minus):
        body, model = s.of(condition.path), s.under(condition)
        data = model.parameters(body.materials)
        sides.append(model.residual(body.following(u), pressure, data).ravel()[model.free])
    return np.asarray(sides[0] - sides[1])


def _tangent_factor(structure: Structure, states: States, condition: Condition) -> tuple[Any, Model]:
    """The factor of the tangent at a condition's state, and the condition's model."""
    model = structure.under(condition)
    data = model.parameters(structure.of(condition.path).materials)
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
        found[condition] = _everywhere(structure, states[condition], moved)
    return found
