"""Difference in the residual's work along given displacements between two similar bodies."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from ..arrays import Array
from ..design.quantity import in_MPa
from ..fem.materials import Materials
from ..fem.model import Model
from ..fem.sensitivity import Sensitivity, of_residual
from .structure import Condition, Structure


class ResidualChange:
    """Changes of v . r(u) at a body's displacements u, for each v of `along`.

    u and each v: (n, 3) in mm, tied and carried nodes following, v to first order about u; of a neighbour by
    its own ties and arms. model: another one of the body's mesh than its own.
    """

    def __init__(
        self,
        structure: Structure,
        condition: Condition,
        u: Array,
        along: Sequence[Array],
        model: Model | None = None,
    ) -> None:
        self._structure, self._condition, self._u, self._along = structure, condition, u, along
        self._model = structure.under(condition) if model is None else model
        self._pressure = in_MPa(condition.pressure_kPa)

    @cached_property
    def sensitivities(self) -> list[Sensitivity]:
        """Sensitivities of each v . r without contact and dead loads to the body's mesh and elements."""
        data = self._model.parameters(self._own)
        return of_residual(self._model, self._u, self._pressure, data, self._along)

    def between(self, plus: Structure, minus: Structure) -> Array:
        """First-order difference of each v . r (k,) in mJ between one neighbour and another."""
        first, second = plus.model.mesh, minus.model.mesh
        found = self._by_materials(plus.materials, minus.materials)
        if first is not second:
            found += [one.between(first, second) for one in self.sensitivities]
            found += [np.vdot(one, first.nodes - second.nodes) for one in self._contact_by_places]
            found += self._by_beams(plus.model, minus.model)
        found += self._by_gap(plus, minus)
        return found + self._by_rest(plus) - self._by_rest(minus)

    @property
    def _own(self) -> Materials:
        return self._structure.materials

    def _by_materials(self, plus: Materials, minus: Materials) -> Array:
        weights = _weights_change(plus, minus, len(self._model.mesh.tets))
        if weights is not None:
            if not weights.any():
                return np.zeros(len(self._along))
            return np.array([one.stiffness @ weights for one in self.sensitivities])
        sides = [
            self._model.residual(self._u, self._pressure, self._model.parameters(m)) for m in (plus, minus)
        ]
        change = (sides[0] - sides[1]).ravel()[self._model.free]
        return np.array([v.ravel()[self._model.free] @ change for v in self._along])

    def _by_beams(self, plus: Model, minus: Model) -> Array:
        """Change by the beams' lengths, directions and sections, of the body's own materials."""
        sides = [side.beams_of(self._own) for side in (plus, minus)]
        if None in sides:
            return np.zeros(len(self._along))
        x = self._model.unknowns_of_beams(self._u)
        ahead, behind = (side.forces(x) for side in sides if side is not None)
        return np.array([np.vdot(self._model.unknowns_of_beams(v), ahead - behind) for v in self._along])

    @cached_property
    def _touches(self) -> bool:
        contact = self._model.self_contact
        return contact is not None and bool(contact.forces(self._u)[1].any())

    @cached_property
    def _contact_by_places(self) -> list[Array]:
        """Derivatives (n, 3) by the nodes' places of self-contact's part; its nodes are not tied."""
        model, u, contact = self._model, self._u, self._model.self_contact
        if contact is None or not self._touches:
            return [np.zeros_like(u) for _ in self._along]
        forces = np.zeros_like(u)
        nodes, acting = contact.forces(u)
        forces[nodes] += acting
        return [
            one + model.by_places(u, by_u) + model.by_places(u, forces, v)
            for by_u, one, v in zip(*contact.by_places(u, self._along), self._along, strict=True)
        ]

    def _by_gap(self, plus: Structure, minus: Structure) -> Array:
        """Change by gap and stiffness of self-contact."""
        sides = [s.model.self_contact for s in (plus, minus)]
        contact, mesh = self._model.self_contact, self._model.mesh
        found = np.zeros(len(self._along))
        if contact is None or not self._touches or None in sides:
            return found
        laws = [(s.gap_mm, s.stiffness_MPa) for s in sides if s is not None]
        if laws[0] == laws[1]:
            return found
        nodes = contact.forces(self._u)[0]
        ahead, behind = (contact.relocated(mesh, *law).forces(self._u)[1] for law in laws)
        return np.array([np.vdot(v[nodes], ahead - behind) for v in self._along])

    def _by_rest(self, side: Structure) -> Array:
        """Work (k,) in mJ along each v of a neighbour's obstacles and dead loads."""
        model = side.under(self._condition)
        found = np.zeros(len(self._along))
        if model.load is None and not model.obstacles:
            return found
        u = side.following(self._u)
        forces = [obstacle.forces(u) for obstacle in model.obstacles]
        for k, own in enumerate(side.following_changes(self._u, self._along)):
            found[k] = sum(float(np.vdot(own[nodes], parts)) for nodes, parts in forces)
            if model.load is not None:
                found[k] -= float(np.vdot(own, model.load))
        return found


def _weights_change(plus: Materials, minus: Materials, count: int) -> Array | None:
    """Difference (m,) of the logarithm of each of `count` elements' stiffness between two bodies' materials.

    None if more differs: each element must have one law with the same parameters.
    """
    if len(plus.layers) != len(minus.layers):
        return None
    change, covered = np.zeros(count), np.zeros(count, int)
    for one, other in zip(plus.layers, minus.layers, strict=True):
        alike = one.law is other.law and np.array_equal(one.elements, other.elements)
        if not alike or not np.array_equal(one.parameters, other.parameters):
            return None
        change[one.elements] = 2.0 * (one.weight - other.weight) / (one.weight + other.weight)
        covered[one.elements] += 1
    return change if (covered == 1).all() or not change.any() else None
