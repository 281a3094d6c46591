"""A resolved unit of three chambers under vacuum, with self-contact and without: angles, gaps and seconds.

    python benchmarks/self_contact.py --wall 0.6 --vacuum 20

Each line is a step of 2.5 kPa; with contact it ends with the pairs within the gap and the least distance.
"""

import argparse
import time

import attrs

from mu_addon.design import load_preset
from mu_addon.errors import ConvergenceError
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import CONTACT_NEWTON, SELF_CONTACT_NEWTON
from mu_addon.fem.self_contact import SelfContact
from mu_addon.fem.unit_materials import materials_of
from mu_addon.meshing.settings import MeshSettings
from mu_addon.resolved import mesh_printed

STEP_KPA = 2.5


def close(unit, mesh, contact, vacuum_kPa):
    model = Model(mesh, threads=1)
    model.self_contact = contact
    settings = CONTACT_NEWTON if contact is None else SELF_CONTACT_NEWTON
    equilibrium = Equilibrium(model, materials_of(unit, mesh), settings)
    states = [equilibrium.at_zero_pressure()]
    print(
        f"{len(model.free)} unknowns, {'no contact' if contact is None else f'{len(contact.facets)} facets'}"
    )
    while states[-1].pressure_kPa > -vacuum_kPa + 1e-6:
        pressure, begun = states[-1].pressure_MPa - STEP_KPA / 1000, time.perf_counter()
        try:
            states.append(equilibrium.reach(pressure, states))
        except ConvergenceError as why:
            print(f"  {why.what}")
            return
        state, seconds = states[-1], time.perf_counter() - begun
        line = f"  {state.pressure_kPa:6.1f} kPa {bending_angle_deg(mesh, state.u):8.3f} deg {seconds:6.1f} s"
        if contact is not None:
            line += f" {contact.count(state.u):5d} pairs, {contact.least_gap_mm(state.u):.4f} mm"
            line += ", cuts itself" * contact.intersects(state.u)
        print(line, flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--wall", type=float, default=0.6, help="wall in mm")
    parser.add_argument("--refine", type=float, default=0.7)
    parser.add_argument("--vacuum", type=float, default=20.0, help="in kPa")
    parser.add_argument("--gap", type=float, default=0.1, help="in mm")
    parser.add_argument("--stiffness", type=float, default=0.1, help="in MPa")
    chosen = parser.parse_args()
    unit = load_preset("mu-1.0x")
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=3, wall_mm=chosen.wall))
    mesh = mesh_printed(unit, MeshSettings(refine=chosen.refine))
    for contact in (None, SelfContact(mesh, chosen.gap, chosen.stiffness)):
        close(unit, mesh, contact, chosen.vacuum)


if __name__ == "__main__":
    main()
