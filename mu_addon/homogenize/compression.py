"""A specimen compressed between rigid plates, step by step, at finite deformation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError, InputError
from ..fem.equilibrium import Equilibrium
from ..fem.factor import IndefiniteError
from ..fem.model import Model
from ..fem.state import lagrange
from .buckling import Loss, SymmetryBreakingModes, first_loss
from .specimen import Specimen
from .stress_strain_curve import Curve
from .strut_contact import StrutContact, first_strut_contact

Friction = Literal["slide", "stick"]

# Small first steps for the initial slope, then even ones up to the 40 % of the paper's tests.
STRAINS = (0.005, 0.02, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.35, 0.4)
# Steps are halved down to this strain.
SMALLEST_STEP = 5e-4
# Part of a strain over which the plate's pull on free nodes is measured for the first prediction.
_PROBE = 1e-5


@attrs.frozen(eq=False)
class Compressed:
    """A converged equilibrium: nominal strain, compression positive, and displacement of the eighth.

    u (n, 3) in mm. force_N: of the plates on the whole block, compression positive; energy_mJ: stored in it.
    residual: over the root sum of squares of all element forces; factorisations: their number.
    """

    strain: float
    u: Array
    force_N: float
    energy_mJ: float
    residual: float = 0.0
    factorisations: int = 0


@attrs.frozen(eq=False)
class Compression:
    """States of a specimen in ascending strain, the first at rest, and the limits of their validity.

    touch: first contact of struts, which the model neglects. loss: first buckling out of the block's
    symmetry, which is not followed. ended: why the path ends before the last requested strain, or "".
    """

    specimen: Specimen
    friction: Friction
    states: tuple[Compressed, ...]
    touch: StrutContact | None = None
    loss: Loss | None = None
    ended: str = ""

    @property
    def curve(self) -> Curve:
        """Nominal stress in MPa, and mean lateral stretches of the side faces' nodes, as a `Curve`."""
        s = self.specimen
        half, nodes = s.side_mm / 2, s.mesh.nodes
        sides = [np.flatnonzero(nodes[:, i] == nodes[:, i].max()) for i in range(2)]
        states = self.states[::-1]
        return Curve(
            stretch=[1 - state.strain for state in states],
            stress_MPa=[-state.force_N / s.side_mm**2 for state in states],
            lateral=[
                [1 + state.u[side, i].mean() / half for i, side in enumerate(sides)] for state in states
            ],
        )

    @property
    def valid_to_strain(self) -> float:
        """Nominal strain, compression positive, up to which contact and buckling play no part."""
        ends = [self.states[-1].strain]
        ends += [self.touch.strain] if self.touch else []
        ends += [self.loss.before] if self.loss else []
        return min(ends)

    @property
    def valid(self) -> Array:
        """True for each point (k,) of `curve`, in its order, that is no farther than `valid_to_strain`."""
        return np.array([state.strain <= self.valid_to_strain for state in self.states[::-1]])

    @property
    def why(self) -> str:
        """A sentence on where the curve stops being valid, and why."""
        reasons = []
        if self.loss:
            reasons.append(str(self.loss))
        if self.touch:
            reasons.append(f"at {100 * self.touch.strain:.3g} % {self.touch}; self-contact is not modelled")
        if self.ended:
            reasons.append(self.ended)
        if not reasons:
            reasons.append("the curve ends there; no struts touch each other or a plate")
        return f"valid to {100 * self.valid_to_strain:.3g} % nominal strain: {'; '.join(reasons)}"


@attrs.frozen(eq=False)
class Reached:
    """What a compression to a strain came to. ended: why the path ends at this state, before that strain."""

    state: Compressed
    ended: str = ""


@attrs.frozen(eq=False)
class Limits:
    """Where a test's assumptions end: see `Compression`."""

    touch: StrutContact | None
    loss: Loss | None


def compress(
    specimen: Specimen,
    strains: Sequence[float] = STRAINS,
    friction: Friction = "slide",
    *,
    threads: int = 2,
    stability: bool = True,
) -> Compression:
    """Equilibria at nominal strains in ascending order, compression positive, of a specimen between plates.

    friction: faces slide on the plates ("slide") or stick to them ("stick"), the bounds of real plates;
    neither lifts off. Equilibria keep the mirror planes of the block; `stability` asks where others branch
    off, for about as many factorisations again. A path that cannot be followed further ends, with the reason.
    Raises InputError for strains not ascending between 0 and 1 or an unknown friction, and ConvergenceError
    where there is no first state.
    """
    strains = [float(s) for s in strains]
    if not strains or not (np.diff([0.0, *strains, 1.0]) > 0).all():
        raise InputError(
            f"nominal strains {strains}", "compression test", "give them in ascending order between 0 and 1"
        )
    plates = Plates(specimen, friction, threads)
    reached: list[Reached] = []
    for strain in strains:
        reached.append(plates.reached(strain, reached))
        if reached[-1].ended:
            break
    # Its factor makes room for others.
    del plates
    limits = limits_of(specimen, friction, reached, threads, stability)
    return compression_of(specimen, friction, reached, limits)


def _followed(specimen: Specimen, reached: Sequence[Reached]) -> list[Compressed]:
    """The states from rest on, without one that a failed step repeats."""
    states = [Compressed(0.0, np.zeros_like(specimen.mesh.nodes), 0.0, 0.0)]
    for one in reached:
        if one.state.strain > states[-1].strain:
            states.append(one.state)
    return states


