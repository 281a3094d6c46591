"""Where each second of a printed unit's Model A goes with self-contact: processor seconds by part.

    python -m benchmarks.breakdown [--chambers 6] [--refine 0.5] [--pressures -10 -20]

Each part without the parts that it calls; one process and thread.
"""

import time

import attrs

from benchmarks.table import circumstances, options_of, print_head
from mu_addon.body import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.fem import factor, model, self_contact
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.newton_settings import BODY_CONTACT_NEWTON
from mu_addon.fem.self_contact import self_contact_of
from mu_addon.fem.state import rest
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings

BARRIER = "pairs, distances and the barrier's derivatives"
PATTERNS = "new patterns, their order and analysis"
STEPS, CANDIDATES = "collision-free steps", "contact candidates"
ASSEMBLY = "assembly of energy, forces and tangent"
PARTS = {
    "factorisations": [(factor.Cholesky, "factor")],
    "triangular solves": [(factor.Cholesky, "solve")],
    PATTERNS: [(factor.Cholesky, "__init__"), (model, "with_entries"), (model.Model, "_room")],
    CANDIDATES: [(self_contact.SelfContact, "_candidates")],
    BARRIER: [
        (self_contact.SelfContact, "_near"),
        (self_contact.SelfContact, "energy_mJ"),
        (self_contact.SelfContact, "forces"),
        (self_contact.SelfContact, "stiffness"),
        (model.Model, "_uncarried"),
        (model.Model, "_with_self_contact"),
    ],
    STEPS: [(self_contact.SelfContact, "free_share")],
    ASSEMBLY: [
        (model.Model, "tangent"),
        (model.Model, "residual"),
        (model.Model, "potential"),
        (model.Model, "force_scale"),
    ],
}


class Clock:
    """Processor seconds and calls by part, each without those of the parts inside it."""

    def __init__(self):
        self.seconds, self.calls, self._inside = dict.fromkeys(PARTS, 0.0), dict.fromkeys(PARTS, 0), []
        for part, methods in PARTS.items():
            for owner, name in methods:
                setattr(owner, name, self._timed(getattr(owner, name), part))

    def _timed(self, plain, part):
        def timed(*arguments, **options):
            start = time.process_time()
            self._inside.append(0.0)
            try:
                return plain(*arguments, **options)
            finally:
                took = time.process_time() - start
                self.seconds[part] += took - self._inside.pop()
                self.calls[part] += 1
                if self._inside:
                    self._inside[-1] += took

        return timed


def main():
    options = options_of(__doc__)
    options.add_argument("--chambers", type=int, default=6)
    options.add_argument("--refine", type=float, default=0.5)
    options.add_argument("--pressures", type=float, nargs="+", default=[-10.0, -20.0], help="in kPa")
    given = options.parse_args()
    unit = load_preset("mu-1.0x")
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=given.chambers))
    mesh = mesh_printed(unit, MeshSettings(refine=given.refine))
    body = model.Model(mesh, threads=1)
    body.self_contact = self_contact_of(unit, mesh)
    equilibrium = Equilibrium(body, materials_of(unit, mesh), BODY_CONTACT_NEWTON)
    print(f"{circumstances()}\n\n{len(body.free)} unknowns, {len(body.self_contact.facets)} facets\n")
    # Kernels are compiled, or read, at their first use.
    body.potential(0.0 * mesh.nodes, 0.0, equilibrium.parameters)
    body.factor.factor(equilibrium.rest_tangent)
    clock, history = Clock(), [rest(mesh)]
    start = time.process_time()
    for pressure in given.pressures:
        history.append(equilibrium.reach(pressure / 1000.0, history))
        angle = bending_angle_deg(mesh, history[-1].u)
        print(f"{pressure:g} kPa: {angle:.6f} degrees", flush=True)
    total = time.process_time() - start
    clock.seconds["rest"] = total - sum(clock.seconds.values())
    print()
    print_head("part", "calls", "s", "%")
    for part, seconds in clock.seconds.items():
        print(f"| {part} | {clock.calls.get(part, '')} | {seconds:.2f} | {100 * seconds / total:.0f} |")
    print(f"| all | | {total:.2f} | 100 |")


if __name__ == "__main__":
    main()
