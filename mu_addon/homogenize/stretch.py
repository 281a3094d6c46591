"""A periodic lattice stretched along an axis at finite strain, by an eighth of its cell."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError, InputError
from ..fem.factor import IndefiniteError
from ..fem.materials import Materials
from ..fem.self_intersection import crossings
from ..fem.state import lagrange
from ..meshing.mesh import AXES, Mesh
from .octant import Octant, require_factor
from .stress_strain_curve import Curve

# Of the residual over the root sum of squares of all element forces.
_TOLERANCE = 1e-9
_MOST_ITERATIONS, _MOST_BACKTRACKS = 30, 8
_SMALLEST_STEP = 1e-3
# How far from its prediction a state may lie, as a share of the predicted move.
_FROM_PREDICTION = 0.5
# Shares of the undeformed tangent that make an indefinite one definite.
_REGULARISATION = (0.0, 0.03, 0.3, 3.0, 30.0)
# How far a node may lie beyond the mirror plane it should stay behind, as a share of the cell.
_TOUCH = 1e-6


@attrs.frozen(eq=False)
class Point:
    """An equilibrium of the periodic lattice at a nominal strain.

    stretch (3,) and stress_MPa (3,): mean nominal ones along x, y and z; u (n, 3): displacement in mm of the
    eighth; residuals: of the search, relative.
    """

    strain: float
    stretch: Array
    stress_MPa: Array
    u: Array
    residuals: tuple[float, ...] = ()


@attrs.frozen(eq=False)
class Stretched:
    """Result of a virtual test: the curve, its points in the order of the curve, and why it stops early.

    stopped: where and why, "" where it reaches both ends.
    """

    curve: Curve
    points: tuple[Point, ...]
    stopped: str = ""


def stretch_lattice(
    mesh: Mesh,
    materials: Materials,
    strains: Sequence[float],
    on_point: Callable[[Point], None] | None = None,
) -> Stretched:
    """Tension and compression along z of a periodic lattice at nominal strains, by one eighth of its cell.

    Points are kept at the strains and at rest. mesh: the eighth, from 0 on; its sides stay plane, as the
    lattice's mirror planes demand, and a lattice that would buckle away from them does not. The curve ends
    where no stable equilibrium is found or walls meet; `stopped` gives the reason. on_point: called with each
    `Point`. Raises InputError for strains not above -1, and MeshingError where the undeformed cell is
    unstable.
    """
    if not len(strains) or min(strains) <= -1.0 or not np.isfinite(strains).all():
        raise InputError("no strains above -1 are asked for", "stretch", "give strains as -0.4 or 0.2")
    return Stretching(mesh, materials).run(strains, on_point)


class Stretching:
    """A periodic lattice under prescribed stretch along z; arguments as `stretch_lattice`.

    Raises MeshingError where the undeformed cell is unstable.
    """

    def __init__(self, mesh: Mesh, materials: Materials) -> None:
        self.octant = Octant(mesh, materials)
        self._part = self.octant.stretching
        self._affine = np.stack([self.octant.affine(np.diag(e)) for e in np.eye(3)], axis=1)
        # Of the two lateral stretches.
        self._along = self._affine[:, (0, 1)]
        self._rest = self.octant.tangent(np.zeros_like(mesh.nodes))[0]
        require_factor(self._part, self._rest)

    @property
    def rest(self) -> Point:
        """The undeformed lattice, at strain and stress 0."""
        return Point(0.0, np.ones(3), np.zeros(3), np.zeros_like(self.octant.mesh.nodes))

    def run(self, strains: Sequence[float], on_point: Callable[[Point], None] | None = None) -> Stretched:
        """The test from rest to the largest strain on either side; on_point is called with each `Point`."""
        rest = self.rest
        wanted = sorted(set(strains) - {0.0})
        compressed, why_compressed = self._side([s for s in wanted if s < 0][::-1], rest, on_point)
        pulled, why_pulled = self._side([s for s in wanted if s > 0], rest, on_point)
        points = (*compressed[::-1], rest, *pulled)
        curve = Curve(
            [p.stretch[2] for p in points],
            [p.stress_MPa[2] for p in points],
            [p.stretch[:2] for p in points],
        )
        return Stretched(curve, points, "; ".join(w for w in (why_compressed, why_pulled) if w))

    def _side(
        self, strains: Sequence[float], rest: Point, on_point: Callable[[Point], None] | None
    ) -> tuple[list[Point], str]:
        """Points at strains farther and farther from rest, and why they end early, or ""."""
        found: list[Point] = []
        path = [rest]
        for strain in strains:
            try:
                steps = self.reach(strain, path)
            except ConvergenceError as stop:
                return found, stop.what
            if meeting := self._first_contact([path[-1], *steps]):
                return found, meeting
            path = [*path, *steps][-3:]
            found.append(steps[-1])
            if on_point:
                on_point(steps[-1])
        return found, ""

    def reach(self, strain: float, history: Sequence[Point]) -> list[Point]:
        """The states on the way to a strain, from converged ones before it, the last of them the nearest.

        Raises ConvergenceError naming strain and cause where the smallest step fails.
        """
        path = list(history)
        step = strain - path[-1].strain
        while path[-1].strain != strain:
            last = path[-1]
            left = strain - last.strain
            target = strain if abs(left) <= abs(step) * (1 + 1e-9) else last.strain + step
            try:
                guess = self.predicted(path[-3:], target)
                reach = _FROM_PREDICTION * max(np.abs(guess[1] - last.u).max(), _TOLERANCE)
                path.append(self.equilibrium(target, *guess, reach_mm=reach))
            except ConvergenceError as why:
                if abs(target - last.strain) / 2 < _SMALLEST_STEP:
                    raise ConvergenceError(
                        f"no equilibrium beyond a strain of {last.strain:.3f}: {why.what}"
                    ) from None
                step = (target - last.strain) / 2
        return path[len(history) :]

    def equilibrium(self, strain: float, stretch: Array, u: Array, reach_mm: float = np.inf) -> Point:
        """Stable equilibrium at a strain from a start: stretches (3,) and displacement (n, 3) in mm.

        The start's sides must lie where its stretches put them. Raises ConvergenceError where elements
        invert, progress stops, the state is unstable, or lies farther from the start than `reach_mm`.
        """
        start = u
        energy = self._energy(u)
        if not np.isfinite(energy):
            raise ConvergenceError("the predicted state inverts an element")
        force, level = self._out_of_balance(u)
        levels = [level]
        definite = False
        for _ in range(_MOST_ITERATIONS):
            if level <= _TOLERANCE:
                if np.abs(u - start).max() > reach_mm:
                    raise ConvergenceError(
                        "the lattice snaps to a distant equilibrium (limit point or buckling)"
                    )
                # The last tangent was taken one quadratic step from here.
                if not definite and not self._factorised(u)[0]:
                    raise ConvergenceError("the equilibrium is unstable (limit point or buckling)")
                stress = force @ self._affine / self.octant.volume
                return Point(strain, stretch, stress, u, tuple(levels))
            definite, change, du = self._step(u, force)
            slope = float(force @ du.ravel())
            length = 1.0
            for _ in range(_MOST_BACKTRACKS):
                trial = u + length * du
                force_there, level_there = self._out_of_balance(trial)
                # Near the solution the energy's change drowns in rounding.
                if level_there < 0.5 * level:
                    energy = np.nan
                    break
                if np.isnan(energy):
                    energy = self._energy(u)
                energy_there = self._energy(trial)
                if energy_there <= energy + 1e-4 * length * slope:
                    energy = energy_there
                    break
                length /= 2
            else:
                raise ConvergenceError("the line search found no lower energy")
            stretch = stretch.copy()
            stretch[:2] += length * change
            u, force, level = trial, force_there, level_there
            levels.append(level)
        raise ConvergenceError(f"no convergence in {_MOST_ITERATIONS} iterations")

    def predicted(self, history: Sequence[Point], strain: float) -> tuple[Array, Array]:
        """Stretches (3,) and displacement (n, 3) in mm to start from at another strain.

        Along the tangent from one point, by Lagrange extrapolation from several. Raises ConvergenceError
        where the one point is unstable.
        """
        last = history[-1]
        if len(history) == 1:
            definite, solved, complement = self._factorised(last.u)
            if not definite:
                raise ConvergenceError("the state to start from is unstable")
            change = np.zeros(3)
            change[2] = strain - last.strain
            _, K = self.octant.tangent(last.u)
            pushed = K @ (self._affine @ change)
            lateral = np.linalg.solve(complement, solved.T @ pushed - self._along.T @ pushed)
            change[:2] = lateral
            du = self._part.solve(-pushed) - solved @ lateral + self._affine @ change
            return last.stretch + change, last.u + du.reshape(last.u.shape)
        strains = [point.strain for point in history]
        stretch = lagrange(strains, [point.stretch for point in history], strain)
        u = lagrange(strains, [point.u for point in history], strain)
        # Rounding must not move it, nor the sides off the planes they are on.
        stretch[2] = 1.0 + strain
        return stretch, np.where(self.octant.across, self.octant.mesh.nodes * (stretch - 1.0), u)

    def _energy(self, u: Array) -> float:
        return self.octant.model.potential(u, 0.0, self.octant.parameters)

    def _out_of_balance(self, u: Array) -> tuple[Array, float]:
        """Forces (3n,) in N on all nodes, and the residual over all element forces."""
        octant = self.octant
        force = octant.model.residual(u, 0.0, octant.parameters).ravel()
        # The mean force on a side, which a stretch's energy changes by.
        mean = force @ self._along / octant.box[:2]
        level = np.hypot(np.linalg.norm(force[self._part.free]), np.linalg.norm(mean))
        return force, float(level / octant.model.force_scale())

    def _factorised(self, u: Array) -> tuple[bool, Array, Array]:
        """Factorise at u, adding a share of the undeformed tangent's where indefinite; also True if none was
        added.

        Returns the coupling (f, l) solved for, and the factorised complement (l, l) of the stretches.
        """
        octant, part = self.octant, self._part
        at, _ = octant.tangent(u)
        for share in _REGULARISATION:
            values = at + share * self._rest if share else at
            try:
                part.factorise(values)
                coupling = octant.model.matrix(values) @ self._along
                solved = part.solve(coupling)
                complement = self._along.T @ coupling - coupling.T @ solved
                np.linalg.cholesky(complement)
            except (IndefiniteError, np.linalg.LinAlgError):
                continue
            return share == 0.0, solved, complement
        raise ConvergenceError("the tangent is far from definite")

    def _step(self, u: Array, force: Array) -> tuple[bool, Array, Array]:
        """Newton's step: True if the tangent was definite, change of the lateral stretches, and of u."""
        definite, solved, complement = self._factorised(u)
        inner = self._part.solve(-force)
        # The forces on the unknowns reach the stretches through the coupling that was solved for.
        change = np.linalg.solve(complement, -(force @ self._along) + force @ solved)
        du = inner - solved @ change + self._along @ change
        return definite, change, du.reshape(u.shape)

    def _first_contact(self, path: Sequence[Point]) -> str:
        """Position on a path, straight between states, where walls first meet, as text; "" if nowhere."""
        for before, after in itertools.pairwise(path):
            if not self._meeting(after.stretch, after.u):
                continue
            low, high = 0.0, 1.0
            while high - low > 1e-3:
                middle = (low + high) / 2
                state = [
                    a + middle * (b - a) for a, b in ((before.stretch, after.stretch), (before.u, after.u))
                ]
                low, high = (low, middle) if self._meeting(*state) else (middle, high)
            state = [a + high * (b - a) for a, b in ((before.stretch, after.stretch), (before.u, after.u))]
            strain = before.strain + high * (after.strain - before.strain)
            return f"walls touch at a strain of {strain:.3f}: {self._meeting(*state)}"
        return ""

    def _meeting(self, stretch: Array, u: Array) -> str:
        """Walls of the deformed lattice that intersect, as text, or "".

        An eighth meets its mirror images exactly where it crosses a mirror plane.
        """
        octant = self.octant
        x = octant.mesh.nodes + u
        beyond = np.maximum(-x, x - octant.box * stretch)
        node, axis = np.unravel_index(beyond.argmax(), beyond.shape)
        if beyond[node, axis] > _TOUCH * octant.box[axis]:
            place = ", ".join(f"{c:.2f}" for c in octant.mesh.nodes[node])
            return f"the wall that was at ({place}) mm touches its mirror image across {AXES[axis]}"
        found = crossings(octant.mesh, u)
        return str(found[0]) if found else ""
