"""A bellows gripper of others bends onto a cylinder: this package's contact against CalculiX's.

    git clone https://github.com/arvigj/pneumatic-actuator-design
    python -m benchmarks.bellows_gripper pneumatic-actuator-design/gripper_bellows --calculix

The bodies, their places, held faces and pressure are those of state_gripper_bellows.json there; so is the
law, Mooney-Rivlin with 55 and 5 kPa, and 1 MPa for the square of the change of volume, (J - 1)^2 here. Left
out are its third parameter, 1.7 kPa for (I1 - 3)(I2 - 3), with which CalculiX does not converge at any
pressure, friction (0.7) and inertia (a motion of 1.1 s). 60 kPa in the bellows. Both codes have the same mesh
of linear tetrahedra, or with --order 2 of quadratic ones with straight edges.
"""

import shutil
import subprocess
import tempfile
import time
from pathlib import Path

import attrs
import numpy as np

from benchmarks.peers.with_calculix import CONTROLS, faces_of, read_displacements
from benchmarks.table import options_of
from mu_addon.errors import ConvergenceError
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.laws import MooneyRivlin
from mu_addon.fem.materials import Layer, Materials
from mu_addon.fem.model import Model
from mu_addon.fem.newton_settings import SELF_CONTACT_NEWTON
from mu_addon.fem.self_contact import SelfContact
from mu_addon.meshing.mesh import MEMBRANE, Mesh, boundary_faces, edges_of, oriented, second_order

C1, C2, KAPPA = 0.055, 0.005, 2.0  # MPa
STEP_kPa = 5.0
# Where the peer puts the cylinder, and beyond which |x| in mm its surface is held.
STRETCH, SHIFT, HELD = (1.0, 1.5, 1.5), (0.0, 9.0, 3.0), 20.0
GAP_mm, STIFFNESS_MPa = 0.05, 0.0144
# CalculiX's contact in MPa a mm.
PENALTY = 1.0


@attrs.frozen(eq=False)
class Bodies:
    """The gripper, and maybe the cylinder behind it in one mesh; nodes of the gripper's end face."""

    mesh: Mesh
    end: np.ndarray
    gripper_tets: int


