"""A joint learned from the unit's finite element model: free states, and loaded ones around them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError, InputError
from .joint import Joint, fitted
from .settings import LOADED, PRESSURE_STEP
from .unit_between_plates import PlateBody, PlateState

if TYPE_CHECKING:
    from ..design.parameters import Unit
    from ..meshing.mesh import Mesh


AXES = ("bend_x", "bend_y", "twist", "shear_x", "shear_y", "stretch")
# Sampled on both sides; the others' other side is the mirror image.
_BOTH_SIDES = (0, 4, 5)
# Number of retries, nearer to the free state, for a state that is not reached.
_TRIES = 3
# Corners that take no part in the fit, as shares of the range: bent while loaded, so that terms mix.
HELD_OUT = (
    (0.6, 0.5, -0.3, 0.4, -0.5, 0.4),
    (-0.6, 0.4, 0.5, -0.4, 0.4, -0.5),
)
# At pressures between those of the fit, nearer to the free state.
_BETWEEN = 0.5


def _share(low: float, high: float) -> Any:
    def check(_: object, field: attrs.Attribute[Any], value: float) -> None:
        if not low <= value <= high:
            raise InputError(f"{field.name} = {value:g}", "[joint]", f"choose {low:g} to {high:g}")

    return check


@attrs.frozen
class Sampling:
    """States from which a joint is learned.

    Range about the free state: bend_deg of the tip against the base, twist_deg about the axis, shear and
    stretch as shares of the height. Without `loaded` states the potential is quadratic, of the free states'
    stiffness alone.
    """

    bend_deg: float = attrs.field(default=25.0, validator=_share(1.0, 60.0))
    twist_deg: float = attrs.field(default=15.0, validator=_share(1.0, 60.0))
    shear: float = attrs.field(default=0.06, validator=_share(0.005, 0.3))
    stretch: float = attrs.field(default=0.04, validator=_share(0.005, 0.3))
    pressure_step_kPa: float = PRESSURE_STEP.field()
    loaded: bool = LOADED.field()

    def size(self, height: float) -> Array:
        """The range (6,) in rad and mm of a unit of a height in mm."""
        bend, twist = np.radians([self.bend_deg, self.twist_deg])
        shear, stretch = self.shear * height, self.stretch * height
        return np.array([bend, bend, twist, shear, shear, stretch])

    def pressures(self, low: float, high: float) -> Array:
        """Pressures in kPa, ascending, 0 among them, that cover a range in steps no longer than allowed."""
        low, high = min(low, 0.0), max(high, 0.0)
        below = np.linspace(low, 0.0, 1 + int(np.ceil(-low / self.pressure_step_kPa)))
        above = np.linspace(0.0, high, 1 + int(np.ceil(high / self.pressure_step_kPa)))
        return np.round(np.unique(np.concatenate([below, above])), 9)


@attrs.frozen(eq=False)
class Learned:
    """A joint, and its accuracy at held-out states.

    held_out: a row a state, with its pressure in kPa, the error of the load in N and N mm, and the
    placement's error in mm and degrees that it makes of the free tip. free_u: displacements (k, n, 3) of the
    free states. missed: states that were not reached, as text.
    """

    joint: Joint
    held_out: tuple[dict[str, float], ...]
    free_u: Array
    missed: tuple[str, ...] = ()

    @property
    def error_deg(self) -> float:
        """Root mean square of the held-out states' errors of rotation."""
        return _rms([row["angle_error_deg"] for row in self.held_out])

    @property
    def error_mm(self) -> float:
        """Root mean square of the held-out states' errors of place."""
        return _rms([row["place_error_mm"] for row in self.held_out])


def _rms(values: list[float]) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if values else float("nan")


Kept = Callable[[str], dict[str, Array] | None]
Keep = Callable[[str, dict[str, Array]], None]


