"""python -m benchmarks.evidence.second_code.whole_unit --out DIR [--only clean,offset] [--refine 0.5]

A whole unit by another finite-element code, diagnosed as a user does. The unit has three chambers, so that
every run of the judge is short. Its response is felupe's: quadratic tetrahedra that pytetwild filled its
surfaces with, and a Neo-Hookean law whose volumetric term is (ln J)^2 where the judge has (J - 1)^2. The
effects have laws of this code, and the noise is that of the other sets. Every set has the same protocol, so
that the judge's simulations serve them all. Needs `pip install -e '.[benchmarks]'`.
"""

from __future__ import annotations

import time
from pathlib import Path

import attrs
import numpy as np

from benchmarks.table import options_of, print_head, print_row
from mu_addon.design.parameters import Unit, load_preset, to_toml
from mu_addon.files import write_text
from mu_addon.meshing.homogenised_unit import mesh_unit
from mu_addon.meshing.mesh import AXES, LATTICE, Mesh
from mu_addon.meshing.settings import MeshSettings

from .judging import verdict_on
from .recording import Trial, instrument, read, write
from .units import _softened

Array = np.ndarray[..., np.dtype[np.float64]]

PRESSURES_kPa = np.linspace(-10.0, 30.0, 9)
# Newton's last update over the largest displacement.
TOLERANCE = 1e-5
# Standard deviation of the angle's noise over a full scale of 15 degrees.
LEVEL, SCALE_deg = 0.003, 15.0
# What is hidden in each: a gauge's zero, a stretched exponential, thicker walls, a mount that sticks.
SETS: dict[str, tuple[str, ...]] = {
    "clean": (),
    "offset": ("pressure_offset",),
    "relaxes": ("viscoelasticity",),
    "walls": ("wall_thickness",),
    "sticks": (),
}
THICKER, OFFSET_kPa, STICKS_deg = 1.2, 1.5, 0.6
RELAXES = {"share": 0.25, "time_s": 12.0, "beta": 0.6}


def small_unit(thicker: float = 1.0) -> Unit:
    """The 1.0x preset with three chambers, and walls `thicker` times the preset's."""
    unit = load_preset("mu-1.0x")
    chambers = attrs.evolve(unit.chambers, count=3, wall_mm=thicker * unit.chambers.wall_mm)
    return attrs.evolve(unit, name="mu-three-chambers", chambers=chambers)


def pushed(x: Array, faces: Array) -> tuple[Array, Array, Array]:
    """Force of a unit pressure on the nodes of faces, its derivative, and their degrees of freedom.

    x (n, 3) mm: where the nodes are; faces (f, 6). Returns (f, 6, 3), (f, 18, 18) and (f, 18).
    """
    import felupe

    quadrature = felupe.quadrature.Triangle(order=5)
    weights = quadrature.weights
    # felupe's own derivatives of this triangle (11.3.0) are not those of its functions.
    r, s = quadrature.points.T
    corners, no, one = np.array([1.0 - r - s, r, s]), np.zeros_like(r), np.ones_like(r)
    slope = np.array([[-one, -one], [one, no], [no, one]]).transpose(0, 2, 1)
    i, j = np.array([[0, 1], [1, 2], [2, 0]]).T
    shapes = np.concatenate([corners * (2.0 * corners - 1.0), 4.0 * corners[i] * corners[j]]).T
    along = (4.0 * corners - 1.0)[:, :, None] * slope
    between = 4.0 * (corners[i][:, :, None] * slope[j] + corners[j][:, :, None] * slope[i])
    slopes = np.concatenate([along, between]).swapaxes(0, 1)
    at = x[faces]
    along_r, along_s = (np.einsum("qa,fai->qfi", slopes[:, :, d], at) for d in (0, 1))
    force = np.einsum("q,qa,qfi->fai", weights, shapes, np.cross(along_r, along_s))
    # Matrices of the cross products, columns of the identity crossed by each tangent.
    turn_r, turn_s = (np.cross(np.eye(3), v[:, :, None, :]).swapaxes(-1, -2) for v in (along_r, along_s))
    change = np.einsum("q,qa,qb,qfij->faibj", weights, shapes, slopes[:, :, 0], turn_s, optimize=True)
    change -= np.einsum("q,qa,qb,qfij->faibj", weights, shapes, slopes[:, :, 1], turn_r, optimize=True)
    many = 3 * faces.shape[1]
    dofs = (3 * faces[:, :, None] + np.arange(3)).reshape(len(faces), many)
    return force, change.reshape(len(faces), many, many), dofs


