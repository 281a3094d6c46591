"""Model A where contact or the wall's law has history: its motion instant by instant."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import ConvergenceError, MuError
from ..fem.equilibrium import Equilibrium
from ..fem.state import State
from ..fem.time_stepping import Instant, simulate_in_time
from ..report.results import ContactHistory
from ..run.cache import Cache, key
from .contact_history import history
from .mechanics import Mechanics, Samples

if TYPE_CHECKING:
    from ..fem.model import Model


@attrs.frozen(eq=False)
class InTime:
    """A motion instant by instant, as far as it was found; error: why not to its end.

    remembered: what the wall's law remembers at each instant; lost_mJ: what friction of the unit on itself
    has dissipated.
    """

    states: tuple[State, ...]
    contact: ContactHistory | None
    remembered: tuple[tuple[Array, ...], ...]
    lost_mJ: float = 0.0
    error: MuError | None = None

    @property
    def complete(self) -> bool:
        """True if the motion was found to its end."""
        return self.error is None


def solve_in_time(
    mechanics: Mechanics,
    equilibrium: Equilibrium,
    samples: Samples,
    cache: Cache,
    on_progress: Callable[[float, str], None],
) -> InTime:
    """Motion of a unit without a sensor through a protocol; each instant is kept in the cache.

    on_progress: called with the finished share and a text on each state.
    """
    model, time = equilibrium.model, samples.time_s
    friction = [o.friction for o in mechanics.obstacles]
    stiff = [(o.depth_mm, o.stiffness, o.stick_stiffness) for o in model.obstacles]
    name = key(
        model.mesh.hash(), mechanics.hash(), time, samples.pressure_kPa, mechanics.newton, stiff, friction
    )
    contacts, states = [], list[State]()
    remembered = list[tuple[Array, ...]]()

    def keep(state: State) -> None:
        states.append(state)
        contacts.append([o.contact(state.u) for o in model.obstacles])
        words = f"{state.pressure_kPa:.4g} kPa"
        if model.obstacles:
            force = sum(float(np.linalg.norm(c.force_N)) for c in contacts[-1])
            words += f", contact {force:.3g} N"
        on_progress(len(states) / len(time), words)

    def load(number: int) -> Instant | None:
        found = _instant(cache, key(name, number), model)
        if found is not None:
            remembered.append(found.history)
        return found

    def store(number: int, instant: Instant) -> None:
        remembered.append(instant.history)
        cache.put("instant", key(name, number), _arrays(instant))

    error = None
    try:
        simulate_in_time(equilibrium, time, samples.pressure_kPa, keep, load=load, store=store)
    except ConvergenceError as found:
        error = found
    count = len(states)
    met = mechanics.obstacles
    touched = history(met, model.mesh, time[:count], samples.pressure_kPa[:count], contacts) if met else None
    itself = model.self_contact
    # Of the whole unit, as the forces are.
    lost = 2.0 ** len(model.mesh.symmetry) * itself.lost_mJ if itself and mechanics.self_friction else 0.0
    return InTime(tuple(states), touched, tuple(remembered[:count]), lost, error)


def _arrays(instant: Instant) -> dict[str, Any]:
    """An instant in the cache, see `_instant`."""
    arrays = attrs.asdict(instant.state, recurse=False) | {"time_s": instant.time_s}
    if instant.rate is not None:
        arrays["rate"] = instant.rate
    for number, memory in enumerate(instant.contacts):
        arrays |= {f"{number} {part}": values for part, values in memory.items()}
    return arrays | {f"history {number}": values for number, values in enumerate(instant.history)}


def _instant(cache: Cache, name: str, model: Model) -> Instant | None:
    found = cache.get("instant", name)
    if found is None or found.get("u", np.empty(0)).shape != model.mesh.nodes.shape:
        return None
    contacts = [
        {part.partition(" ")[2]: a for part, a in found.items() if part.startswith(f"{number} ")}
        for number in range(len(model.remembering))
    ]
    memory = tuple(found[f"history {n}"] for n in range(len(found)) if f"history {n}" in found)
    return Instant(float(found["time_s"]), _state(found), found.get("rate"), tuple(contacts), memory)


def _state(arrays: dict[str, Array]) -> State:
    return State(
        float(arrays["pressure_MPa"]),
        arrays["u"],
        float(arrays["residual"]),
        int(arrays["iterations"]),
        int(arrays["factorisations"]),
        float(arrays.get("snapped_mm", 0.0)),
    )
