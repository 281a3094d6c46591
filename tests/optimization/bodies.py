"""A slender cantilever whose section is free: its stiffness is 3 E I/L^3, whatever the search believes."""

import attrs
import numpy as np

from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.fem.moved_nodes import relocated
from mu_addon.generators import value_of
from mu_addon.optimization.gradient import gradients
from mu_addon.optimization.quantities import RestStiffness
from mu_addon.optimization.search import Observed, Search, SearchSettings
from mu_addon.optimization.structure import Structure, solve
from tests.fem.bodies import box, uniform

LENGTH, MODULUS = 40.0, 2.0


def search_units(freedoms, targets, observe, start, settings=None):
    return value_of(Search(freedoms, targets, settings or SearchSettings()).steps(start), observe)


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
            uniform(mesh, MODULUS, 0.0),
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
            for i in range(len(design)):
                step = np.eye(len(design))[i] * 1e-4 * design[i]
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


@attrs.frozen
class Resin:
    """Mean of the moduli of a graded block's layers, over MODULUS: what its struts weigh, about."""

    name: str
    conditions: tuple = ()

    def value(self, structure, states):
        return float(np.mean(structure.about))


class GradedBlock(Cantilever):
    """A block clamped at one end whose layers along its length have moduli of their own, over MODULUS."""

    def __init__(self, layers):
        super().__init__((1, 2, 4 * layers))
        middle = self.unit_box.nodes[self.unit_box.corners].mean(axis=1)[:, 2]
        self.layer = np.minimum((middle * layers).astype(int), layers - 1)
        self.body = relocated(self.model, self._mesh(2.0, 2.0))

    def at(self, *factors):
        moduli = MODULUS * np.array(factors)[self.layer]
        materials = Materials.neo_hooke(moduli, np.zeros(len(moduli)))
        return Structure(self.body, materials, factors, shared=self.shared)


@attrs.frozen
class AxialStiffness(RestStiffness):
    """Force in N along the axis on a fold's inner edge for a mean displacement of 1 mm of it."""

    def _side(self, structure):
        mesh = structure.model.mesh
        weights = np.zeros_like(mesh.nodes)
        inner = np.flatnonzero(np.abs(np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1]) - INNER) < 1e-6)
        weights[inner, 2] = 1.0 / len(inner)
        return structure.model, weights


INNER, OUTER, POISSON = 8.0, 16.0, 0.3


class Fold(Cantilever):
    """A quarter of one flat fold of a bellows, an annular plate between two circles that do not turn.

    Clamped at the outer one; at the inner one, where it joins its mirror image, it moves along the axis
    alone. Its thickness is the one freedom.
    """

    def __init__(self):
        grid = box((8, 5, 1), (1.0, 1.0, 1.0))
        radius = INNER + (OUTER - INNER) * grid.nodes[:, 0]
        angle = np.pi / 2 * grid.nodes[:, 1]
        x, y = radius * np.cos(angle), radius * np.sin(angle)
        x[np.isclose(angle, np.pi / 2)] = y[np.isclose(angle, 0)] = 0.0
        flat = np.column_stack([x, y, grid.nodes[:, 2]])
        outer = np.flatnonzero(radius > OUTER - 1e-6)
        self.unit_box = attrs.evolve(grid, nodes=flat, base=outer, tip=outer, symmetry=("x", "y"))
        held = np.zeros(flat.shape, bool)
        held[np.abs(radius - INNER) < 1e-6, :2] = True
        self.model, self.shared = Model(self._mesh(1.0), held, threads=1), {}

    def _mesh(self, t):
        return attrs.evolve(self.unit_box, nodes=self.unit_box.nodes * [1.0, 1.0, t])

    def at(self, t):
        mesh = self._mesh(t)
        materials = uniform(mesh, MODULUS, POISSON)
        return Structure(relocated(self.model, mesh), materials, (t,), shared=self.shared)


def fold_stiffness(t):
    """Axial stiffness in N/mm of a whole fold of thickness t in mm, by Kirchhoff's plate theory.

    Under a force P the slope is r (A + B log r) + C/r with B = P/(4 pi D), and 0 on both circles.
    """
    b = 1 / (4 * np.pi * MODULUS * t**3 / 12 / (1 - POISSON**2))
    circles = np.array([INNER, OUTER])
    a, c = np.linalg.solve(np.column_stack([circles, 1 / circles]), -b * circles * np.log(circles))
    r = np.linspace(INNER, OUTER, 20_001)
    slope = r * (a + b * np.log(r)) + c / r
    return 1 / abs(((slope[1:] + slope[:-1]) / 2 * np.diff(r)).sum())
