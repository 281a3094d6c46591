"""Verdicts with the printed body as base, on data made by the printed body on another mesh.

    python -m benchmarks.body.diagnose_printed FOLDER [--only "clean;gravity"] [--refine 1.2] [--seed 1]
        [--low 0]

A unit of three chambers is bent through suction and pressure; each set hides effects of its print, of
memory, of its gauge or supply, two at once, or another mesh, and is diagnosed as `diagnose` does. All sets
have one protocol: the simulations of the first serve them all. Prints a row a set, with seconds by the clock
and of the processor.
"""

from __future__ import annotations

import json
import resource
import time
from argparse import Namespace
from collections.abc import Callable, Mapping
from pathlib import Path

import attrs
import numpy as np

from benchmarks.evidence.second_code.judging import verdict_on
from benchmarks.evidence.second_code.recording import Trial, instrument, read, write
from benchmarks.table import circumstances, options_of, print_head, print_row
from mu_addon.design.parameters import load_preset, to_toml
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_run import Run, run
from mu_addon.files import write_text
from mu_addon.meshing.settings import MeshSettings

LOW_kPa, HIGH_kPa = -10.0, 12.0
PRESSURES_kPa = np.arange(-12.0, 13.0)
UNIT = load_preset("mu-1.0x").evolve(name="mu-three-chambers", count=3)
# Standard deviation of the angle's noise.
NOISE_deg = 0.03
Array = np.ndarray
Drive = Callable[[Array, Array], Array]


def lagging(time_s: float) -> Drive:
    """What follows a pressure (n,) at times (n,) with a time of its own, by implicit steps."""

    def follow(t: Array, p: Array) -> Array:
        found = p.copy()
        for i, h in enumerate(np.diff(t), 1):
            found[i] = found[i - 1] + h / (time_s + h) * (p[i] - found[i - 1])
        return found

    return follow


def relaxed(t: Array, p: Array) -> Array:
    return 0.85 * p + 0.15 * lagging(8.0)(t, p)


@attrs.frozen
class Hidden:
    """What a set hides: an effect of the unit and its size, a change of the pressure, the mesh of its data.

    refine: None for that of all others. shut: the test whose valve is shut, with a leak in all others.
    """

    effect: str = ""
    size: float = 0.0
    drive: Drive = lambda t, p: p
    refine: float | None = None
    shut: str = ""


# Sizes in the units of the effects' parameters.
SETS = {
    "clean": Hidden(),
    "clean again": Hidden(),
    "other mesh": Hidden(refine=1.0),
    "finer mesh": Hidden(refine=1.4),
    "wall": Hidden("wall_thickness", 0.87),
    "stiffening": Hidden("strain_stiffening", 0.8),
    "layers": Hidden("anisotropy", 0.6),
    "asymmetry": Hidden("tension_compression_asymmetry", -0.3),
    "overcure": Hidden("overcure", 0.1),
    "skin": Hidden("skin_cure", 0.15),
    "clog": Hidden("clogged_chamber", 0.5),
    "gravity": Hidden("gravity", 1150.0),
    "obstacle": Hidden("contact", -1.0),
    "offset": Hidden(drive=lambda t, p: p - 0.8),
    "large offset": Hidden(drive=lambda t, p: p - 1.5),
    "gauge": Hidden(drive=lambda t, p: p * (1.0 + 0.12 * (1.0 - np.abs(p) / HIGH_kPa))),
    "supply": Hidden(drive=lambda t, p: np.minimum(p, 0.75 * HIGH_kPa)),
    "line": Hidden(drive=lagging(0.5)),
    "leak": Hidden(drive=lambda t, p: p / 1.25, shut="slow"),
    "resin": Hidden(drive=relaxed),
    "resin, overcure": Hidden("overcure", 0.1, relaxed),
    "resin, offset": Hidden(drive=lambda t, p: relaxed(t, p - 0.8)),
    "resin, obstacle": Hidden("contact", -1.0, relaxed),
}


