"""A printed unit's displacements by this package and by felupe: same mesh, ties, shares and law.

    python -m benchmarks.body.against_felupe [--refine 0.6] [--pressure -5 5] [--chambers 3]

Struts are solid. Elements, law, assembly and the pressure on curved faces are felupe's. Of ours it has the
mesh: nodes, elements, shares of volume (`filled`, which scale its dV) and ties, u = T q, so that it solves
T' K T. Fails where the fields differ by more than 1e-4 of their norm.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import Any

import attrs
import numpy as np
from scipy import sparse

from benchmarks.table import options_of, print_head
from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.design.parameters import load_preset
from mu_addon.fem.equilibrium import Equilibrium
from mu_addon.fem.materials import Materials
from mu_addon.fem.model import Model
from mu_addon.meshing.mesh import AXES, Mesh
from mu_addon.meshing.settings import MeshSettings

from .tip import cap_angle_deg

AGREEMENT = 1e-4
STEP_KPA = 2.5
# Free residual over reactions, both as Euclidean norms; iterations to reach it.
TOLERANCE, MOST = 1e-9, 20

# Even renumberings of a ten-node tetrahedron that put each set of three corners first, as a face.
_TURNS = {
    frozenset((0, 1, 2)): [0, 1, 2, 3, 4, 5, 6, 7, 8, 9],
    frozenset((0, 1, 3)): [1, 0, 3, 2, 4, 7, 8, 5, 9, 6],
    frozenset((1, 2, 3)): [1, 3, 2, 0, 8, 9, 5, 4, 7, 6],
    frozenset((0, 2, 3)): [0, 2, 3, 1, 6, 9, 7, 4, 5, 8],
}


def with_felupe(
    mesh: Mesh,
    laws: Sequence[tuple[np.ndarray, Any]],
    pressures_MPa: Sequence[float],
    tolerance: float = TOLERANCE,
):
    """Displacements (n, 3) in mm at each pressure, and the Newton iterations until there.

    laws: elements, and felupe's material of them. tolerance: free residual over reactions. Raises
    RuntimeError for a pressure that is not reached.
    """
    import felupe
    import pypardiso

    solids = []
    for elements, law in laws:
        part = felupe.Mesh(mesh.nodes, mesh.tets[elements].astype(np.int64), cell_type="tetra10")
        part.points_without_cells = np.array([], dtype=int)
        region = felupe.RegionQuadraticTetra(part)
        region.dV = region.dV * mesh.filled[elements][:, _nearest_corners(region.quadrature.points)].T
        solids.append(felupe.SolidBody(law, felupe.FieldContainer([felupe.Field(region, dim=3)])))
    pressed = felupe.FieldContainer([felupe.Field(_cavity_region(mesh), dim=3)])
    pressure = felupe.SolidBodyPressure(pressed)
    ties = _ties(mesh)
    values, before, count = np.zeros(ties.shape[1]), np.zeros(ties.shape[1]), 0
    for target in pressures_MPa:
        values, before = 2.0 * values - before, values
        for _ in range(MOST):
            for field in (pressed, *(s.field for s in solids)):
                field[0].values[:] = (ties @ values).reshape(-1, 3)
            force = sum(s.assemble.vector(s.field) for s in solids)
            force = force - pressure.assemble.vector(pressed, pressure=target)
            force = np.asarray(force.todense()).ravel()
            free = ties.T @ force
            if np.linalg.norm(free) <= tolerance * np.linalg.norm(force):
                break
            stiffness = sum(s.assemble.matrix(s.field) for s in solids)
            stiffness = stiffness - pressure.assemble.matrix(pressed, pressure=target)
            values = values - pypardiso.spsolve(sparse.csr_matrix(ties.T @ stiffness @ ties), free)
            count += 1
        else:
            raise RuntimeError(f"no equilibrium at {1e3 * target:g} kPa")
        yield pressed[0].values.copy(), count


def _nearest_corners(points):
    """For each of felupe's quadrature points (4, 3) the corner it is nearest to; so ours are numbered."""
    return np.column_stack([1.0 - points.sum(axis=1), points]).argmax(axis=1)


