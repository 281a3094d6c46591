"""Units in series: equilibria of joints between rigid plates, under pressures, weight and loads."""

from __future__ import annotations

from collections.abc import Sequence

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError, InputError
from ..fem.rotations import rotation, skew
from .joint import MOST_RANGE, Joint, JointAt
from .rigid_motion import exponential, inverse, motion, rotation_vector, slope
from .unit_between_plates import frame, relative

GRAVITY_N_PER_G = 9.80665e-3
MOST_LINKS = 64
# Newton's method has converged where no plate moves by more, in radians and in shares of a unit's length.
_CONVERGED = 1e-9
_MOST_ITERATIONS = 60
# Of the tangent's central differences, in radians and shares of a unit's length.
_STEP = 1e-5
_LONGEST_STEP = 0.3
# A step along a path is halved down to this share.
_LEAST_SHARE = 1e-3


@attrs.frozen(eq=False)
class Link:
    """One unit of a chain: its joint, and its rotation about its axis against the chain's frame."""

    joint: Joint
    turn_deg: float = 0.0


@attrs.frozen(eq=False)
class Loads:
    """Loads on a chain besides pressure, in the frame of its base.

    down (3,): direction of gravity, of length 1, or 0 without gravity. tip_mass_g hangs at the middle of the
    tip's plate. tip_force_N (3,) and tip_couple_N_mm (3,) keep their direction; a couple in space has no
    potential and makes the tangent unsymmetric.
    """

    down: Array = attrs.field(factory=lambda: np.zeros(3))
    tip_mass_g: float = 0.0
    tip_force_N: Array = attrs.field(factory=lambda: np.zeros(3))
    tip_couple_N_mm: Array = attrs.field(factory=lambda: np.zeros(3))

    def times(self, share: float) -> Loads:
        """A share of all of them."""
        return Loads(
            share * np.asarray(self.down, float),
            self.tip_mass_g,
            share * np.asarray(self.tip_force_N, float),
            share * np.asarray(self.tip_couple_N_mm, float),
        )


@attrs.frozen(eq=False)
class ChainState:
    """An equilibrium of a chain of n units, in the frame of its base.

    pressures_kPa (n,); plates (n + 1, 4, 4): the base's frame and those of each unit's tip plate. eta (n, 6):
    of the units, each in its rotated frame. used_range (n,): share of the joint's range. covariance (6, 6):
    of the tip's rotation in rad and place in mm, from the joints' errors.
    """

    pressures_kPa: Array
    plates: Array
    eta: Array
    used_range: Array
    covariance: Array
    iterations: int = 0

    @property
    def tip_mm(self) -> Array:
        """Place (3,) of the tip plate's middle."""
        return np.asarray(self.plates[-1, :3, 3])

    @property
    def rotation_vector_deg(self) -> Array:
        """Rotation (3,) of the tip's plate against the base, as a vector."""
        return np.degrees(rotation_vector(self.plates[-1, :3, :3]))

    @property
    def angle_deg(self) -> float:
        """Angle between the axes of tip and base in degrees, from 0 to 180."""
        return float(np.degrees(np.arccos(np.clip(self.plates[-1, 2, 2], -1.0, 1.0))))

    @property
    def tip_error_mm(self) -> Array:
        """Half width (3,) of the 95 % interval of the tip's place, by the joints' errors."""
        return np.asarray(1.96 * np.sqrt(np.maximum(np.diag(self.covariance)[3:], 0.0)))

    @property
    def angle_error_deg(self) -> float:
        """Half width of the 95 % interval of the tip's rotation."""
        return float(1.96 * np.degrees(np.sqrt(max(np.trace(self.covariance[:3, :3]), 0.0))))


