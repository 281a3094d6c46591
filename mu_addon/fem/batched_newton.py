"""Batched Newton's method for bodies that differ in a few elements and share one factorisation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from scipy import sparse

from ..errors import ConvergenceError, InputError
from ..meshing.mesh import Mesh
from .conjugate_gradients import Change
from .elementwise import element_stiffness, rotations
from .equilibrium import Equilibrium
from .factor import IndefiniteError
from .line_search import Descent
from .materials import Layer, Materials
from .model import Model
from .newton_settings import NewtonSettings
from .state import State, rest
from .tangent_variants import make_variants

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Variant:
    """A body that differs from another in a share (m,) of each element's volume, filled by another law.

    share: 0 to 1, one an element; parameters: of the law, (m, count), or one row for all.
    """

    share: Array
    law: Any
    parameters: Array

    def of(self, materials: Materials) -> Materials:
        """Materials of the variant, from the body's; raises InputError for a share outside 0 to 1."""
        return materials.blended(self.share, self.law, self.parameters)


class BatchedNewton:
    """Equilibria of many variants of one body, each from the body's state at the same pressure.

    Every step is a quasi-Newton step with the variant's exact tangent at the body's state, at the cost of one
    solve with the tangent that all variants share (see `variants`). Raises InputError for a model with
    self-contact.
    """

    def __init__(
        self,
        model: Model,
        materials: Materials,
        variants: Sequence[Variant],
        settings: NewtonSettings | None = None,
    ) -> None:
        if model.self_contact is not None:
            raise InputError(
                "bodies with self-contact have tangents of different patterns",
                "BatchedNewton",
                "solve each separately, with Equilibrium",
            )
        self.model, self.materials, self.variants = model, materials, list(variants)
        self.settings = settings or NewtonSettings()
        self._base = model.parameters(materials)
        self._data = [model.parameters(v.of(materials)) for v in self.variants]
        touched = np.flatnonzero(np.any([v.share > 0 for v in self.variants], axis=0))
        self._part = _Part(model, materials, self.variants, touched)
        self._shared = make_variants(model, self._part.unknowns)

    def at(self, state: State) -> list[State]:
        """Stable equilibrium of every variant at the pressure of one of the body's states.

        Raises ConvergenceError where a variant has none that continues the body's.
        """
        if not state.loaded:
            return [rest(self.model.mesh) for _ in self.variants]
        found: list[State | None] = [None] * len(self.variants)
        searches: dict[int, Descent] = {}
        try:
            self._shared.factor(self.model.tangent(state.u, state.pressure_MPa, self._base))
        except IndefiniteError:
            return [self._alone(i, state, None) for i in range(len(self.variants))]
        shared = attrs.evolve(self.settings, tolerance=self.settings.shared_tolerance)
        taken = {}
        changes = self._part.changes(state.u)
        for i in range(len(self.variants)):
            try:
                taken[i] = self._shared.take(changes[i])
                searches[i] = Descent(self.model, self._data[i], state.pressure_MPa, state.u, shared)
            except (ConvergenceError, IndefiniteError, np.linalg.LinAlgError):
                searches.pop(i, None)
        for step in range(self.settings.max_shared_steps + 1):
            for i, search in list(searches.items()):
                if search.converged:
                    found[i] = State(state.pressure_MPa, search.u, search.residual, step)
                    del searches[i]
            if not searches or step == self.settings.max_shared_steps:
                break
            pulled = {i: search.pulled_back() for i, search in searches.items()}
            forces = np.array([force for force, _ in pulled.values()])
            solved = self._shared.solve(forces, [taken[i] for i in searches])
            for (i, search), x in zip(list(searches.items()), solved, strict=True):
                if x is None:
                    del searches[i]
                    continue
                try:
                    search.move(search.pushed_forward(x, pulled[i][1]))
                except ConvergenceError:
                    del searches[i]
        limit = self.settings.predictor_tolerance * np.abs(state.u).max()
        for i, one in enumerate(found):
            if one is None or np.abs(one.u - state.u).max() > limit:
                unfinished = searches.get(i)
                found[i] = self._alone(i, state, None if unfinished is None else unfinished.u)
        return [one for one in found if one is not None]

    def alone(self, i: int) -> Equilibrium:
        """Return variant number i as a body by itself: an `Equilibrium` with the same settings."""
        return Equilibrium(self.model, self.variants[i].of(self.materials), self.settings)

    def _alone(self, i: int, state: State, near: Array | None) -> State:
        """Solve for a variant for which the shared factor fails, by its own factors or along its path."""
        alone = self.alone(i)
        limit = self.settings.predictor_tolerance * np.abs(state.u).max()
        for start in (near, state.u):
            if start is None:
                continue
            try:
                found = alone.newton(start, state.pressure_MPa)
            except ConvergenceError:
                continue
            if np.abs(found.u - state.u).max() <= limit:
                return found
        return alone.reach(state.pressure_MPa, [alone.at_zero_pressure()])