def limits_of(
    specimen: Specimen,
    friction: Friction,
    reached: Sequence[Reached],
    threads: int = 2,
    stability: bool = True,
) -> Limits:
    """Where struts meet, and with `stability` where the block buckles, on a path of states."""
    states = _followed(specimen, reached)
    strains, moves = [s.strain for s in states], [s.u for s in states]
    touch, loss = first_strut_contact(specimen.mesh, strains, moves), None
    if stability:
        # Only what comes before is of interest.
        count = len(states) if touch is None else int(np.searchsorted(strains, touch.strain)) + 1
        motions = SymmetryBreakingModes(specimen, _held(specimen, friction), threads)
        loss = first_loss(motions, strains[:count], moves[:count])
    return Limits(touch, loss)


def compression_of(
    specimen: Specimen, friction: Friction, reached: Sequence[Reached], limits: Limits
) -> Compression:
    """The test of a path's states and its limits."""
    states = tuple(_followed(specimen, reached))
    return Compression(specimen, friction, states, limits.touch, limits.loss, reached[-1].ended)


def _held(specimen: Specimen, friction: Friction) -> Array:
    """Supports (n, 3) on a plate that faces slide on or stick to; raises InputError for another friction."""
    if friction not in ("slide", "stick"):
        raise InputError(f"unknown friction {friction!r}", "compression test", "choose slide or stick")
    held = np.zeros(specimen.mesh.nodes.shape, bool)
    held[specimen.mesh.tip, 2] = True
    if friction == "stick":
        held[specimen.mesh.tip] = True
    return held


class Plates:
    """Two rigid plates that a specimen's faces slide on or stick to, and its equilibria between them.

    friction: "slide" or "stick". Raises InputError for another one.
    """

    def __init__(self, specimen: Specimen, friction: Friction, threads: int = 2) -> None:
        mesh = specimen.mesh
        self.specimen = specimen
        held = _held(specimen, friction)
        self.equilibrium = Equilibrium(Model(mesh, held, threads=threads), specimen.materials)
        self.rest = Compressed(0.0, np.zeros_like(mesh.nodes), 0.0, 0.0)

    def reached(self, strain: float, earlier: Sequence[Reached]) -> Reached:
        """The state at a nominal strain, from those before it; raises ConvergenceError if there is none."""
        state, failure = self.reach(strain, [self.rest, *(one.state for one in earlier)])
        if failure is not None and state is self.rest:
            raise failure
        return Reached(state, "" if failure is None else failure.what)

    def reach(
        self, strain: float, history: Sequence[Compressed]
    ) -> tuple[Compressed, ConvergenceError | None]:
        """The state at a nominal strain, from converged states before it, the last of them the nearest.

        Steps are halved until they converge near where they were predicted. Where the smallest fails, the
        last state that did converge, and the error that names strain and cause, which is None otherwise.
        """
        history = list(history[-3:])
        step = strain - history[-1].strain
        while history[-1].strain != strain:
            last = history[-1]
            step = min(step, strain - last.strain)
            # The last step ends on the strain itself, whatever rounding has left.
            target = strain if strain - last.strain - step < SMALLEST_STEP / 2 else last.strain + step
            try:
                state = self._newton(history, target)
            except ConvergenceError as why:
                step /= 2
                if step < SMALLEST_STEP:
                    return last, self._failure(last, target, why.what)
                continue
            history = [*history[-2:], state]
            step *= 2
        return history[-1], None

    def _newton(self, history: Sequence[Compressed], strain: float) -> Compressed:
        eq, last = self.equilibrium, history[-1]
        if len(history) > 1:
            u = lagrange([state.strain for state in history], [state.u for state in history], strain)
            guess = self._moved(u, strain)
        else:
            guess = self._along_tangent(last, strain)
        state = eq.newton(guess, 0.0, eq.settings.predictor_tolerance * np.abs(guess - last.u).max())
        model = eq.model
        # Four eighths of the block stand on a plate.
        force = -4 * float(model.residual(state.u, 0.0, eq.parameters)[self.specimen.mesh.tip, 2].sum())
        energy = 8 * model.potential(state.u, 0.0, eq.parameters)
        return Compressed(strain, state.u, force, energy, state.residual, state.factorisations)

    def _moved(self, u: Array, strain: float) -> Array:
        u = u.copy()
        u[self.specimen.mesh.tip, 2] = -strain * self.specimen.side_mm / 2
        return u

    def _along_tangent(self, last: Compressed, strain: float) -> Array:
        """Predict along the tangent, which must be definite: free nodes follow the plate."""
        eq, model = self.equilibrium, self.equilibrium.model
        try:
            eq.factor.factor(model.tangent(last.u, 0.0, eq.parameters))
        except IndefiniteError:
            raise ConvergenceError("the state to start from is unstable") from None
        # The whole step at once would turn the elements beside the plate inside out.
        probe = self._moved(last.u, last.strain + _PROBE)
        pull = model.residual(probe, 0.0, eq.parameters).ravel()[model.free] / _PROBE
        rate = (probe - last.u) / _PROBE
        rate.ravel()[model.free] -= eq.factor.solve(pull)
        return self._moved(last.u + (strain - last.strain) * rate, strain)

    def _failure(self, last: Compressed, strain: float, why: str) -> ConvergenceError:
        model, mesh = self.equilibrium.model, self.specimen.mesh
        least, element = model.smallest_jacobian(last.u, self.equilibrium.parameters)
        nodes = mesh.tets[element]
        x, y, z = (mesh.nodes[nodes] + last.u[nodes]).mean(axis=0)
        return ConvergenceError(
            f"no equilibrium at {100 * strain:.4g} % nominal strain: {why}",
            f"the last converged state is {100 * last.strain:.4g} %; its most distorted element is {element} "
            f"near ({x:.1f}, {y:.1f}, {z:.1f}) mm from the middle, with det F = {least:.3g}",
            "compress less or refine the mesh",
        )
