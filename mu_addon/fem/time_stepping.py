"""Time stepping of a body with history: instants in order, each converged step committed to it."""

from __future__ import annotations

from collections.abc import Callable

import attrs
import numpy as np

from ..arrays import Array
from ..design.quantity import in_kPa, in_MPa
from ..errors import ConvergenceError, InputError
from .equilibrium import Equilibrium
from .factor import IndefiniteError
from .state import State, rest
from .trajectory import Trajectory

# A state may lie this many predicted moves from its prediction: sliding and softening set in at once and
# change the stiffness by far more than elasticity does over a step.
LEAP = 4.0
# Below this share of an interval a step is not halved again.
SMALLEST = 1e-4
# Nor below this share of the largest step where the settings follow snaps: a smaller step is a snap.
SNAPS_BELOW = 1 / 16


@attrs.frozen(eq=False)
class Instant:
    """A converged state, its time in s, and the rate (n, 3) in mm/s at which it was reached, if any.

    contacts: memory of each of `Model.remembering`, see `Obstacle.kept`; history: of each law with one, see
    `MaterialData.kept`. Both are filled in for storage.
    """

    time_s: float
    state: State
    rate: Array | None = None
    contacts: tuple[dict[str, Array], ...] = ()
    history: tuple[Array, ...] = ()


def simulate_in_time(
    equilibrium: Equilibrium,
    time_s: Array,
    pressure_kPa: Array,
    on_state: Callable[[State], None] | None = None,
    max_step_s: float = np.inf,
    load: Callable[[int], Instant | None] = lambda number: None,
    store: Callable[[int, Instant], None] = lambda number, instant: None,
) -> Trajectory:
    """Equilibria of a body with history at k instants, time (k,) in s ascending and pressure (k,) in kPa.

    The body starts without history, at rest or at equilibrium with the model's load. The first instant's
    pressure is applied at once. Pressure is linear between instants, in steps of at most `max_step_s` and the
    settings' largest pressure step, halved if they do not converge. Obstacles with a path are moved to each
    step's time. If the settings follow snaps, a failing small step continues beyond the limit point, and the
    instant's state has `State.snapped_mm` > 0. `on_state` is called when its instant is the last that
    materials and contacts remember. `load` gives an instant of an earlier run by its number, if it kept one
    with `store`. Raises InputError where time runs backward, and ConvergenceError naming instant and cause.
    """
    time, pressure = np.asarray(time_s, float), in_MPa(np.asarray(pressure_kPa, float))
    if (np.diff(time) < 0).any():
        raise InputError(
            "time runs backward", f"instant {int(np.argmax(np.diff(time) < 0)) + 1} of the protocol"
        )
    equilibrium.model.forget(float(time[0]), equilibrium.parameters)
    last: Instant | None = None
    states = []
    contacts = equilibrium.model.remembering
    for number, (t, p) in enumerate(zip(time, pressure, strict=True)):
        kept = load(number)
        if kept is None:
            last = _interval(equilibrium, last or _start(equilibrium, time[0]), t, p, max_step_s)
            memory = equilibrium.parameters.kept()
            store(number, attrs.evolve(last, contacts=tuple(c.kept() for c in contacts), history=memory))
        else:
            last = kept
            equilibrium.model.move_obstacles(t)
            equilibrium.parameters.restore(kept.history)
            for contact, remembered in zip(contacts, kept.contacts, strict=True):
                contact.restore(kept.state.u, remembered)
        states.append(last.state)
        if on_state:
            on_state(last.state)
    return Trajectory(
        time,
        np.asarray(pressure_kPa, float),
        tuple(states),
        np.arange(len(states)),
        equilibrium.model.mesh,
    )


def _start(eq: Equilibrium, time: float) -> Instant:
    """Body before any pressure, its contacts with obstacles committed."""
    if eq.model.load is None:
        return Instant(time, rest(eq.model.mesh))
    state = eq.at_zero_pressure()
    eq.model.commit(state.u, eq.parameters)
    return Instant(time, state)