class Felupe:
    """A unit on a mesh as felupe's bodies, and Newton's method with the pressure that follows the walls."""

    def __init__(self, unit: Unit, mesh: Mesh) -> None:
        import felupe

        self.mesh = mesh
        material = unit.material
        lattice = mesh.region == LATTICE
        self.field, self.bodies = None, []
        for member, modulus_kPa, poisson in (
            (lattice, material.lattice_modulus_kPa, material.lattice_poisson),
            (~lattice, material.membrane_modulus_kPa, material.membrane_poisson),
        ):
            part = felupe.Mesh(mesh.nodes, mesh.tets[member].astype(np.int64), cell_type="tetra10")
            part.points_without_cells = np.array([], dtype=int)
            field = felupe.FieldContainer([felupe.Field(felupe.RegionQuadraticTetra(part), dim=3)])
            mu = 1e-3 * modulus_kPa / (2 * (1 + poisson))
            lame = 2 * mu * poisson / (1 - 2 * poisson)
            self.bodies.append(felupe.SolidBody(felupe.NeoHookeCompressible(mu=mu, lmbda=lame), field))
        held = np.zeros(mesh.nodes.shape, bool)
        held[mesh.base] = True
        for axis in mesh.symmetry:
            held[mesh.symmetry_nodes(axis), AXES.index(axis)] = True
        self.free = np.flatnonzero(~held.ravel())
        self.u, self.pressure_kPa = np.zeros_like(mesh.nodes), 0.0
        self.slope = np.zeros_like(mesh.nodes)

    def reach(self, pressure_kPa: float) -> Array:
        """Displacements (n, 3) in mm at a pressure, from where the last call ended, in steps that converge.

        Raises RuntimeError where none of 0.1 kPa does.
        """
        step = pressure_kPa - self.pressure_kPa
        while self.pressure_kPa != pressure_kPa:
            left = pressure_kPa - self.pressure_kPa
            target = pressure_kPa if abs(step) >= abs(left) else self.pressure_kPa + step
            found = self._newton(target)
            if found is None:
                step /= 2.0
                if abs(step) < 0.1:
                    raise RuntimeError(f"felupe's unit does not converge at {target:g} kPa")
                continue
            self.slope = (found - self.u) / (target - self.pressure_kPa)
            self.u, self.pressure_kPa = found, target
        return self.u

    def _newton(self, pressure_kPa: float) -> Array | None:
        """Displacements (n, 3) by Newton's method along the last step; None where it does not converge."""
        from pypardiso import spsolve
        from scipy import sparse

        u, size = self.u + (pressure_kPa - self.pressure_kPa) * self.slope, self.u.size
        p = 1e-3 * pressure_kPa
        for _ in range(12):
            vector, matrix = np.zeros(size), sparse.csr_matrix((size, size))
            for body in self.bodies:
                body.field[0].values[:] = u
                vector += body.assemble.vector(body.field).toarray().ravel()
                matrix = matrix + body.assemble.matrix(body.field)
            if not np.isfinite(vector).all():
                return None
            force, change, dofs = pushed(self.mesh.nodes + u, self.mesh.cavity)
            vector += p * np.bincount(dofs.ravel(), force.ravel(), minlength=size)
            rows = np.repeat(dofs, dofs.shape[1], axis=1).ravel()
            columns = np.tile(dofs, (1, dofs.shape[1])).ravel()
            matrix = matrix + sparse.csr_matrix((p * change.ravel(), (rows, columns)), shape=(size, size))
            step = spsolve(matrix.tocsr()[self.free][:, self.free], -vector[self.free])
            u.ravel()[self.free] += step
            if np.abs(step).max() <= TOLERANCE * np.abs(u).max():
                return u
        return None


