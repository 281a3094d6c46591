"""A slender cantilever whose section is free: its stiffness is 3 E I/L^3, whatever the search believes."""

import attrs
import numpy as np

from mu_addon.fem.model import Model
from mu_addon.fem.relocated import relocated
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.search import Observed
from mu_addon.optimization.structure import WITHOUT, Structure, solve
from tests.fem.bodies import box, uniform

LENGTH, MODULUS = 40.0, 2.0


@attrs.frozen
class Volume:
    """Volume in mm3 of a body."""

    name: str
    conditions: tuple = ()

    def value(self, structure, states):
        return float(structure.model.volumes.sum())


class Cantilever:
    """A clamped bar along z, a wide along x and b high along y, of a modulus in MPa, without Poisson's
    effect."""

    def __init__(self, around=(1, 1, 16)):
        self.unit_box = box(around, (1.0, 1.0, 1.0), clamp=True)
        tip = np.flatnonzero(self.unit_box.nodes[:, 2] == 1.0)
        self.unit_box = attrs.evolve(self.unit_box, tip=tip)
        self.model = Model(self._mesh(2.0, 2.0), threads=1)
        self.shared = {}

    def _mesh(self, a, b):
        return attrs.evolve(self.unit_box, nodes=self.unit_box.nodes * [a, b, LENGTH])

    def at(self, a, b):
        mesh = self._mesh(a, b)
        return Structure(
            relocated(self.model, mesh),
            {WITHOUT: uniform(mesh, MODULUS, 0.0)},
            (a, b),
            shared=self.shared,
        )

    def observe(self, quantities, calls):
        """Designs (a, b) with all values and slopes, as the search takes them."""

        def one(design):
            calls.append(design)
            body = self.at(*design)
            states, _ = solve(body, {c for q in quantities for c in q.conditions})
            pairs = []
            for i in range(2):
                step = np.eye(2)[i] * 1e-4 * design[i]
                pairs.append(
                    lambda step=step, i=i: (
                        self.at(*(design + step)),
                        self.at(*(design - step)),
                        2 * step[i],
                    )
                )
            values = np.array([q.value(body, states) for q in quantities])
            return Observed(design, values, gradients(body, states, quantities, pairs))

        return lambda designs: [one(d) for d in designs]