def _interval(eq: Equilibrium, start: Instant, time: float, pressure: float, max_step_s: float) -> Instant:
    """Step to an instant, in equal parts of the interval where one step is too large."""
    span, rise = time - start.time_s, pressure - start.state.pressure_MPa
    start = attrs.evolve(start, state=attrs.evolve(start.state, snapped_mm=0.0))
    if span == 0 and rise == 0:
        return start
    step_MPa = eq.settings.largest_step_MPa(start.state.pressure_MPa, pressure)
    largest = 1 / max(1.0, np.ceil(span / max_step_s), np.ceil(abs(rise) / step_MPa - 1e-9))
    last, done, step = start, 0.0, largest
    smallest = SNAPS_BELOW * largest if eq.settings.follow_snaps else SMALLEST
    while done < 1:
        step = min(step, 1 - done)
        # The last share ends on the instant itself, whatever rounding has left.
        share = 1.0 if 1 - done - step < SMALLEST / 2 else done + step
        target = pressure if share == 1 else start.state.pressure_MPa + share * rise
        instant = start.time_s + share * span
        try:
            snaps = eq.settings.follow_snaps and step / 2 < smallest
            last = (_step_or_snap if snaps else _step)(eq, last, instant, target)
        except ConvergenceError as why:
            step /= 2
            if step < smallest:
                raise ConvergenceError(
                    f"no equilibrium at {instant:.6g} s, {in_kPa(target):.4g} kPa: {why.what}",
                    f"the last converged state is at {last.time_s:.6g} s, {last.state.pressure_kPa:.4g} kPa",
                    "lower the pressure or its rate, thicken the wall or stiffen the material",
                ) from None
            continue
        done, step = share, min(2 * step, largest)
    return last


def _step(eq: Equilibrium, last: Instant, time: float, pressure: float) -> Instant:
    """Take one step, and commit it to the history of materials and contacts when it has converged."""
    m, u = eq.parameters, last.state.u
    m.dt_s = time - last.time_s
    eq.model.move_obstacles(time)
    if last.rate is not None and m.dt_s > 0:
        guess = u + m.dt_s * last.rate
    else:
        guess = _along_tangent(eq, u, pressure)
    try:
        state = eq.newton(eq.start(u, guess), pressure, _reach(eq, u, guess))
    except ConvergenceError:
        if last.rate is None:
            raise
        # Pressure may have reversed: the rate so far predicts nothing.
        guess = _along_tangent(eq, u, pressure)
        state = eq.newton(eq.start(u, guess), pressure, _reach(eq, u, guess))
    eq.model.commit(state.u, m)
    rate = (state.u - u) / m.dt_s if m.dt_s > 0 else None
    return Instant(time, attrs.evolve(state, snapped_mm=last.state.snapped_mm), rate)


def _step_or_snap(eq: Equilibrium, last: Instant, time: float, pressure: float) -> Instant:
    """Take a `_step`; if it finds no state nearby, the one that the body snaps to."""
    try:
        return _step(eq, last, time, pressure)
    except ConvergenceError:
        state = eq.snapped(last.state, pressure)
    eq.model.commit(state.u, eq.parameters)
    # The snap gives no rate for the next step.
    return Instant(time, state)


def _reach(eq: Equilibrium, u: Array, guess: Array) -> float:
    """Largest allowed distance in mm of a state from its prediction, the overlap with obstacles included."""
    return LEAP * (float(np.abs(guess - u).max()) + eq.model.deepest_mm(guess))


def _along_tangent(eq: Equilibrium, u: Array, pressure: float) -> Array:
    """Predict by one Newton step from the last state, whose tangent must be definite."""
    model = eq.model
    values = model.tangent(u, pressure, eq.parameters)
    try:
        eq.factor.factor(values)
    except IndefiniteError:
        raise ConvergenceError("the state to start from is unstable") from None
    force = model.residual(u, pressure, eq.parameters).ravel()[model.free]
    return model.moved(u, -eq.factor.solve(force))
