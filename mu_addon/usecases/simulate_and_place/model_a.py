"""Model A: the motion of a study's unit without a sensor, each state from the cache where it is there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...fem.equilibrium import Equilibrium
from ...fem.state import State
from ...fem.time_stepping import Instant, simulate_in_time
from ...fem.trajectory import Trajectory, simulate
from ...run.cache import Cache, key
from .contact_history import history
from .expected import work

if TYPE_CHECKING:
    from ...fem.model import Model
    from ...report.results import ContactHistory
    from .job import Job

Array = np.ndarray[Any, Any]


def solve_model_a(
    job: Job,
    cache: Cache,
    model: Model,
    samples: tuple[Array, Array],
    on_progress: Callable[[float, str], None],
    on_state: Callable[[State], None] = lambda _: None,
) -> tuple[Trajectory, ContactHistory | None]:
    """Motion of a model at samples of time (k,) in s and pressure (k,) in kPa, and contacts with obstacles.

    on_progress: called with the finished share and a text on each state, before on_state. Raises
    ConvergenceError.
    """
    if job.in_time:
        return _in_time(job, cache, model, samples, on_progress, on_state)
    time, pressure = samples
    materials = job.materials(model.mesh)
    # A state's last digits depend on the pressures visited before it.
    visited = np.unique(pressure)
    name = key(model.mesh.hash(), materials.hash(), visited, job.newton, *job.effects.parts)
    total, done = work(job, visited), 0.0
    body = Equilibrium(model, materials, job.newton)

    def keep(state: State) -> None:
        nonlocal done
        done += work(job, [state.pressure_kPa])
        least, _ = model.smallest_jacobian(state.u, body.parameters)
        words = f"{state.pressure_kPa:.4g} kPa, residual {state.residual:.1e}"
        words += f", {state.iterations} iterations, smallest det F {least:.2f}"
        on_progress(done / total if total else 1.0, words)
        on_state(state)

    def load(pressure_MPa: float) -> State | None:
        found = _entry(cache, "state", key(name, pressure_MPa), model)
        return None if found is None else _state(found)

    def store(state: State) -> None:
        cache.put("state", key(name, state.pressure_MPa), attrs.asdict(state, recurse=False))

    return simulate(body, time, pressure, keep, load=load, store=store), None


def _in_time(
    job: Job,
    cache: Cache,
    model: Model,
    samples: tuple[Array, Array],
    on_progress: Callable[[float, str], None],
    on_state: Callable[[State], None],
) -> tuple[Trajectory, ContactHistory | None]:
    """Motion instant by instant, since contact or wall has history."""
    time, pressure = samples
    name = _in_time_key(job, model, samples)
    contacts = []

    def keep(state: State) -> None:
        contacts.append([o.contact(state.u) for o in model.obstacles])
        words = f"{state.pressure_kPa:.4g} kPa"
        if job.obstacles:
            force = sum(float(np.linalg.norm(c.force_N)) for c in contacts[-1])
            words += f", contact {force:.3g} N"
        on_progress(len(contacts) / len(time), words)
        on_state(state)

    motion = simulate_in_time(
        Equilibrium(model, job.materials(model.mesh), job.newton),
        time,
        pressure,
        keep,
        load=lambda number: _instant(cache, key(name, number), model),
        store=lambda number, instant: cache.put("instant", key(name, number), _arrays(instant)),
    )
    touched = history(job.obstacles, model.mesh, time, pressure, contacts) if job.obstacles else None
    return motion, touched


def history_of_wall(job: Job, cache: Cache, model: Model) -> Callable[[int], Sequence[Array]]:
    """Function of an instant's number that returns the wall's history there; empty for an elastic one."""
    if not job.unit.wall.has_memory:
        return lambda number: ()
    name = _in_time_key(job, model, job.samples)

    def remembered(number: int) -> Sequence[Array]:
        kept = _instant(cache, key(name, number), model)
        return () if kept is None else kept.history

    return remembered


def _in_time_key(job: Job, model: Model, samples: tuple[Array, Array]) -> str:
    parts: list[Any] = [(o.depth_mm, o.stiffness, o.stick_stiffness, o.friction) for o in model.obstacles]
    if job.self_friction:
        parts.append(job.self_friction)
    return key(
        model.mesh.hash(),
        job.materials(model.mesh).hash(),
        *samples,
        job.newton,
        job.obstacles_text() or "",
        parts,
        *job.effects.parts,
    )


def _arrays(instant: Instant) -> dict[str, Any]:
    """An instant in the cache, see `_instant`."""
    arrays = attrs.asdict(instant.state, recurse=False) | {"time_s": instant.time_s}
    if instant.rate is not None:
        arrays["rate"] = instant.rate
    for number, memory in enumerate(instant.contacts):
        arrays |= {f"{number} {part}": values for part, values in memory.items()}
    return arrays | {f"history {number}": values for number, values in enumerate(instant.history)}


def _instant(cache: Cache, name: str, model: Model) -> Instant | None:
    found = _entry(cache, "instant", name, model)
    if found is None:
        return None
    contacts = [
        {part.partition(" ")[2]: a for part, a in found.items() if part.startswith(f"{number} ")}
        for number in range(len(model.remembering))
    ]
    memory = tuple(found[f"history {n}"] for n in range(len(found)) if f"history {n}" in found)
    return Instant(float(found["time_s"]), _state(found), found.get("rate"), tuple(contacts), memory)


def _entry(cache: Cache, kind: str, name: str, model: Model) -> dict[str, Array] | None:
    """Entry of the cache on a state of a model's mesh, or None."""
    found = cache.get(kind, name)
    fits = found is not None and found.get("u", np.empty(0)).shape == model.mesh.nodes.shape
    return found if fits else None


def _state(arrays: dict[str, Array]) -> State:
    return State(
        float(arrays["pressure_MPa"]),
        arrays["u"],
        float(arrays["residual"]),
        int(arrays["iterations"]),
        int(arrays["factorisations"]),
        float(arrays.get("snapped_mm", 0.0)),
    )