def bodies(folder, cylinder, order):
    nodes, tets = _tetrahedra(folder / "gripper_bellows_thick.msh")
    # A face a row: what it is, and three nodes. 1 is held, 2 is under pressure.
    kind, *corners = np.loadtxt(folder / "surface_selections_thick.txt", dtype=int).T
    marked = np.stack(corners, axis=1)
    faces, _ = boundary_faces(tets)
    cavity = faces[_among(faces, marked[kind == 2])]
    held = marked[kind == 1]
    end = np.flatnonzero(nodes[:, 2] > nodes[:, 2].max() - 0.1)
    count = len(tets)
    if cylinder:
        more, its = _tetrahedra(folder / "cylinder_to_grasp_coarse.msh")
        more = more * STRETCH + SHIFT
        outside, _ = boundary_faces(its)
        far = (np.abs(more[outside, 0]) > HELD).all(axis=1)
        held = np.vstack([held, outside[far] + len(nodes)])
        nodes, tets = np.vstack([nodes, more]), np.vstack([tets, its + len(nodes)])
    base = np.unique(held)
    if order == 2:
        edges, _ = edges_of(tets)
        corners = len(nodes)
        nodes, tets, cavity = second_order(nodes, tets, cavity, nodes[edges].mean(axis=1))
        sides = np.sort(held[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        base = np.concatenate([base, corners + np.flatnonzero(_among(edges, sides))])
    return Bodies(Mesh(nodes, tets, np.full(len(tets), MEMBRANE), cavity, base, end), end, count)


def _tetrahedra(path):
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Verbosity", 1)
        gmsh.open(str(path))
        _, nodes, _ = gmsh.model.mesh.getNodes()
        _, tets = gmsh.model.mesh.getElementsByType(4)
    finally:
        gmsh.finalize()
    nodes = nodes.reshape(-1, 3)
    return nodes, oriented(nodes, tets.reshape(-1, 4).astype(int) - 1)


def _among(rows, others):
    """Which rows (k, c) of node numbers are among others (r, c), in whatever order of their nodes."""
    found = set(map(tuple, np.sort(others, axis=1).tolist()))
    return np.array([tuple(row) in found for row in np.sort(rows, axis=1).tolist()])


def ours(given, contact, top_kPa):
    """The state at the last pressure that is reached."""
    model = Model(given.mesh, threads=1)
    model.self_contact = SelfContact(given.mesh, GAP_mm, STIFFNESS_MPa) if contact else None
    every = np.arange(len(given.mesh.tets))
    materials = Materials((Layer(MooneyRivlin, every, np.tile([C1, C2, KAPPA], (len(every), 1))),))
    equilibrium = Equilibrium(model, materials, SELF_CONTACT_NEWTON)
    states = [equilibrium.at_zero_pressure()]
    print(f"{len(model.free)} unknowns", flush=True)
    for pressure in np.arange(STEP_kPa, top_kPa + 0.1, STEP_kPa):
        begun = time.process_time()
        try:
            states.append(equilibrium.reach(pressure / 1000, states))
        except ConvergenceError as why:
            print(why.what)
            break
        u, text = states[-1].u, ""
        if contact:
            touch = model.self_contact.touch(u)
            text = f", {touch.force_N:.3f} N, gap {touch.gap_mm:.4f} mm"
        print(f"{pressure:5.1f} kPa {said(given, u)}{text}, {time.process_time() - begun:.1f} s", flush=True)
    return states[-1]


def said(given, u):
    x, y, z = u[given.end].mean(axis=0)
    return f"end ({x:.3f}, {y:.3f}, {z:.3f}) mm"


def calculix(given, contact, pressure_kPa, folder, tight):
    """Displacements (n, 3) in mm at a pressure. Raises RuntimeError where CalculiX does not get there."""
    job = folder / "bellows"
    write_input(given, contact, pressure_kPa, job.with_suffix(".inp"), tight)
    begun = time.perf_counter()
    done = subprocess.run(["ccx", "-i", job.name], cwd=folder, capture_output=True, text=True, check=False)
    if "Job finished" not in done.stdout:
        raise RuntimeError(done.stdout[-1500:])
    print(f"CalculiX: {time.perf_counter() - begun:.0f} s")
    return read_displacements(job.with_suffix(".dat"), len(given.mesh.nodes))


def write_input(given, contact, pressure_kPa, path, tight):
    mesh = given.mesh
    kind = "C3D4" if mesh.order == 1 else "C3D10"
    with path.open("w") as out:
        out.write("*NODE, NSET=ALL\n")
        numbered = np.column_stack([np.arange(1, len(mesh.nodes) + 1), mesh.nodes])
        np.savetxt(out, numbered, fmt="%d, %.12e, %.12e, %.12e")
        out.write(f"*ELEMENT, TYPE={kind}, ELSET=EVERY\n")
        np.savetxt(
            out,
            np.column_stack([np.arange(1, len(mesh.tets) + 1), mesh.tets + 1]),
            fmt="%d",
            delimiter=",",
        )
        out.write("*MATERIAL, NAME=RESIN\n*HYPERELASTIC, MOONEY-RIVLIN\n")
        out.write(f"{C1},{C2},{2 / KAPPA}\n")
        out.write("*SOLID SECTION, ELSET=EVERY, MATERIAL=RESIN\n")
        out.write("*NSET, NSET=HELD\n" + "".join(f"{node + 1},\n" for node in mesh.base))
        out.write("*BOUNDARY\nHELD, 1, 3\n")
        if contact:
            outside, _ = boundary_faces(mesh.tets[:, :4])
            element, face = faces_of(mesh, outside[~_among(outside, mesh.cavity_corners)])
            for name, rows in (
                ("GRIPPER", element < given.gripper_tets),
                ("CYLINDER", element >= given.gripper_tets),
            ):
                out.write(f"*SURFACE, NAME={name}, TYPE=ELEMENT\n")
                out.writelines(f"{e + 1}, S{f}\n" for e, f in zip(element[rows], face[rows], strict=True))
            out.write("*SURFACE INTERACTION, NAME=TOUCH\n*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n")
            out.write(f"{PENALTY}, 1.e-6\n")
            out.write("*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE\nGRIPPER, CYLINDER\n")
        out.write("*STEP, NLGEOM, INC=1000\n*STATIC\n0.05, 1., 1.e-6, 0.05\n")
        if tight:
            out.write(f"*CONTROLS, PARAMETERS=FIELD\n{CONTROLS}\n")
        out.write("*DLOAD\n")
        for element, face in zip(*faces_of(mesh, mesh.cavity_corners), strict=True):
            out.write(f"{element + 1}, P{face}, {pressure_kPa / 1000:.15g}\n")
        out.write("*NODE PRINT, NSET=ALL, FREQUENCY=1000\nU\n*END STEP\n")


def main():
    parser = options_of(__doc__)
    parser.add_argument("folder", type=Path, help="gripper_bellows of the peer's repository")
    parser.add_argument("--order", type=int, choices=(1, 2), default=1)
    parser.add_argument("--no-cylinder", action="store_true", help="nothing to touch")
    parser.add_argument(
        "--tight", action="store_true", help="CalculiX's controls as in the benchmarks of peers"
    )
    parser.add_argument("--top", type=float, default=60.0, metavar="KPA", help="the last pressure")
    parser.add_argument("--calculix", action="store_true", help="the last pressure by ccx, too")
    chosen = parser.parse_args()
    contact = not chosen.no_cylinder
    given = bodies(chosen.folder, contact, chosen.order)
    found = ours(given, contact, chosen.top)
    if not chosen.calculix:
        return
    if shutil.which("ccx") is None:
        parser.error("ccx is not on the path; on Debian: apt-get install calculix-ccx")
    with tempfile.TemporaryDirectory() as folder:
        theirs = calculix(given, contact, found.pressure_kPa, Path(folder), chosen.tight)
    print(f"CalculiX, {found.pressure_kPa:g} kPa: {said(given, theirs)}")
    away = np.linalg.norm(theirs - found.u, axis=1)
    largest = np.linalg.norm(found.u, axis=1).max()
    print(f"largest difference {away.max():.4f} mm of {largest:.2f} mm, {away.max() / largest:.1e}")


if __name__ == "__main__":
    main()