def learn(
    name: str,
    unit: Unit,
    mesh: Mesh,
    pressures_kPa: Array,
    sampling: Sampling,
    density_g_per_ml: float,
    kept: Kept = lambda what: None,
    keep: Keep = lambda what, arrays: None,
    report: Callable[[float, str], None] = lambda share, words: None,
) -> Learned:
    """The joint of a unit at pressures (k,) in kPa, from equilibria of its whole mesh between rigid plates.

    At each pressure: the free state with its stiffness, and twelve or nine loaded ones, one a direction and
    side; mirror images are free. The error is that at held-out states: two corners of the range at every
    other pressure, and a free and a loaded state between pressures. kept and keep: a cache by the state's
    name. report: called with the share done and a text. Raises ConvergenceError where a free state is not
    there.
    """
    body = PlateBody(unit, mesh, density_g_per_ml)
    size = sampling.size(body.height)
    between = np.round((pressures_kPa[1:] + pressures_kPa[:-1]) / 2, 9)[::2]
    every = np.sort(np.concatenate([pressures_kPa, between]))
    directions = list(_directions()) if sampling.loaded else []
    total = len(every) + len(pressures_kPa) * len(directions) + len(pressures_kPa) + 1 + len(between)
    done = 0

    def tell(words: str) -> None:
        nonlocal done
        done += 1
        report(done / total, words)

    def from_cache(pressure: float) -> tuple[Array, PlateState] | None:
        found = kept(f"free {pressure:.9g}")
        return None if found is None else (found.pop("u"), _state(found))

    def to_cache(u: Array, state: PlateState) -> None:
        keep(f"free {state.pressure_kPa:.9g}", {"u": u, **_arrays(state)})
        tell(f"free at {state.pressure_kPa:.4g} kPa")

    free = body.free_path(every, from_cache, to_cache, step_kPa=5.0)
    missed: list[str] = []

    def loaded(pressure: float, y: Array, words: str) -> PlateState | None:
        """State at y (6,) of the range, or nearer to the free one; None where none was reached."""
        label = f"{words} {pressure:.9g}"
        found = kept(label)
        if found is None:
            u, at = free[pressure]
            for share in 0.5 ** np.arange(_TRIES):
                eta = at.eta + share * y * size
                try:
                    state = body.state(body.solved(u, at.eta, eta, pressure / 1e3), eta, pressure / 1e3)
                except ConvergenceError:
                    continue
                found = _arrays(state)
                break
            else:
                found = {"none": np.zeros(0)}
            keep(label, found)
        tell(f"{words} at {pressure:.4g} kPa")
        if "none" in found:
            missed.append(f"{words} at {pressure:g} kPa")
            return None
        return _state(found)

    fits = []
    held: list[PlateState] = []
    for k, pressure in enumerate(pressures_kPa.tolist()):
        states = [loaded(pressure, y, words) for y, words in directions]
        fits.append(fitted([s for s in states if s is not None], free[pressure][1], size))
        if k % 2 == 0:
            corners = [loaded(pressure, np.array(y), f"corner {i}") for i, y in enumerate(HELD_OUT)]
            held += [s for s in corners if s is not None]
    for k, pressure in enumerate(between.tolist()):
        corner = loaded(pressure, _BETWEEN * np.array(HELD_OUT[k % 2]), "between")
        held += [free[pressure][1], *([corner] if corner is not None else [])]
    joint = Joint(
        name,
        pressures_kPa,
        np.array([free[p][1].eta for p in pressures_kPa.tolist()]),
        size,
        mass_g=body.mass_g,
        **{key: np.array([fit[key] for fit in fits]) for key in fits[0]},
    )
    joint, rows = _checked(joint, held)
    free_u = np.array([free[p][0] for p in pressures_kPa.tolist()])
    return Learned(joint, rows, free_u, tuple(missed))


def _directions() -> Iterator[tuple[Array, str]]:
    for axis, name in enumerate(AXES):
        for side in (1.0, -1.0) if axis in _BOTH_SIDES else (1.0,):
            y = np.zeros(6)
            y[axis] = side
            yield y, f"{name} {'+' if side > 0 else '-'}"


def _checked(joint: Joint, held: list[PlateState]) -> tuple[Joint, tuple[dict[str, float], ...]]:
    """The joint with the error of its gradient at states held out, and a row about each of them."""
    rows, errors = [], []
    for state in held:
        at = joint.at(state.pressure_kPa)
        wrong = at.gradient(state.eta)[0] - state.gradient
        errors.append(np.outer(wrong, wrong))
        moved = np.linalg.solve(at.hessian(state.eta), wrong)
        rows.append(
            {
                "pressure_kPa": state.pressure_kPa,
                "range": float(at.used_range(state.eta)[0]),
                "moment_N_mm": float(np.linalg.norm(state.gradient[:3])),
                "moment_error_N_mm": float(np.linalg.norm(wrong[:3])),
                "force_N": float(np.linalg.norm(state.gradient[3:])),
                "force_error_N": float(np.linalg.norm(wrong[3:])),
                "angle_error_deg": float(np.degrees(np.linalg.norm(moved[:3]))),
                "place_error_mm": float(np.linalg.norm(moved[3:])),
            }
        )
    error = np.mean(errors, axis=0) if errors else np.zeros((6, 6))
    return attrs.evolve(joint, error=error), tuple(rows)


def _arrays(state: PlateState) -> dict[str, Array]:
    return {f.name: np.asarray(getattr(state, f.name)) for f in attrs.fields(PlateState)}


def _state(arrays: dict[str, Array]) -> PlateState:
    values: dict[str, Any] = {f.name: arrays[f.name] for f in attrs.fields(PlateState)}
    return PlateState(**{**values, "pressure_kPa": float(values["pressure_kPa"])})
