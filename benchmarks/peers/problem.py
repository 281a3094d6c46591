"""What every code is asked to solve: mesh, moduli and pressures; and what it answers."""

from __future__ import annotations

import json
from pathlib import Path

import attrs
import numpy as np

from mu_addon.meshing.mesh import AXES, Mesh

# Free residual over reaction forces, both as Euclidean norms, at which each code stops or better.
TOLERANCE = 1e-6

_MESH_ARRAYS = ("nodes", "tets", "region", "cavity", "base", "tip")


@attrs.frozen(eq=False)
class Problem:
    """A body under follower pressure on its cavity, base clamped, mirror planes kept.

    modulus_MPa and poisson are (m,), one a tetrahedron, of few distinct pairs (the groups);
    pressures_MPa are the equal steps. Law: W = mu/2 (J^(-2/3) I1 - 3) + kappa/2 (J - 1)^2.
    """

    name: str
    mesh: Mesh
    modulus_MPa: np.ndarray
    poisson: np.ndarray
    pressures_MPa: np.ndarray

    @property
    def mu(self):
        """Shear modulus (m,) in MPa."""
        return self.modulus_MPa / (2 * (1 + self.poisson))

    @property
    def kappa(self):
        """Bulk modulus (m,) in MPa."""
        return self.modulus_MPa / (3 * (1 - 2 * self.poisson))

    def groups(self):
        """(mu, kappa, elements) of each group, in MPa."""
        pairs, group = np.unique(np.stack([self.mu, self.kappa], axis=1), axis=0, return_inverse=True)
        return [(*pair, np.flatnonzero(group.ravel() == i)) for i, pair in enumerate(pairs)]

    def fixed(self):
        """Which displacement components are held, (n, 3) bool."""
        fixed = np.zeros(self.mesh.nodes.shape, bool)
        fixed[self.mesh.base] = True
        for axis in self.mesh.symmetry:
            fixed[self.mesh.symmetry_nodes(axis), AXES.index(axis)] = True
        return fixed

    def save(self, path):
        arrays = {name: getattr(self.mesh, name) for name in _MESH_ARRAYS}
        np.savez(
            path,
            name=self.name,
            symmetry=np.array(self.mesh.symmetry, dtype=str),
            modulus_MPa=self.modulus_MPa,
            poisson=self.poisson,
            pressures_MPa=self.pressures_MPa,
            **arrays,
        )

    @staticmethod
    def load(path):
        with np.load(path) as stored:
            mesh = Mesh(*(stored[name] for name in _MESH_ARRAYS), tuple(map(str, stored["symmetry"])))
            moduli = stored["modulus_MPa"], stored["poisson"]
            return Problem(str(stored["name"]), mesh, *moduli, stored["pressures_MPa"])


@attrs.frozen(eq=False)
class Result:
    """One code's answer: seconds, cost, and the displacement (n, 3) in mm at the last pressure.

    set_up_s: from arrays to a model that could be solved, compilation included; solve_s: the steps.
    newton: linear systems solved, where the code tells.
    """

    code: str
    set_up_s: float
    solve_s: float
    unknowns: int
    newton: int | None
    u: np.ndarray

    @property
    def largest_mm(self):
        return float(np.linalg.norm(self.u, axis=1).max())

    def save(self, folder: Path, name: str):
        np.save(folder / f"{name}.npy", self.u)
        fields = attrs.asdict(self, filter=lambda field, _: field.name != "u")
        (folder / f"{name}.json").write_text(json.dumps(fields, indent=1))

    @staticmethod
    def load(folder: Path, name: str):
        fields = json.loads((folder / f"{name}.json").read_text())
        return Result(**fields, u=np.load(folder / f"{name}.npy"))
