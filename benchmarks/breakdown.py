"""Where each second of Model A goes: the default protocol of a unit, seconds by part.

    python benchmarks/breakdown.py [--preset mu-1.0x] [--refine 1.0]

Not called profile.py: run from this folder, that name would hide the standard library's.
"""

from __future__ import annotations

import argparse
import itertools
import time

import attrs
from circumstances import circumstances

from mu_addon.design.parameters import load_preset
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.trajectory import simulate
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.settings import MeshSettings
from mu_addon.usecases.simulate_and_place.job import Job, grasp


@attrs.define
class Clock:
    """Seconds and calls of some methods of an object, which are timed from `watch` on."""

    seconds: dict = attrs.field(factory=dict)
    calls: dict = attrs.field(factory=dict)

    def watch(self, thing, method, name):
        plain = getattr(thing, method)
        self.seconds[name], self.calls[name] = 0.0, 0

        def timed(*arguments, **options):
            start = time.perf_counter()
            try:
                return plain(*arguments, **options)
            finally:
                self.seconds[name] += time.perf_counter() - start
                self.calls[name] += 1

        setattr(thing, method, timed)


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--preset", default="mu-1.0x")
    options.add_argument("--refine", type=float, default=1.0)
    given = options.parse_args()
    job = Job(load_preset(given.preset), grasp(), mesh=MeshSettings(refine=given.refine))
    mesh = mesh_unit(job.unit, job.mesh)
    clock = Clock()
    marks = [time.perf_counter()]
    model = Model(mesh)
    marks.append(time.perf_counter())
    factor = model.factor
    marks.append(time.perf_counter())
    equilibrium = Equilibrium(model, materials_of(job.unit, mesh))
    for call in (model.potential, model.residual, model.tangent):
        call(mesh.nodes * 0, 0.0, equilibrium.parameters)
    for thing, method, name in (
        (factor, "factor", "factorisation"),
        (factor, "solve", "triangular solves"),
        (model, "tangent", "tangent"),
        (model, "residual", "residual"),
        (model, "force_scale", "scale of the forces"),
        (model, "potential", "energy"),
    ):
        clock.watch(thing, method, name)
    start = time.perf_counter()
    trajectory = simulate(equilibrium, *job.protocol.sample(job.times))
    total = time.perf_counter() - start
    iterations, factors = (
        sum(getattr(s, name) for s in trajectory.solved) for name in ("iterations", "factorisations")
    )
    print(
        f"{circumstances()}\n\n{given.preset}, refine {given.refine:g}: {len(model.free)} unknowns, ", end=""
    )
    print(f"{len(trajectory.solved)} states, {iterations} iterations, {factors} factorisations kept\n")
    print("| part | calls | s | % |\n| --- | --- | --- | --- |")
    clock.seconds["rest"] = total - sum(clock.seconds.values())
    for name, seconds in clock.seconds.items():
        calls = clock.calls.get(name, "")
        print(f"| {name} | {calls} | {seconds:.2f} | {100 * seconds / total:.0f} |")
    print(f"| all | | {total:.2f} | 100 |\n")
    pattern, analysis = (b - a for a, b in itertools.pairwise(marks))
    print(f"Once a mesh: {pattern:.2f} s for patterns and order, {analysis:.2f} s for symbolic analysis.")


if __name__ == "__main__":
    main()
