"""Ten and a hundred candidate paths and the sensitivity map, in units of one Model A: one table, one run.

    python benchmarks/sweep.py [--refine 1.0] [--workers 2] [--alone 1]

A hundred paths: every straight run along the anchors' column between 16 stations a third of a cell
apart or so. `--alone N` also solves N candidates each for itself along its whole path, the way without
lockstep, and says how far the answers are apart.
"""

from __future__ import annotations

import argparse
import itertools
import time
from contextlib import closing

import numpy as np
from circumstances import circumstances

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.assets import asset_root
from mu_addon.design.parameters import load_preset
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.protocol import read_protocol
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.candidates import Candidate, candidate_paths, moved_points, roi, with_sensor
from mu_addon.placement.sampling import solution_order
from mu_addon.placement.sensitivity_map import influence_map, representative_pressures
from mu_addon.usecases.simulate_and_place.candidate_pool import CandidatePool, CandidateProblem

RADIUS_MM, SENSOR_MPA = 1.0, 2.5


def hundred(points):
    """Straight runs of the anchors' column, as candidates of two ends each."""
    along = np.linspace(0.0, 1.0, 16)[:, None]
    stations = points[0] + along * (points[-1] - points[0])
    pairs = [(a, b) for a, b in itertools.combinations(range(16), 2) if b - a > 1]
    return [Candidate(f"run{a}-{b}", a + 1, stations[[a, b]]) for a, b in pairs][:100]


def beside(sweeper, equilibrium, times, pressure, wanted):
    """Model A, and the candidates at the wanted pressures in MPa as soon as it has reached them."""

    def submit(state):
        if state.pressure_MPa in wanted:
            sweeper.submit((state,), 0)

    found = simulate(equilibrium, times, pressure, submit)
    return dict(sweeper.solve([((s,), 0) for s in found.solved if s.pressure_MPa in wanted]))


def seconds(call):
    start = time.perf_counter()
    found = call()
    return time.perf_counter() - start, found


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--refine", type=float, default=1.0)
    options.add_argument("--workers", type=int, default=2)
    options.add_argument("--alone", type=int, default=1)
    given = options.parse_args()
    print(circumstances())
    unit = load_preset("mu-1.0x")
    mesh = mesh_unit(unit, MeshSettings(refine=given.refine))
    materials = materials_of(unit, mesh)
    points = anchor_points(unit)
    monitored = points, probe(mesh, points)
    times, pressure = read_protocol(asset_root() / "protocols" / "grasp.csv").sample(13)
    model = Model(mesh)
    warm = Equilibrium(model, materials)
    warm.reach(1e-4, [simulate(warm, np.zeros(1), np.zeros(1)).states[0]])
    baseline_s, baseline = seconds(lambda: simulate(Equilibrium(model, materials), times, pressure))
    states = [s for s in baseline.solved if s.pressure_MPa]
    print(f"{len(model.free)} unknowns, {len(states)} pressures\n")
    print(f"| what | s | Model A |\n| --- | --- | --- |\n| Model A | {baseline_s:.1f} | 1 |", flush=True)

    def row(name, took):
        print(f"| {name} | {took:.1f} | {took / baseline_s:.2f} |", flush=True)

    swept = {}

    def equilibrium():
        return Equilibrium(model, materials)

    distinct = np.array([s.pressure_MPa for s in baseline.solved])
    few = [baseline.solved[i] for pair in solution_order(distinct)[:2] for i in pair]
    wanted = {s.pressure_MPa for s in few}
    for name, every in (("ten", candidate_paths(points, windows(6))), ("a hundred", hundred(points))):
        jobs = tuple(every)
        setting = CandidateProblem(mesh, materials, points, jobs, RADIUS_MM, SENSOR_MPA)
        with closing(CandidatePool(setting, given.workers)) as sweeper:
            took, _ = seconds(lambda s=sweeper: beside(s, equilibrium(), times, pressure, wanted))
        row(f"{name} paths at {len(few)} pressures, beside Model A: beyond it", took - baseline_s)
        with closing(CandidatePool(setting, given.workers)) as sweeper:
            took, found = seconds(lambda s=sweeper: dict(s.solve([((state,), 0) for state in states])))
        row(f"{name} paths at every pressure, after Model A, the processes' start included", took)
        swept[name] = found
    took, _ = seconds(
        lambda: influence_map(model, materials, baseline, monitored[1], representative_pressures(baseline))
    )
    row("map of every element, in three of its states", took)
    for candidate in candidate_paths(points, windows(6))[: given.alone]:
        share = roi(mesh, candidate, RADIUS_MM).share
        stiff = with_sensor(materials, share, SENSOR_MPA)
        took, alone = seconds(lambda b=stiff: simulate(Equilibrium(model, b), times, pressure))
        still = moved_points(monitored, alone)
        number = int(candidate.name.removeprefix("alpha")) - 1
        at = [int(np.flatnonzero(pressure == s.pressure_MPa * 1e3)[0]) for s in states]
        apart = max(np.abs(swept["ten"][i][number] - still[k]).max() for i, k in enumerate(at))
        row(f"{candidate.name} alone along its whole path (differs by {apart:.0e} mm)", took)


if __name__ == "__main__":
    main()
