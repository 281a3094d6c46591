"""`homogenize`: from a unit's struts and resin to its lattice's moduli, virtual tests and law."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.strut_cell import StrutCell, mass_g, specimen_solid
from ...design.surface import stl_bytes
from ...errors import ConvergenceError, InputError, MuError
from ...fem.materials import Materials
from ...files import write_bytes, write_csv
from ...homogenize.cell_mesh import cell_materials, mesh_cell
from ...homogenize.compression import Compressed, Compression, Friction, compress
from ...homogenize.effective_file import Effective, effective, write_effective
from ...homogenize.elasticity import Elasticity, effective_tensor
from ...homogenize.foam_fit import FoamFit, fit_foam
from ...homogenize.specimen import Specimen, block_specimen
from ...homogenize.stress_strain_curve import Curve, moduli
from ...homogenize.stretch import Stretched, StretchSettings, stretch_lattice
from ...meshing.mesh import Mesh
from ...report.vtk import write_mesh
from ...run.cache import Cache, key
from ...run.context import RunContext
from ...run.progress import Progress
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .job import LAYOUT, Job, read_job
from .report import write_report


def homogenize(job: Job, folder: Path, context: RunContext) -> Homogenisation:
    """Run every stage of a homogenisation, and report the finished ones."""
    study = Homogenisation(job, folder, context)
    context.report = lambda stopped: write_report(study, stopped)
    study.run()
    return study


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a homogenisation's `summary`."""
    moduli = summary["moduli_kPa"]
    lines = [
        f"Young's modulus {moduli['E100']:.4g} kPa along an axis of the cell, {moduli['E111']:.4g} kPa "
        f"along a strut; relative density {summary['relative_density']:.4f}"
    ]
    for friction, found in summary.get("specimen", {}).items():
        values = ", ".join(f"{name} {value:.4g} kPa" for name, value in found["modulus_kPa"].items())
        lines.append(f"block between plates ({friction}): {values}")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of a homogenisation with the expected seconds of each on two cores."""
    # Unknowns grow as the cube of the refinement, and a factorisation's time somewhat faster.
    factor = job.refine**3.5
    block = 110.0 * (job.cells / 3.0) ** 3
    cell = {"mesh of the cell": 30.0, "moduli": 5.0, "stretch of the cell": 35.0, "law": 12.0}
    least = {"mesh of the cell": 4.0, "moduli": 0.5, "stretch of the cell": 4.0, "law": 3.5}
    specimen = [("printable specimen", 2.0), *((f"specimen, {name}", block) for name in job.frictions)]
    stages = [(name, max(s * factor, least[name])) for name, s in cell.items()]
    return [*stages, *(specimen if job.frictions else []), ("report", 3.0 + 2.0 * len(job.frictions))]


KEPT = ("mesh of the cell", "stretch of the cell", "specimen")
USE_CASE = UseCase("homogenize", LAYOUT, read_job, homogenize, console_summary, plan=plan_of, kept=KEPT)


Array = np.ndarray[Any, Any]

# Strains of the periodic cell at which points of its curve are kept.
STRETCHES = tuple(float(s) for s in np.linspace(-0.4, 0.4, 21).round(12))


@attrs.define
class Homogenisation:
    """State of a homogenisation; results are also in `folder` as soon as they are complete."""

    job: Job
    folder: Path
    context: RunContext
    mesh: Mesh | None = None
    materials: Materials | None = None
    elasticity: Elasticity | None = None
    stretched: Stretched | None = None
    fit: FoamFit | None = None
    effective: Effective | None = None
    tests: dict[Friction, Compression] = attrs.field(factory=dict)
    warnings: list[str] = attrs.field(factory=list)

    @property
    def progress(self) -> Progress:
        """Progress of the run."""
        return self.context.progress

    @property
    def cache(self) -> Cache:
        """Finished work, so that a killed run resumes."""
        return Cache(self.folder / "cache")

    # Stages, in the order they need each other.

    def run(self) -> None:
        """Run every stage; a failure after the moduli are found leaves them, with a warning."""
        job = self.job
        self.context.summary["inputs"] = {"cell": cell_table(job.cell), "resin": attrs.asdict(job.resin)}
        self.make_cell()
        self.find_moduli()
        self.stretch_cell()
        self.fit_law()
        if job.frictions:
            self.export_specimen()
        for friction in job.frictions:
            self.compress(friction)

    def make_cell(self) -> None:
        """Analysis mesh of the cell's octant."""
        job = self.job
        with self.progress.stage("mesh of the cell", 5.0):
            self.mesh = mesh_cell(job.cell, job.mesh, self.cache.folder)
            self.progress.made(f"{len(self.mesh.nodes)} nodes and {len(self.mesh.tets)} elements")
            resin = job.resin
            self.materials = cell_materials(job.cell, self.mesh, resin.modulus_MPa, resin.poisson)
            modulus, _ = self.materials.small_strain(len(self.mesh.tets))
            write_mesh(self.folder / "cell.vtu", self.mesh, modulus)
        self.context.summary["mesh"] = {"nodes": len(self.mesh.nodes), "tetrahedra": len(self.mesh.tets)}

    def find_moduli(self) -> None:
        """Effective elasticity of the infinite lattice."""
        assert self.mesh is not None
        assert self.materials is not None
        with self.progress.stage("moduli", 5.0):
            found = effective_tensor(self.mesh, self.materials)
        self.elasticity = found
        names = ("xx", "yy", "zz", "yz", "xz", "xy")
        rows = [(name, *(f"{1e3 * c:.9g}" for c in row)) for name, row in zip(names, found.C, strict=True)]
        write_csv(self.folder / "tensor.csv", ["C_kPa", *names], rows)
        cell, resin = self.job.cell, self.job.resin
        n = self.job.cells
        self.context.summary["moduli_kPa"] = {
            name: 1e3 * getattr(found, name)
            for name in ("C11", "C12", "C44", "E100", "E110", "E111", "bulk", "shear")
        }
        self.context.summary |= {
            "poisson_100": found.nu100,
            "zener": found.zener,
            "cubic_error": found.cubic_error,
            "relative_density": found.relative_density,
            "specimen_mass_g": mass_g(cell, resin.density_g_per_ml, n),
        }

    def stretch_cell(self) -> None:
        """Tension and compression of the infinite lattice along an axis."""
        assert self.mesh is not None
        assert self.materials is not None
        settings = StretchSettings(strains=STRETCHES)
        name = key(self.mesh.hash(), self.materials.hash(), settings)
        kept = self.cache.get("stretch", name)
        with self.progress.stage("stretch of the cell", 40.0):
            if kept is not None and set(kept) == {"stretch", "stress_MPa", "lateral", "stopped"}:
                curve = Curve(kept["stretch"], kept["stress_MPa"], kept["lateral"])
                found = Stretched(curve, (), str(kept["stopped"]))
            else:
                done = [0]

                def reached(_: object) -> None:
                    done[0] += 1
                    self.progress.update(done[0] / len(STRETCHES))

                found = stretch_lattice(self.mesh, self.materials, settings=settings, on_point=reached)
                arrays = attrs.asdict(found.curve) | {"stopped": np.array(found.stopped)}
                self.cache.put("stretch", name, arrays)
        self.stretched = found
        curve = found.curve
        rows = [
            (f"{e:.9g}", f"{1e3 * s:.9g}", f"{a:.9g}", f"{b:.9g}")
            for e, s, (a, b) in zip(curve.strain, curve.stress_MPa, curve.lateral, strict=True)
        ]
        columns = ["strain", "stress_kPa", "lateral_stretch_x", "lateral_stretch_y"]
        write_csv(self.folder / "cell.csv", columns, rows)
        self.context.summary["cell_curve"] = {
            "strain": [float(curve.strain[0]), float(curve.strain[-1])],
            "stopped": found.stopped,
        }
        if found.stopped:
            self.warn(f"The curve of the periodic lattice ends early: {found.stopped}.")

    def fit_law(self) -> None:
        """The analysis mesh's law, written to effective.toml."""
        assert self.elasticity is not None
        assert self.stretched is not None
        e, job = self.elasticity, self.job
        with self.progress.stage("law", 5.0):
            try:
                self.fit = fit_foam(self.stretched.curve, e.C11, e.C12, e.C44)
                self.effective = effective(
                    self.fit,
                    (e.C11, e.C12, e.C44),
                    e.relative_density,
                    cell_table(job.cell),
                    attrs.asdict(job.resin),
                    "".join(job.texts().values()),
                )
            except InputError as error:
                where = f" ({error.where})" if error.where else ""
                self.warn(f"No law for the analysis mesh, and no effective.toml: {error.what}{where}.")
                return
            write_effective(self.folder / "effective.toml", self.effective)
        misfit = attrs.asdict(self.fit.misfit)
        law = {"E_kPa": 1e3 * self.fit.E_MPa, "poisson": self.fit.poisson, "C44_kPa": 1e3 * self.fit.C44_MPa}
        self.context.summary["law"] = {"misfit": misfit, "small_strain": law, "stretch": self.fit.stretch}

    def export_specimen(self) -> None:
        """Write the printable block at nominal size: the printer adds its offset itself."""
        with self.progress.stage("printable specimen", 3.0):
            nominal = attrs.evolve(self.job.cell, offset_xy_mm=0.0, offset_z_mm=0.0)
            try:
                solid = specimen_solid(nominal, self.job.cells)
                write_bytes(self.folder / "specimen.stl", stl_bytes(*solid))
            except MuError as error:
                self.warn(f"No printable specimen: {error.what}.")

    def specimen(self) -> Specimen:
        """An eighth of the block to be compressed."""
        cell, resin = self.job.cell, self.job.resin
        mesh = mesh_cell(cell, self.job.block_mesh, self.cache.folder)
        materials = cell_materials(cell, mesh, resin.modulus_MPa, resin.poisson)
        return block_specimen(mesh, self.job.cells, materials)

    def compress(self, friction: Friction) -> None:
        """Compress the block between two plates, to the strain asked for."""
        body = self.specimen()
        name = key(body.mesh.hash(), body.materials.hash(), friction, self.job.strains)
        fields = ("u", "force_N", "energy_mJ", "residual", "factorisations")

        def load(strain: float) -> Compressed | None:
            kept = self.cache.get(f"{friction}-{strain:g}", name)
            if kept is None or set(kept) != set(fields):
                return None
            force, energy, residual = (float(kept[field]) for field in fields[1:4])
            return Compressed(strain, kept["u"], force, energy, residual, int(kept["factorisations"]))

        def store(state: Compressed) -> None:
            arrays = {field: getattr(state, field) for field in fields}
            self.cache.put(f"{friction}-{state.strain:g}", name, arrays)

        with self.progress.stage(f"specimen, {friction}"):
            try:
                found = compress(
                    body,
                    self.job.strains,
                    friction,
                    on_state=lambda state: self.progress.update(state.strain / self.job.strain),
                    load=load,
                    store=store,
                )
            except ConvergenceError as error:
                self.warn(f"The specimen was not compressed ({friction}): {error.what}.")
                return
        self.tests[friction] = found
        curve = found.curve
        rows = [
            (f"{-e:.9g}", f"{-1e3 * s:.9g}", f"{a:.9g}", f"{b:.9g}", int(valid))
            for e, s, (a, b), valid in zip(
                curve.strain[::-1],
                curve.stress_MPa[::-1],
                curve.lateral[::-1],
                found.valid[::-1],
                strict=True,
            )
        ]
        columns = ["strain", "stress_kPa", "lateral_stretch_x", "lateral_stretch_y", "valid"]
        write_csv(self.folder / f"specimen_{friction}.csv", columns, rows)
        self.context.summary.setdefault("specimen", {})[friction] = {
            "modulus_kPa": {p: 1e3 * m for p, m in moduli(curve).items()},
            "valid_to_strain": found.valid_to_strain,
            "why": found.why,
        }

    def warn(self, text: str) -> None:
        """Warn the user, now and in the report."""
        if text not in self.warnings:
            self.warnings.append(text)
            self.progress.warning(text)
        self.context.summary["warnings"] = self.warnings


def cell_table(cell: StrutCell) -> dict[str, str | float]:
    """A printed cell as text and numbers."""
    return {"kind": cell.kind.name} | {
        field.name: float(getattr(cell, field.name))
        for field in attrs.fields(StrutCell)
        if field.name != "kind"
    }
