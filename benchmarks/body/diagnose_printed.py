"""Verdicts with the printed body as base, on data made by the printed body on another mesh.

    python -m benchmarks.body.diagnose_printed FOLDER [--only clean,gravity] [--refine 1.2] [--seed 1]
        [--low 0]

A unit of three chambers is bent through suction and pressure; each set hides one static effect or a gauge's
zero, and is diagnosed as `diagnose` does. All sets have one protocol: the
simulations of the first serve them all. Prints a row a set, with seconds by the clock and of the processor.
"""

from __future__ import annotations

import json
import resource
import time
from pathlib import Path

import attrs
import numpy as np

from benchmarks.evidence.second_code.judging import verdict_on
from benchmarks.evidence.second_code.recording import Trial, instrument, read, write
from benchmarks.table import circumstances, options_of, print_row
from mu_addon.design.parameters import Unit, load_preset, to_toml
from mu_addon.evidence.unit_body import Body
from mu_addon.evidence.unit_run import Run, run
from mu_addon.files import write_text
from mu_addon.meshing.settings import MeshSettings

LOW_kPa, HIGH_kPa = -10.0, 12.0
PRESSURES_kPa = tuple(np.arange(-12.0, 13.0).tolist())
UNIT = load_preset("mu-1.0x").evolve(name="mu-three-chambers", count=3)
# Standard deviation of the angle's noise.
NOISE_deg = 0.03
OFFSET = "pressure_offset"
# Hidden in each set: an effect and its size, in the unit of its parameter.
SETS: dict[str, tuple[str, float]] = {
    "clean": ("", 0.0),
    "offset": (OFFSET, 1.5),
    "wall": ("wall_thickness", 0.87),
    "stiffening": ("strain_stiffening", 0.8),
    "layers": ("anisotropy", 0.6),
    "asymmetry": ("tension_compression_asymmetry", -0.3),
    "overcure": ("overcure", 0.1),
    "skin": ("skin_cure", 0.15),
    "clog": ("clogged_chamber", 0.5),
    "gravity": ("gravity", 1150.0),
    "obstacle": ("contact", -1.0),
}


def small_unit() -> Unit:
    """The 1.0x preset with three chambers, for short runs of the judge."""
    unit = load_preset("mu-1.0x")
    return attrs.evolve(unit, name="mu-three-chambers", chambers=attrs.evolve(unit.chambers, count=3))


def angles(name: str, refine: float, folder: Path) -> np.ndarray:
    """Angles (k,) in degrees at `PRESSURES_kPa` with what a set hides, nan beyond equilibria; kept."""
    effect, size = SETS[name]
    if effect == OFFSET:
        effect, size = "", 0.0
    kept = folder / f"angles-{effect or 'clean'}-{size:g}-{refine:g}.npy"
    if not kept.exists():
        body = Body(UNIT, MeshSettings(refine=refine), self_contact=True)
        found = run(Run(body, PRESSURES_kPa, (), effect, size))
        if not np.isfinite(found.values[0][np.abs(PRESSURES_kPa) <= -LOW_kPa]).all():
            raise SystemExit(f"{name}: {found.why}")
        np.save(kept, found.values[0])
    return np.asarray(np.load(kept))


def trials(name: str, rng: np.random.Generator, bent: np.ndarray, low: float = LOW_kPa) -> list[Trial]:
    """Readings of a ladder, a slow and a fast wave of pressure, from `low` in kPa."""
    from scipy.interpolate import CubicSpline

    reached = np.isfinite(bent)
    bends = CubicSpline(np.array(PRESSURES_kPa)[reached], bent[reached])
    high = HIGH_kPa
    protocols = {
        "ladder": ([0, 20, 60, 100, 140, 180, 200], [0, high / 2, high / 2, high, low / 2, low, 0]),
        "slow": ([0, 40, 120, 200, 240], [0, high, low, high, 0]),
        "fast": ([0, 4, 12, 20, 28, 32], [0, high, low, high, low, 0]),
    }
    found = []
    for test, (times, levels) in protocols.items():
        t = np.linspace(0.0, times[-1], 200)
        p = np.interp(t, times, levels)
        angle = bends(p - (SETS[name][1] if name == "offset" else 0.0))
        columns = {"time_s": t, "pressure_kPa": p, "angle_deg": angle}
        found.append(Trial("unit_pressure", test, columns, "angle_deg", 1.0, {"specimen": "A"}))
    by = instrument(rng, found)
    return [read(rng, test, str(rng.choice(["white", "slow"])), NOISE_deg, by) for test in found]


def main() -> None:
    """Make every set, have it diagnosed, and print a row each."""
    parser = options_of(__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--only", default=",".join(SETS))
    parser.add_argument("--refine", type=float, default=1.2, help="of the mesh that the data are of")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--low", type=float, default=LOW_kPa, help="least pressure, kPa")
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    unit = given.folder / "unit.toml"
    write_text(unit, to_toml(UNIT))
    print(circumstances())
    print(
        "| set | verdict | causes, rivals | by the clock, s | of the processor, s |\n" + "| --- " * 5 + "|",
        flush=True,
    )
    for name in given.only.split(","):
        bent = angles(name, given.refine, given.folder)
        data = given.folder / f"{name}-{given.refine:g}-{given.seed}-from{given.low:g}"
        if not data.exists():
            rng = np.random.default_rng([given.seed, list(SETS).index(name)])
            write(data, trials(name, rng, bent, given.low))
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
