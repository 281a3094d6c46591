"""Seconds and memory of the real unit on a CUDA device: Model A's path, then its ten candidates in lockstep.

    python benchmarks/gpu.py [--unknowns 500000 | --refine 1.0] [--device cuda:0] [--pressure 20]

`--device cpu --refine 0.3` is a dry run of the same code, conjugate gradients and all; its times mean little.
Kernels are compiled beforehand, on a coarse mesh.
"""

from __future__ import annotations

import argparse
import resource
import sys
import time

import numpy as np
import warp as wp
from circumstances import circumstances

from mu_addon.design.anchors import anchor_points, windows
from mu_addon.design.parameters import load_preset
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.kinematics import probe
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import NewtonSettings
from mu_addon.fem.state import rest
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.placement.batch import CandidateBatch
from mu_addon.placement.candidates import candidate_paths, roi

STEP_KPA = 5.0
SENSOR_MPA = 2.5
COARSE = 0.3
# A new tangent costs one more solution here, not as much as eight: at 8739 unknowns and two pressures this
# took 17 solutions instead of 23.
SETTINGS = NewtonSettings(keep_factor=0.1)


def unit_mesh(unit, refine):
    return mesh_unit(unit, MeshSettings(refine=refine))


def mesh_of(unit, unknowns):
    """A mesh within 5 % of so many unknowns, found by its growth with refine, and that refine."""
    refine, power, before = 0.7, 1.7, None
    for _ in range(6):
        mesh = unit_mesh(unit, refine)
        count = 3 * len(mesh.nodes)
        if abs(count / unknowns - 1) < 0.05:
            break
        if before:
            power = np.log(count / before[1]) / np.log(refine / before[0])
        before = refine, count
        refine *= (unknowns / count) ** (1 / power)
    return mesh, refine


class Clock:
    """Prints what was done, and the seconds since it was last asked, the device's work included."""

    def __init__(self, device, quiet):
        self.device, self.quiet = device, quiet
        self.start()

    def start(self):
        wp.synchronize_device(self.device)
        self.since = time.perf_counter()

    def lap(self, what):
        wp.synchronize_device(self.device)
        if not self.quiet:
            print(f"| {what} | {time.perf_counter() - self.since:.2f} |", flush=True)
        self.start()


def run(unit, mesh, device, pressure_kPa, quiet=False):
    """Model A to a pressure in equal steps, then the ten candidates at each of its states."""
    materials = materials_of(unit, mesh)
    clock = Clock(device, quiet)
    model = Model(mesh, device=device)
    # On a CUDA device it is so from the start.
    model.solver = "conjugate gradients"
    clock.lap(f"model, {len(model.free)} unknowns, {len(mesh.tets)} elements")
    steps = int(np.ceil(abs(pressure_kPa) / STEP_KPA))
    pressures = np.linspace(0, pressure_kPa * 1e-3, steps + 1)[1:]
    states = Equilibrium(model, materials, SETTINGS).path(pressures, rest(mesh))
    factors = sum(s.factorisations for s in states)
    clock.lap(f"Model A, {steps} pressures, {factors} tangents")
    ten = candidate_paths(anchor_points(unit), windows(6))
    shares = [roi(mesh, one, 1.0).share for one in ten]
    points = anchor_points(unit)
    sweep = CandidateBatch(model, materials, (points, probe(mesh, points)), shares, SENSOR_MPA)
    clock.lap(f"{len(ten)} candidates: inclusions")
    for state in states:
        sweep.at(state)
        clock.lap(f"{len(ten)} candidates at {state.pressure_MPa * 1e3:g} kPa")
    if not quiet:
        print(f"\nbending angle at {pressure_kPa:g} kPa: {bending_angle_deg(mesh, states[-1].u):.4f} degrees")


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    size = options.add_mutually_exclusive_group()
    size.add_argument("--unknowns", type=int, default=500_000)
    size.add_argument("--refine", type=float)
    options.add_argument("--device", help="a Warp device; by default the first CUDA device")
    options.add_argument("--pressure", type=float, default=20.0, help="kPa")
    given = options.parse_args()
    device = given.device or next((str(d) for d in wp.get_cuda_devices()), None)
    if device is None:
        sys.exit(
            "Warp sees no CUDA device on this machine: nothing was measured (--device cpu for a dry run)"
        )
    unit = load_preset("mu-1.0x")
    coarse = unit_mesh(unit, COARSE)
    run(unit, coarse, device, STEP_KPA, quiet=True)
    mesh, refine = (
        (unit_mesh(unit, given.refine), given.refine) if given.refine else mesh_of(unit, given.unknowns)
    )
    print(f"{circumstances()}\n{wp.get_device(device).name}; refine {refine:.3g}\n")
    print("| what | s |\n| --- | --- |", flush=True)
    run(unit, mesh, device, given.pressure)
    print(f"peak memory of the host: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.1f} GiB")
    if wp.get_device(device).is_cuda:
        peak = wp.get_mempool_used_mem_high(device) / 2**30
        print(f"peak memory of the device: {peak:.1f} GiB")


if __name__ == "__main__":
    main()