class _Part:
    """Elements (e,) that variants change, as a separate model; `unknowns` (c,) are its free ones.

    A variant's new law is taken at rest and rotated with its elements. A stiff inclusion deforms little, so
    this is closer to its final tangent than the law at the body's strain, which may be indefinite under
    compression.
    """

    def __init__(
        self, model: Model, materials: Materials, variants: Sequence[Variant], elements: Array
    ) -> None:
        mesh = model.mesh
        self._nodes, tets = np.unique(mesh.tets[elements], return_inverse=True)
        none = np.empty(0, dtype=np.int32)
        self._mesh = Mesh(
            nodes=mesh.nodes[self._nodes],
            tets=tets.reshape(len(elements), -1),
            region=mesh.region[elements],
            cavity=np.empty((0, mesh.cavity.shape[1]), dtype=np.int32),
            base=none,
            tip=none,
        )
        number = np.full(mesh.nodes.size, -1)
        number[model.free] = np.arange(len(model.free))
        number = number.reshape(-1, 3)[self._nodes]
        self.unknowns = np.unique(number[number >= 0])
        self._model = Model(self._mesh, number < 0, model.device, 1, model.mean_dilatation)
        self._numbers = number[self._mesh.tets].reshape(len(elements), -1)
        self._every = np.arange(len(elements))
        self._shares = [v.share[elements] for v in variants]
        self._base = self._model.parameters(_within(materials, elements, len(mesh.tets)))
        at_rest = np.zeros_like(self._mesh.nodes)
        # Variants mostly share a law and its parameters.
        known: dict[tuple[int, int], Array] = {}
        self._new = []
        for v in variants:
            kind = id(v.law), id(v.parameters)
            if kind not in known:
                count = len(v.law.parameter_names)
                rows = np.broadcast_to(v.parameters, (len(v.share), count))[elements]
                data = self._model.parameters(Materials((Layer(v.law, self._every, rows),)))
                known[kind] = element_stiffness(self._model, at_rest, data, self._every)
            self._new.append(known[kind])

    def changes(self, u: Array) -> list[Change]:
        """Changes of the tangent by each variant at the body's displacement (n, 3) in mm."""
        u = u[self._nodes]
        old = element_stiffness(self._model, u, self._base, self._every)
        turn = rotations(self._mesh, u, self._every)
        k = self._mesh.tets.shape[1]
        found = []
        for share, new in zip(self._shares, self._new, strict=True):
            mine = np.flatnonzero(share)
            blocks = new[mine].reshape(len(mine), k, 3, k, 3)
            turned = np.einsum("eij,eajbk,elk->eaibl", turn[mine], blocks, turn[mine], optimize=True)
            matrix = share[mine, None, None] * (turned.reshape(len(mine), 3 * k, 3 * k) - old[mine])
            numbers = self._numbers[mine]
            free = (numbers[:, :, None] >= 0) & (numbers[:, None, :] >= 0)
            used = np.unique(numbers[numbers >= 0])
            place = np.searchsorted(used, numbers)
            rows, columns = np.broadcast_arrays(place[:, :, None], place[:, None, :])
            entries = matrix[free], (rows[free], columns[free])
            found.append(Change(used, sparse.coo_matrix(entries, shape=(len(used), len(used))).tocsr()))
        return found


def _within(materials: Materials, elements: Array, count: int) -> Materials:
    """Materials of some elements (e,) of `count`, renumbered in their order."""
    local = np.full(count, -1)
    local[elements] = np.arange(len(elements))
    layers = []
    for layer in materials.layers:
        rows = np.flatnonzero(local[layer.elements] >= 0)
        if len(rows):
            numbers = local[layer.elements[rows]]
            layers.append(Layer(layer.law, numbers, layer.parameters[rows], layer.weight[rows]))
    return Materials(tuple(layers))
