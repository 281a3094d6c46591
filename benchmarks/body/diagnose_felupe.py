"""Verdicts with the printed body as base, on data made by felupe with struts as solids.

    python -m benchmarks.body.diagnose_felupe FOLDER [--only "clean;wall"] [--refine 0.5] [--seed 1]

Elements, laws, pressure on curved faces and solution are felupe's; its mesh is ours of solid struts, tied to
the wall, where the judge's struts are beams. Its resin is neo-Hookean with ln J, the judge's with J - 1.
Three chambers up to 24 kPa, and in suction to -5 kPa, where no walls touch: felupe has no contact of these.
Sets and table as of `diagnose_printed`.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mu_addon.body.printed_mesh import mesh_printed
from mu_addon.fem.bending_angle import TipSection
from mu_addon.meshing.mesh import Mesh
from mu_addon.meshing.settings import MeshSettings

from .against_felupe import with_felupe
from .diagnose_printed import UNIT, Array, Hidden, judge, options, relaxed

LOW_kPa, HIGH_kPa = -5.0, 24.0
# Those beyond 0, each way.
PATHS_kPa = (np.array([-3.0, -6.0]), np.arange(4.0, 28.1, 4.0))
# Of a bend read to 0.03 degrees.
TOLERANCE = 1e-5
# Yeoh's second coefficient over the first is an effect's size; the modulus where a side is cured less.
SETS = {
    "clean": Hidden(),
    "clean again": Hidden(),
    "wall": Hidden("wall_thickness", 0.87),
    "stiffening": Hidden("strain_stiffening", 1.5),
    "gauge scale": Hidden(drive=lambda t, p: 1.1 * p),
    "gauge": Hidden(drive=lambda t, p: p * (1.0 + 0.12 * (1.0 - np.abs(p) / HIGH_kPa))),
    "leak": Hidden(drive=lambda t, p: p / 1.25, shut="slow"),
    "stiffening, resin": Hidden("strain_stiffening", 1.5, relaxed),
    "wall, offset": Hidden("wall_thickness", 0.87, lambda t, p: p - 1.0),
    "one side cured less": Hidden("one side", 0.65),
    "regulator that swings": Hidden(drive=lambda t, p: p * (1.0 + 0.05 * np.sin(2.0 * np.pi * t / 7.0))),
}


def laws(hidden: Hidden, mesh: Mesh) -> list[tuple[Array, object]]:
    """Elements, and felupe's material of them, in MPa."""
    import felupe

    every, nu = np.arange(len(mesh.tets)), UNIT.material.membrane_poisson

    def resin(modulus_MPa: float) -> felupe.NeoHookeCompressible:
        mu = modulus_MPa / 2.0 / (1.0 + nu)
        return felupe.NeoHookeCompressible(mu=mu, lmbda=2.0 * mu * nu / (1.0 - 2.0 * nu))

    modulus_MPa = 1e-3 * UNIT.material.membrane_modulus_kPa
    if hidden.effect == "strain_stiffening":
        c1 = modulus_MPa / 4.0 / (1.0 + nu)
        yeoh = felupe.Hyperelastic(felupe.yeoh, C10=c1, C20=hidden.size * c1, C30=0.0)
        return [(every, yeoh & felupe.Volumetric(bulk=modulus_MPa / 3.0 / (1.0 - 2.0 * nu)))]
    if hidden.effect == "one side":
        side = mesh.nodes[mesh.tets[:, :4], 1].mean(axis=1) < 0.0
        return [(every[~side], resin(modulus_MPa)), (every[side], resin(hidden.size * modulus_MPa))]
    return [(every, resin(modulus_MPa))]


def angles(hidden: Hidden, refine: float, folder: Path) -> tuple[Array, Array]:
    """Pressures (k,) in kPa and angles (k,) in degrees with what a set hides; kept."""
    pressures = np.concatenate([PATHS_kPa[0][::-1], [0.0], PATHS_kPa[1]])
    kept = folder / f"angles-{hidden.effect or 'clean'}-{hidden.size:g}-{refine:g}.npy"
    if not kept.exists():
        thin = hidden.size if hidden.effect == "wall_thickness" else 1.0
        unit = UNIT.evolve(wall_mm=thin * UNIT.chambers.wall_mm)
        mesh = mesh_printed(unit, MeshSettings(refine=refine), solid=True)
        tip, of = TipSection.of(mesh), laws(hidden, mesh)
        low, high = (
            [tip.angle_deg(u) for u, _ in with_felupe(mesh, of, 1e-3 * p, TOLERANCE)] for p in PATHS_kPa
        )
        np.save(kept, np.array([*low[::-1], 0.0, *high]))
    return pressures, np.load(kept)


def main() -> None:
    """Make every set, have it diagnosed, and print a row each."""
    given = options(__doc__, SETS, 0.5, LOW_kPa)
    judge(given, SETS, HIGH_kPa, lambda hidden: angles(hidden, given.refine, given.folder))


if __name__ == "__main__":
    main()
