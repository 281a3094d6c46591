"""Bodies that differ in a few elements, solved side by side with the one factorisation they share."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np

from ..errors import ConvergenceError
from ..meshing.mesh import Mesh
from .descent import Descent, NewtonSettings
from .equilibrium import Equilibrium, State, rest
from .factor import IndefiniteError
from .materials import Layer, Materials
from .model import Model
from .variants import Change, make_variants

Array = np.ndarray[Any, Any]


@attrs.frozen(eq=False)
class Variant:
    """A body that is another's but for a share (m,) of its elements, which a law fills with parameters.

    parameters: (m, count), or one row for all.
    """

    share: Array
    law: Any
    parameters: Array

    def of(self, materials: Materials) -> Materials:
        """The variant's materials, of the body's."""
        return materials.blended(self.share, self.law, self.parameters)


class Lockstep:
    """Equilibria of many variants of one body, each state from the body's own at the same pressure.

    Every step is a quasi-Newton step with the variant's exact tangent at the body's state, for the price
    of solving once with the tangent that all variants share (see `variants`).
    """

    def __init__(
        self,
        model: Model,
        materials: Materials,
        variants: Sequence[Variant],
        settings: NewtonSettings | None = None,
    ) -> None:
        self.model, self.materials, self.variants = model, materials, list(variants)
        self.settings = settings or NewtonSettings()
        self._base = model.parameters(materials)
        self._data = [model.parameters(v.of(materials)) for v in self.variants]
        touched = np.flatnonzero(np.any([v.share > 0 for v in self.variants], axis=0))
        self._part = _Part(model, touched)
        self._changes = [self._part.model.parameters(self._difference(v, touched)) for v in self.variants]
        self._shared = make_variants(model, self._part.unknowns)

    def _difference(self, variant: Variant, touched: Array) -> Materials:
        """What the variant adds to the body's materials and takes from them, element by element."""
        share = variant.share[touched]
        local = np.full(len(variant.share), -1)
        local[touched] = np.arange(len(touched))
        layers = []
        for layer in self.materials.layers:
            rows = np.flatnonzero(local[layer.elements] >= 0)
            elements = local[layer.elements[rows]]
            if len(rows):
                weight = -layer.weight[rows] * share[elements]
                layers.append(Layer(layer.law, elements, layer.parameters[rows], weight))
        count = len(variant.law.parameter_names)
        parameters = np.broadcast_to(variant.parameters, (len(variant.share), count))[touched]
        return Materials((*layers, Layer(variant.law, np.arange(len(touched)), parameters, share)))

    def at(self, state: State) -> list[State]:
        """Every variant's stable equilibrium at the pressure of one of the body's states.

        Raises ConvergenceError where a variant has none that continues the body's.
        """
        if state.pressure_MPa == 0.0:
            return [rest(self.model.mesh) for _ in self.variants]
        found: list[State | None] = [None] * len(self.variants)
        searches: dict[int, Descent] = {}
        try:
            self._shared.factor(self.model.tangent(state.u, state.pressure_MPa, self._base))
        except IndefiniteError:
            return [self._alone(i, state, None) for i in range(len(self.variants))]
        bending = {}
        for i in range(len(self.variants)):
            try:
                bending[i] = self._shared.take(self._part.change(self._changes[i], state.u))
                searches[i] = Descent(self.model, self._data[i], state.pressure_MPa, state.u, self.settings)
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
            solved = self._shared.solve(forces, [bending[i] for i in searches])
            for (i, search), x in zip(list(searches.items()), solved, strict=True):
                if x is None:
                    del searches[i]
                    continue
                try:
                    search.move(search.pushed_forward(x, pulled[i][1]))
                except ConvergenceError:
                    del searches[i]
        limit = self.settings.surprise * np.abs(state.u).max()
        for i, one in enumerate(found):
            if one is None or np.abs(one.u - state.u).max() > limit:
                unfinished = searches.get(i)
                found[i] = self._alone(i, state, None if unfinished is None else unfinished.u)
        return [one for one in found if one is not None]

    def _alone(self, i: int, state: State, near: Array | None) -> State:
        """A variant that the shared factor does not serve: with factors of its own, or along its path."""
        alone = Equilibrium(self.model, self.variants[i].of(self.materials), self.settings)
        limit = self.settings.surprise * np.abs(state.u).max()
        for start in (near, state.u):
            if start is None:
                continue
            try:
                found = alone.newton(start, state.pressure_MPa)
            except ConvergenceError:
                continue
            if np.abs(found.u - state.u).max() <= limit:
                return found
        return alone.reach(state.pressure_MPa, [rest(self.model.mesh)])


class _Part:
    """Some elements of a body as a model of their own; `unknowns` (c,) are its free ones in the body's."""

    def __init__(self, model: Model, elements: Array) -> None:
        mesh = model.mesh
        self._nodes, tets = np.unique(mesh.tets[elements], return_inverse=True)
        none = np.empty(0, dtype=np.int32)
        part = Mesh(
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
        self.model = Model(part, number < 0, model.device, 1, model.mean_dilatation)
        self.unknowns = number.ravel()[self.model.free]

    def change(self, data: Any, u: Array) -> Change:
        """What materials given as a difference change of the tangent, at the body's displacement (n, 3)."""
        model = self.model
        values = model.tangent(u[self._nodes], 0.0, data)
        matrix = model.matrix(values)
        used = np.flatnonzero(np.abs(matrix).sum(axis=0))
        return Change(self.unknowns[used], matrix[used][:, used].tocsr())