class Chain:
    """Equilibria of units in series; the base's plate is fixed, its frame is the chain's.

    links: from the base on. loads: as `Loads`. Raises InputError where there is no unit, or too many.
    """

    def __init__(self, links: Sequence[Link], loads: Loads | None = None) -> None:
        if not 1 <= len(links) <= MOST_LINKS:
            raise InputError(f"a chain of {len(links)} units", "units", f"give 1 to {MOST_LINKS}")
        self.links = tuple(links)
        self.loads = loads or Loads()
        self._turns = np.array([frame(link.turn_deg) for link in self.links])
        length = [link.joint.rest_length_mm() for link in self.links]
        self._unit_mm = float(np.mean(length))
        one = np.array([1.0, 1.0, 1.0, *[self._unit_mm] * 3])
        self._size = np.tile(one, len(self.links))

    # The potential and its derivatives.

    def potential(self, plates: Array, at: Sequence[JointAt], loads: Loads) -> float:
        """Potential in mJ of plates (n + 1, 4, 4), without the tip's couple, which has no potential."""
        total = 0.0
        down = np.asarray(loads.down, float) * GRAVITY_N_PER_G
        for link, joint, base, tip in zip(self.links, at, plates, plates[1:], strict=False):
            turn = frame(link.turn_deg)
            eta = relative(base @ turn, tip @ turn)
            centre = (base @ turn)[:3, :3] @ joint.centre_of_mass(eta)[0] + base[:3, 3]
            total += float(joint.potential(eta)[0]) - link.joint.mass_g * float(down @ centre)
        pull = np.asarray(loads.tip_force_N, float) + loads.tip_mass_g * down
        return total - float(pull @ plates[-1, :3, 3])

    def residual(self, plates: Array, at: Sequence[JointAt], loads: Loads) -> Array:
        """Gradient (6 n,) of the potential: of each plate the moments in N mm, and the forces in N."""
        n = len(self.links)
        found = np.zeros((n + 1, 6))
        for i in range(n):
            part = self._of_joint(i, at[i], plates[None, i], plates[None, i + 1], loads)[0]
            found[i] += part[:6]
            found[i + 1] += part[6:]
        found[-1] -= self._tip(loads)
        return np.asarray(found[1:].ravel())

    def tangent(self, plates: Array, at: Sequence[JointAt], loads: Loads) -> Array:
        """Change (6 n, 6 n) of the residual with plates that turn in space and move, by central differences.

        Symmetric in equilibrium, but for a couple in space.
        """
        n = len(self.links)
        found = np.zeros((6 * n + 6, 6 * n + 6))
        steps = _STEP * np.array([1.0, 1.0, 1.0, *[self._unit_mm] * 3])
        base_moves, tip_moves = _moves(steps)
        for i in range(n):
            base, tip = moved(plates[i], base_moves), moved(plates[i + 1], tip_moves)
            values = self._of_joint(i, at[i], base, tip, loads)
            block = ((values[:12] - values[12:]) / (2 * np.tile(steps, 2)[:, None])).T
            found[6 * i : 6 * i + 12, 6 * i : 6 * i + 12] += block
        return found[6:, 6:]

    def _of_joint(self, i: int, joint: JointAt, base: Array, tip: Array, loads: Loads) -> Array:
        """Gradients (m, 12) of one unit's potential and weight by its base's and tip's rotation and place."""
        down = np.asarray(loads.down, float) * GRAVITY_N_PER_G
        mass = self.links[i].joint.mass_g
        base, tip = base @ self._turns[i], tip @ self._turns[i]
        r = base[:, :3, :3]
        eta = relative(base, tip)
        own_down = np.einsum("mij,i->mj", r, down)
        of_eta = joint.gradient(eta) - mass * np.einsum("mj,mjk->mk", own_down, joint.centre_gradient(eta))
        wrench = np.linalg.solve(np.swapaxes(slope(eta), -1, -2), of_eta[:, :, None])[:, :, 0]
        away = tip[:, :3, 3] - base[:, :3, 3]
        force = np.einsum("mij,mj->mi", r, wrench[:, 3:])
        # About the tip, where a spatial wrench is about the base.
        moment = np.einsum("mij,mj->mi", r, wrench[:, :3]) - np.cross(away, force)
        centre = np.einsum("mij,mj->mi", r, joint.centre_of_mass(eta))
        weight = mass * np.broadcast_to(down, centre.shape)
        return np.concatenate(
            [-moment - np.cross(away, force) - np.cross(centre, weight), -force - weight, moment, force],
            axis=1,
        )

    def _tip(self, loads: Loads) -> Array:
        pull = np.asarray(loads.tip_force_N, float)
        pull = pull + loads.tip_mass_g * GRAVITY_N_PER_G * np.asarray(loads.down, float)
        return np.concatenate([np.asarray(loads.tip_couple_N_mm, float), pull])

    # Equilibria.

    def joints_at(self, pressures_kPa: Array) -> list[JointAt]:
        """Every joint at its pressure (n,) in kPa; raises InputError beyond the range of one."""
        p = np.asarray(pressures_kPa, float)
        if p.shape != (len(self.links),):
            raise InputError(
                f"{p.size} pressures for {len(self.links)} units", "pressures", "give one for each unit"
            )
        return [link.joint.at(float(value)) for link, value in zip(self.links, p, strict=True)]

    def free_plates(self, pressures_kPa: Array) -> Array:
        """Plates (n + 1, 4, 4) under the pressures (n,) in kPa alone."""
        return self.plates_of(np.array([joint.eta0 for joint in self.joints_at(pressures_kPa)]))

    def plates_of(self, eta: Array) -> Array:
        """Plates (n + 1, 4, 4) of the units' logarithms (n, 6)."""
        plates = [np.eye(4)]
        for turn, one in zip(self._turns, eta, strict=True):
            plates.append(plates[-1] @ turn @ exponential(one) @ inverse(turn))
        return np.array(plates)

    def newton(self, start: Array, pressures_kPa: Array, loads: Loads | None = None) -> ChainState:
        """The stable equilibrium at pressures (n,) in kPa from plates (n + 1, 4, 4) nearby.

        Raises ConvergenceError if there is no equilibrium, it is unstable, or a unit is loaded beyond the
        range of its joint.
        """
        loads = self.loads if loads is None else loads
        at = self.joints_at(pressures_kPa)
        plates = start
        couple = np.concatenate([np.asarray(loads.tip_couple_N_mm, float), np.zeros(3)])
        for iteration in range(1, _MOST_ITERATIONS + 1):
            r = self.residual(plates, at, loads)
            k = self.tangent(plates, at, loads)
            symmetric = (k + k.T) / 2 * np.outer(self._size, self._size)
            least, largest = np.linalg.eigvalsh(symmetric)[[0, -1]]
            definite = least > 1e-12 * largest
            shift = 0.0 if definite else 1e-3 * largest - 2 * min(least, 0.0)
            step = -np.linalg.solve(k + np.diag(shift / self._size**2), r)
            length = float(np.abs(step / self._size).max())
            if length < _CONVERGED:
                if not definite:
                    raise ConvergenceError("the chain is unstable there", "chain", "load it less")
                return self._found(pressures_kPa, plates, at, k, iteration)
            inner = self._of_units(plates, step) / self._size[:6]
            step *= min(1.0, _LONGEST_STEP / max(float(np.abs(inner).max()), 1e-300))
            plates = self._searched(plates, step, r, at, loads, couple)
        raise ConvergenceError("no equilibrium of the chain was found", "chain", "load it less")

    def _searched(
        self, plates: Array, step: Array, r: Array, at: Sequence[JointAt], loads: Loads, couple: Array
    ) -> Array:
        """Plates after as much of a step (6 n,) as lowers the potential."""
        before = self.potential(plates, at, loads)
        work = float(couple @ step[-6:])
        slope_ = float(r @ step)
        share = 1.0
        while share > 1e-6:
            there = self.moved(plates, share * step)
            gain = self.potential(there, at, loads) - share * work - before
            # Near the end gains drown in the rounding of the potential.
            if gain <= 1e-4 * share * slope_ + 1e-12 * abs(before):
                return there
            share /= 2
        return self.moved(plates, share * step)

    def moved(self, plates: Array, step: Array) -> Array:
        """Plates (n + 1, 4, 4) after a step (6 n,): of each, a rotation vector in space and a way in mm.

        The units' logarithms take the step, so that a long one turns units without stretching them.
        """
        return self.plates_of(self._eta(plates) + self._of_units(plates, step))

    def _eta(self, plates: Array) -> Array:
        """Logarithms (n, 6) of the units between plates (n + 1, 4, 4), each in its turned frame."""
        return relative(plates[:-1] @ self._turns, plates[1:] @ self._turns)

    def _of_units(self, plates: Array, step: Array) -> Array:
        """Change (n, 6) of the units' logarithms with a step (6 n,) of the plates."""
        whole = np.concatenate([np.zeros(6), step])
        rows = [self.eta_rows(i, plates) @ whole[6 * i : 6 * i + 12] for i in range(len(self.links))]
        return np.array(rows)

    def _found(
        self, pressures_kPa: Array, plates: Array, at: Sequence[JointAt], k: Array, iterations: int
    ) -> ChainState:
        eta = self._eta(plates)
        used = np.array([float(joint.used_range(one)[0]) for joint, one in zip(at, eta, strict=True)])
        if used.max() > MOST_RANGE:
            worst = int(used.argmax())
            raise ConvergenceError(
                f"unit {worst + 1} would be loaded {used[worst]:.2g} times as far as its joint was learned",
                f"unit {worst + 1}, at {pressures_kPa[worst]:.4g} kPa",
                "load the chain less, or learn the joint on a wider range ([joint] bend_deg, shear, stretch)",
            )
        return ChainState(
            np.array(pressures_kPa, float), plates, eta, used, self._covariance(plates, k), iterations
        )

    def _covariance(self, plates: Array, k: Array) -> Array:
        """Covariance (6, 6) of the tip's plate by the errors of the joints, independent between units."""
        n = len(self.links)
        spread = np.zeros((6 * n + 6, 6 * n + 6))
        for i, link in enumerate(self.links):
            rows = self.eta_rows(i, plates)
            spread[6 * i : 6 * i + 12, 6 * i : 6 * i + 12] += rows.T @ link.joint.error @ rows
        tip = np.linalg.solve(k.T, np.eye(6 * n)[:, -6:])
        return np.asarray(tip.T @ spread[6:, 6:] @ tip)

    def eta_rows(self, i: int, plates: Array) -> Array:
        """Change (6, 12) of unit i's logarithm with its base's and tip's rotation in space and place."""
        base, tip = plates[i] @ self._turns[i], plates[i + 1] @ self._turns[i]
        r, away = base[:3, :3], tip[:3, 3] - base[:3, 3]
        omega = np.hstack([-r.T, np.zeros((3, 3)), r.T, np.zeros((3, 3))])
        move = np.hstack([r.T @ skew(away), -r.T, np.zeros((3, 3)), r.T])
        velocity = move + skew(r.T @ away) @ omega
        eta = relative(base, tip)
        return np.asarray(np.linalg.solve(slope(eta), np.vstack([omega, velocity])))

    def at_rest(self) -> ChainState:
        """The state without pressure under the chain's loads. Raises ConvergenceError."""
        p = np.zeros(len(self.links))
        return self._along(p, p, self.newton(self.free_plates(p), p, self.loads.times(0.0)), from_loads=0.0)

    def reach(self, state: ChainState, pressures_kPa: Array) -> ChainState:
        """The state at other pressures (n,) in kPa, in steps from a known one. Raises ConvergenceError."""
        return self._along(state.pressures_kPa, np.asarray(pressures_kPa, float), state, from_loads=1.0)

    def path(self, pressures_kPa: Array) -> list[ChainState]:
        """States at each row of pressures (t, n) in kPa in order, from the loaded chain at 0. As `reach`."""
        state = self.at_rest()
        found = []
        for row in np.asarray(pressures_kPa, float):
            state = self.reach(state, row)
            found.append(state)
        return found

    def _along(self, before: Array, after: Array, state: ChainState, from_loads: float) -> ChainState:
        share, step = 0.0, 1.0
        while share < 1.0:
            to = min(1.0, share + step)
            here, there = (before + s * (after - before) for s in (share, to))
            shift = [
                b.eta0 - a.eta0 for a, b in zip(self.joints_at(here), self.joints_at(there), strict=True)
            ]
            guess = self.plates_of(state.eta + np.array(shift))
            try:
                loads = self.loads.times(from_loads + to * (1 - from_loads))
                state = self.newton(guess, there, loads)
            except ConvergenceError:
                step /= 2
                if step < _LEAST_SHARE:
                    raise
                continue
            share = to
        return state

    def slope_of_tip(self, state: ChainState, step_kPa: float = 0.05) -> Array:
        """Change (6, n) of the tip's rotation in rad and place in mm with each pressure, a kPa.

        From the tangent and the residual's change with pressure, by differences within the joints' pressures.
        """
        k = self.tangent(state.plates, self.joints_at(state.pressures_kPa), self.loads)
        changes = []
        for i, link in enumerate(self.links):
            low, high = link.joint.pressure_kPa[[0, -1]]
            p = state.pressures_kPa[i]
            ends = [max(low, p - step_kPa), min(high, p + step_kPa)]
            values = []
            for end in ends:
                at = state.pressures_kPa.copy()
                at[i] = end
                values.append(self.residual(state.plates, self.joints_at(at), self.loads))
            changes.append((values[1] - values[0]) / (ends[1] - ends[0]))
        return np.asarray(-np.linalg.solve(k, np.array(changes).T)[-6:])


def moved(plate: Array, steps: Array) -> Array:
    """Plates (m, 4, 4): one (4, 4), turned about its middle by rotation vectors and moved, (m, 6)."""
    return motion(rotation(steps[:, :3]) @ plate[:3, :3], plate[:3, 3] + steps[:, 3:])


def _moves(steps: Array) -> tuple[Array, Array]:
    """Moves (24, 6) of a base and of a tip, one component at a time, forward and then back, of sizes (6,)."""
    one = np.zeros((12, 12))
    one[np.diag_indices(12)] = np.tile(steps, 2)
    both = np.vstack([one, -one])
    return both[:, :6], both[:, 6:]