def _ties(mesh: Mesh):
    """Displacements (3 n,) as a matrix times those that are free and tied to none."""
    n = len(mesh.nodes)
    fixed = np.zeros((n, 3), bool)
    fixed[mesh.base] = True
    for axis in mesh.symmetry:
        fixed[mesh.symmetry_nodes(axis), AXES.index(axis)] = True
    own = np.setdiff1d(np.arange(n), mesh.tied)
    rows = np.concatenate([own, np.repeat(mesh.tied, mesh.tied_to.shape[1])])
    columns = np.concatenate([own, mesh.tied_to.ravel()])
    weights = np.concatenate([np.ones(len(own)), mesh.tied_weights.ravel()])
    to = sparse.kron(sparse.csr_matrix((weights, (rows, columns)), shape=(n, n)), sparse.eye(3)).tocsc()
    fixed[mesh.tied] = True
    return to[:, np.flatnonzero(~fixed.ravel())].tocsr()


def _cavity_region(mesh: Mesh):
    """felupe's region of the elements at the cavity, integrated over their faces there."""
    import felupe

    faces = {frozenset(face): row for row, face in enumerate(mesh.cavity_corners.tolist())}
    cells = []
    for tet in mesh.tets:
        corners = tet[:4].tolist()
        for place, turn in _TURNS.items():
            if frozenset(corners[k] for k in place) in faces:
                cells.append(tet[turn])
    cells = np.array(cells, np.int64)
    if len(cells) != len(mesh.cavity):
        raise RuntimeError(f"{len(cells)} elements have {len(mesh.cavity)} faces of the cavity")
    rule = felupe.TriangleQuadrature(order=5)
    points = np.column_stack([rule.points, np.zeros(len(rule.points))])
    part = felupe.Mesh(mesh.nodes, cells, cell_type="tetra10")
    part.points_without_cells = np.array([], dtype=int)
    on_face = felupe.quadrature.Scheme(points, rule.weights)
    region = felupe.Region(part, felupe.QuadraticTetra(), on_face)
    # The third corner's side comes first: normals point out of the element, into the cavity.
    area = -np.cross(region.dXdr[:, 0], region.dXdr[:, 1], axis=0) * rule.weights.reshape(-1, 1)
    region.dA, region.dV = area, np.linalg.norm(area, axis=0)
    region.normals = area / region.dV
    return region


def main() -> None:
    import felupe

    parser = options_of(__doc__)
    parser.add_argument("--chambers", type=int, default=3)
    parser.add_argument("--refine", type=float, default=0.6)
    parser.add_argument("--pressure", type=float, nargs="*", default=[-5.0, 5.0], metavar="kPa")
    parser.add_argument("--modulus", type=float, default=2.5, help="Young's modulus of the resin in MPa.")
    parser.add_argument("--poisson", type=float, default=0.45)
    options = parser.parse_args()
    unit = load_preset("mu-1.0x")
    unit = attrs.evolve(unit, chambers=attrs.evolve(unit.chambers, count=options.chambers))
    mesh = mesh_printed(unit, MeshSettings(refine=options.refine), solid=True)
    shares = mesh.filled[(mesh.filled < 1.0).any(axis=1)]
    print(
        f"{len(mesh.tets)} elements, {len(shares)} of them cut, {len(mesh.tied)} nodes tied, "
        f"{3 * (len(mesh.nodes) - len(mesh.tied))} unknowns"
    )
    count = len(mesh.tets)
    law = Materials.neo_hooke(np.full(count, options.modulus), np.full(count, options.poisson))
    mu, kappa = law.layers[0].parameters[0]
    resin = felupe.NeoHooke(mu=mu, bulk=kappa)
    model = Model(mesh, threads=1, mean_dilatation=False)
    solver = Equilibrium(model, law)
    print_head("kPa", "ours deg", "felupe deg", "largest u mm", "difference", "Newton", "felupe s")
    worst = 0.0
    for kPa in options.pressure:
        steps = max(1, int(np.ceil(abs(kPa) / STEP_KPA)))
        ours = solver.reach(kPa * 1e-3, [solver.at_zero_pressure()]).u
        began = time.perf_counter()
        path = np.linspace(0.0, kPa * 1e-3, steps + 1)[1:]
        *_, (theirs, newton) = with_felupe(mesh, [(np.arange(count), resin)], path)
        apart = float(np.linalg.norm(theirs - ours) / np.linalg.norm(ours))
        worst = max(worst, apart)
        angles = " | ".join(f"{cap_angle_deg(mesh, u, unit.printed):.5f}" for u in (ours, theirs))
        print(
            f"| {kPa:g} | {angles} | {np.linalg.norm(ours, axis=1).max():.4f} | {apart:.1e} | {newton} "
            f"| {time.perf_counter() - began:.0f} |",
            flush=True,
        )
    if worst > AGREEMENT:
        sys.exit(f"a field differs by {worst:.1e}, more than {AGREEMENT:g}")


if __name__ == "__main__":
    main()