def response(unit: Unit, refine: float, folder: Path) -> Array:
    """Angles (k,) in degrees at `PRESSURES_kPa`, by the plane of the tip's moved nodes; kept in a folder."""
    kept = folder / f"felupe-{unit.hash()[:12]}-{refine:g}.npy"
    if kept.exists():
        return np.asarray(np.load(kept))
    mesh = mesh_unit(unit, MeshSettings(refine=refine, order=2), mesher="pytetwild", cache=folder)
    print(f"{unit.chambers.wall_mm:g} mm walls: {mesh.nodes.size} unknowns on pytetwild's mesh", flush=True)
    angles = np.zeros(len(PRESSURES_kPa))
    for side in (PRESSURES_kPa[PRESSURES_kPa > 0], PRESSURES_kPa[PRESSURES_kPa < 0][::-1]):
        code = Felupe(unit, mesh)
        for pressure in side.tolist():
            y, z = (mesh.nodes + code.reach(pressure))[mesh.tip, 1:].T
            angle = -np.degrees(np.arctan(np.polyfit(y, z, 1)[0]))
            angles[PRESSURES_kPa == pressure] = angle
    np.save(kept, angles)
    return angles


def trials(name: str, rng: np.random.Generator, angles: Array) -> list[Trial]:
    """The tests of a set without noise: a ladder, a fast wave and a hold, through suction and pressure."""
    from scipy.interpolate import make_interp_spline

    bends = make_interp_spline(PRESSURES_kPa, angles, k=5)
    protocols = {
        "ladder": ([0, 20, 60, 100, 140, 200, 240], [0, 8, 8, 18, 18, 28, 0]),
        "fast": ([0, 3, 9, 15, 22, 30], [0, 26, -8, 22, -5, 0]),
        "hold": ([0, 4, 70, 74, 130], [0, 24, 24, 3, 3]),
    }
    found = []
    for test, (times, pressures) in protocols.items():
        t = np.linspace(0.0, times[-1], 3000)
        p = np.interp(t, times, pressures)
        inside = p - OFFSET_kPa if name == "offset" else p
        if name == "relaxes":
            inside = _softened(t, inside, RELAXES)
        angle = bends(np.clip(inside, PRESSURES_kPa[0], PRESSURES_kPa[-1]))
        if name == "sticks":
            angle = _stuck(angle)
        rows = np.linspace(0.0, times[-1], 250)
        columns = {
            "time_s": rows,
            "pressure_kPa": np.interp(rows, t, p),
            "angle_deg": np.interp(rows, t, angle),
        }
        found.append(Trial("unit_pressure", test, columns, "angle_deg", SCALE_deg, {"specimen": "A"}))
    by = instrument(rng, found)
    return [read(rng, test, str(rng.choice(["white", "slow"])), LEVEL, by) for test in found]


def _stuck(angle: Array) -> Array:
    at, held = float(angle[0]), []
    for value in angle.tolist():
        if abs(value - at) > STICKS_deg:
            at = value
        held.append(at)
    return np.array(held)


def main() -> None:
    """Make every set, have it diagnosed, and print a row each."""
    parser = options_of(__doc__)
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--only", default=",".join(SETS))
    parser.add_argument("--refine", type=float, default=0.5, help="of pytetwild's mesh")
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    described = given.out / "unit.toml"
    write_text(described, to_toml(small_unit()))
    print_head("set", "hidden", "verdict", "causes", "s")
    for name in given.only.split(","):
        angles = response(small_unit(THICKER if name == "walls" else 1.0), given.refine, given.out)
        folder = given.out / f"{name}-{given.seed}"
        if not folder.exists():
            rng = np.random.default_rng([given.seed, list(SETS).index(name)])
            write(folder, trials(name, rng, angles))
        began = time.time()
        found = verdict_on(folder, described, given.out / "diagnosis", homogenised=True)
        causes = ", ".join(c["effect"] for c in found["causes"])
        hidden = ", ".join(SETS[name]) or ("a mount that sticks" if name == "sticks" else "nothing")
        row = (name, hidden, str(found["verdict"]), causes, f"{time.time() - began:.0f}")
        print_row(*row)


if __name__ == "__main__":
    main()