def angles(hidden: Hidden, refine: float, low: float, folder: Path) -> tuple[Array, Array]:
    """Pressures (k,) in kPa and angles (k,) in degrees with what a set hides, as far as it goes; kept."""
    refine = hidden.refine or refine
    pressures = PRESSURES_kPa[PRESSURES_kPa >= 1.2 * low]
    kept = folder / f"angles-{hidden.effect or 'clean'}-{hidden.size:g}-{refine:g}-{low:g}.npy"
    if not kept.exists():
        body = Body(UNIT, MeshSettings(refine=refine), self_contact=True)
        found = run(Run(body, tuple(pressures.tolist()), (), hidden.effect, hidden.size))
        if not np.isfinite(found.values[0][(pressures >= low) & (pressures <= HIGH_kPa)]).all():
            raise SystemExit(f"{hidden.effect}: {found.why}")
        np.save(kept, found.values[0])
    bent = np.load(kept)
    return pressures[np.isfinite(bent)], bent[np.isfinite(bent)]


def trials(
    hidden: Hidden, rng: np.random.Generator, bent: tuple[Array, Array], low: float, high: float = HIGH_kPa
) -> list[Trial]:
    """Readings of a ladder, a slow and a fast wave of pressure, from `low` to `high` in kPa."""
    from scipy.interpolate import CubicSpline

    bends = CubicSpline(*bent)
    protocols = {
        "ladder": ([0, 20, 60, 100, 140, 180, 200], [0, high / 2, high / 2, high, low / 2, low, 0]),
        "slow": ([0, 40, 120, 200, 240], [0, high, low, high, 0]),
        "fast": ([0, 4, 12, 20, 28, 32], [0, high, low, high, low, 0]),
    }
    found = []
    for test, (times, levels) in protocols.items():
        fine = np.linspace(0.0, times[-1], 1991)
        p = np.interp(fine, times, levels)
        angle = bends(p if test == hidden.shut else hidden.drive(fine, p))
        columns = {"time_s": fine, "pressure_kPa": p, "angle_deg": angle}
        fields = {"specimen": "A", **({"valve": "shut"} if test == hidden.shut else {})}
        read_at = {name: values[::10] for name, values in columns.items()}
        found.append(Trial("unit_pressure", test, read_at, "angle_deg", 1.0, fields))
    by = instrument(rng, found)
    return [read(rng, test, str(rng.choice(["white", "slow"])), NOISE_deg, by) for test in found]


def main() -> None:
    """Make every set, have it diagnosed, and print a row each."""
    given = options(__doc__, SETS, 1.2, LOW_kPa)
    judge(given, SETS, HIGH_kPa, lambda hidden: angles(hidden, given.refine, given.low, given.folder))


def options(page: str | None, sets: Mapping[str, Hidden], refine: float, low: float) -> Namespace:
    """What is given: folder, sets, mesh of the data, seed and least pressure, whose folder is made."""
    parser = options_of(page)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default=";".join(sets), help="names of sets, apart by ;")
    parser.add_argument("--refine", type=float, default=refine, help="of the mesh that the data are of")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--low", type=float, default=low, help="least pressure, kPa")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    return given


def judge(
    given: Namespace,
    sets: Mapping[str, Hidden],
    high: float,
    bending: Callable[[Hidden], tuple[Array, Array]],
) -> None:
    """Print a row a set: its verdict on readings up to `high` in kPa, of a unit's `bending` as `angles`."""
    unit = given.folder / "unit.toml"
    write_text(unit, to_toml(UNIT))
    print(circumstances())
    print_head("set", "verdict", "causes, rivals", "by the clock, s", "of the processor, s")
    for name in given.only.split(";"):
        bent = bending(sets[name])
        data = given.folder / f"{name}-{given.refine:g}-{given.seed}-from{given.low:g}"
        if not data.exists():
            rng = np.random.default_rng([given.seed, list(sets).index(name)])
            write(data, trials(sets[name], rng, bent, given.low, high))
        began, used = time.time(), _processor_s()
        found = verdict_on(data, unit, given.folder / "diagnosis")
        write_text(given.folder / f"{data.name}.json", json.dumps(found, indent=1))
        causes = "; ".join(", ".join([c["effect"], *c["rivals"]]) for c in found["causes"])
        row = (name, found["verdict"], causes, f"{time.time() - began:.0f}", f"{_processor_s() - used:.0f}")
        print_row(*row)


def _processor_s() -> float:
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


if __name__ == "__main__":
    main()
