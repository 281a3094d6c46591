"""From a unit's struts and resin to the lattice's moduli, virtual tests and law, in one folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...design.parameters import Unit, to_toml
from ...design.strut_cell import StrutCell, mass_g, specimen_solid, strut_cell
from ...design.surface import stl_bytes
from ...errors import ConvergenceError, InputError, MuError
from ...fem.materials import Materials
from ...files import write_bytes, write_csv
from ...homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from ...homogenize.compression import STRAINS, Compressed, Compression, Friction, compress
from ...homogenize.curve import Curve
from ...homogenize.effective import Effective, effective, write_effective
from ...homogenize.elasticity import Elasticity, effective_tensor
from ...homogenize.foam_fit import FoamFit, fit_foam
from ...homogenize.modulus import moduli
from ...homogenize.specimen import Specimen, block_specimen
from ...homogenize.stretch import Stretched, StretchSettings, stretch_lattice
from ...materials.library import Material, load_material
from ...meshing.mesh import Mesh
from ...report.vtk import write_mesh
from ...run.cache import Cache, key
from ...run.context import RunContext
from ...run.folder import begin
from ...run.progress import Progress

Array = np.ndarray[Any, Any]

HEADER = "# The inputs of this homogenisation; unit.toml beside it belongs to them."
FRICTIONS: tuple[Friction, ...] = ("slide", "stick")
RESIN = "elastic-50a-v1"
# Elements to a strut's diameter in the block: its cell's modulus is within 2 % of a fine mesh's.
BLOCK_PER_DIAMETER = 1.0
# Strains of the periodic cell at which points of its curve are kept.
STRETCHES = tuple(float(s) for s in np.linspace(-0.4, 0.4, 21).round(12))
RESULTS = (
    "effective.toml",
    "tensor.csv",
    "cell.csv",
    "cell.vtu",
    "cell.png",
    "modulus.png",
    "specimen.stl",
    "specimen_slide.csv",
    "specimen_stick.csv",
    "specimen_*.png",
    "report.html",
)


@attrs.frozen
class Resin:
    """What struts are made of: neo-Hookean, Young's modulus in MPa and Poisson's ratio; density in g/ml."""

    name: str
    modulus_MPa: float
    poisson: float
    density_g_per_ml: float

    @classmethod
    def of_unit(cls, unit: Unit, known: Material) -> Resin:
        """The unit's own: its struts are printed with its membrane, of a known resin's density."""
        m = unit.material
        modulus = m.membrane_modulus_MPa
        return cls("that of the unit's membrane", modulus, m.membrane_poisson, known.density_g_per_ml)

    @classmethod
    def of(cls, known: Material) -> Resin:
        """One of the library, or of a file."""
        return cls(known.name, known.modulus_MPa, known.poisson, known.density_g_per_ml)


@attrs.frozen
class Job:
    """Inputs of a homogenisation. cells: of the specimen, a side; frictions: none leaves it out."""

    unit: Unit
    resin: Resin
    cells: int = 3
    frictions: tuple[Friction, ...] = FRICTIONS
    strain: float = 0.4
    refine: float = 1.0

    def __attrs_post_init__(self) -> None:
        if not 1 <= self.cells <= 12:
            raise InputError(f"a specimen of {self.cells} cells per side", "--cells", "give 1 to 12")
        if not 0.01 <= self.strain <= 0.8:
            raise InputError(f"a compression to {self.strain:g}", "--strain", "give a share from 0.01 to 0.8")
        if not 0.3 <= self.refine <= 4.0:
            raise InputError(f"refine = {self.refine:g} is out of bounds", "--refine", "give 0.3 to 4")

    @property
    def cell(self) -> StrutCell:
        """The unit's cell, as it is printed."""
        return strut_cell(self.unit)

    @property
    def mesh(self) -> CellMeshSettings:
        """How fine the cell's mesh is."""
        standard = CellMeshSettings()
        return attrs.evolve(standard, per_diameter=standard.per_diameter * self.refine)

    @property
    def block_mesh(self) -> CellMeshSettings:
        """How fine each cell of the block is: coarse, for there are many."""
        return attrs.evolve(self.mesh, per_diameter=BLOCK_PER_DIAMETER * self.refine)

    @property
    def strains(self) -> tuple[float, ...]:
        """Nominal strains of the specimen's test."""
        return (*(s for s in STRAINS if s < self.strain - 1e-9), self.strain)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; homogenize.toml is the first."""
        frictions = ", ".join(f'"{f}"' for f in self.frictions)
        lines = [
            HEADER,
            "format = 1",
            'unit = "unit.toml"',
            f"cells = {self.cells}",
            f"frictions = [{frictions}]",
            f"strain = {self.strain}",
            f"refine = {self.refine}",
            "",
            "[resin]",
            f'name = "{self.resin.name}"',
            f"modulus_kPa = {self.resin.modulus_MPa * 1e3:.9g}",
            f"poisson = {self.resin.poisson}",
            f"density_g_per_ml = {self.resin.density_g_per_ml}",
        ]
        return {"homogenize.toml": "\n".join(lines) + "\n", "unit.toml": to_toml(self.unit)}


@attrs.define
class Homogenisation:
    """A homogenisation under way: what was found so far is here, and in `folder` as soon as it is whole."""

    job: Job
    folder: Path
    progress: Progress
    context: RunContext
    mesh: Mesh | None = None
    materials: Materials | None = None
    elasticity: Elasticity | None = None
    stretched: Stretched | None = None
    fit: FoamFit | None = None
    effective: Effective | None = None
    tests: dict[Friction, Compression] = attrs.field(factory=dict)
    warnings: list[str] = attrs.field(factory=list)

    @classmethod
    def open(cls, job: Job, folder: Path, progress: Progress, context: RunContext) -> Homogenisation:
        """Make the folder this run's; results of other inputs are moved to stale/. Raises InputError."""
        texts = job.texts()
        begin(context, folder, HEADER, texts, RESULTS)
        context.summary["inputs"] = {"cell": cell_table(job.cell), "resin": attrs.asdict(job.resin)}
        return cls(job, folder, progress, context)

    @property
    def cache(self) -> Cache:
        """Finished work, so that a killed run resumes."""
        return Cache(self.folder / "cache")

    # Stages, in the order they need each other.

    def run(self) -> None:
        """Every stage; what fails after the moduli are there leaves them, with a warning."""
        self.make_cell()
        self.find_moduli()
        self.stretch_cell()
        self.fit_law()
        if self.job.frictions:
            self.export_specimen()
        for friction in self.job.frictions:
            self.compress(friction)

    def make_cell(self) -> None:
        """Analysis mesh of the cell's octant."""
        job = self.job
        with self.progress.stage("mesh of the cell", 5.0):
            self.mesh = mesh_cell(job.cell, job.mesh, self.cache.folder)
            resin = job.resin
            self.materials = cell_materials(job.cell, self.mesh, resin.modulus_MPa, resin.poisson)
            modulus, _ = self.materials.small_strain(len(self.mesh.tets))
            write_mesh(self.folder / "cell.vtu", self.mesh, modulus)
        self.context.summary["mesh"] = {"nodes": len(self.mesh.nodes), "tetrahedra": len(self.mesh.tets)}

    def find_moduli(self) -> None:
        """Effective elasticity of the endless lattice."""
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
        """The endless lattice pulled and pressed along an axis."""
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
        """The law that the analysis mesh takes, in effective.toml."""
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
        """The printable block, nominal: the printer adds its offset itself."""
        with self.progress.stage("printable specimen", 3.0):
            nominal = attrs.evolve(self.job.cell, offset_xy_mm=0.0, offset_z_mm=0.0)
            try:
                solid = specimen_solid(nominal, self.job.cells)
                write_bytes(self.folder / "specimen.stl", stl_bytes(*solid))
            except MuError as error:
                self.warn(f"No printable specimen: {error.what}.")

    def specimen(self) -> Specimen:
        """An eighth of the block that is compressed."""
        cell, resin = self.job.cell, self.job.resin
        mesh = mesh_cell(cell, self.job.block_mesh, self.cache.folder)
        materials = cell_materials(cell, mesh, resin.modulus_MPa, resin.poisson)
        return block_specimen(mesh, self.job.cells, materials)

    def compress(self, friction: Friction) -> None:
        """The block between two plates, to the strain that was asked for."""
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
        """Tell something that the user should know, now and in the report."""
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


def homogenize(job: Job, folder: Path, progress: Progress, context: RunContext) -> None:
    """Run a homogenisation and leave its report, also where it is stopped."""
    from .report import write_report

    study = Homogenisation.open(job, folder, progress, context)
    context.on_stop = lambda reason: write_report(study, reason["what"])
    study.run()
    write_report(study)


def resin_of(name: str | None, unit: Unit) -> Resin:
    """The resin of a name in the library or of a file; the unit's own without one. Raises InputError."""
    from ...materials.library import read_material

    if name is None:
        return Resin.of_unit(unit, load_material(RESIN))
    path = Path(name)
    return Resin.of(read_material(path) if path.suffix == ".toml" else load_material(name))


def console_summary(summary: Mapping[str, Any]) -> list[str]:
    """What a homogenisation found, in a few lines of text, of its `summary`."""
    moduli = summary["moduli_kPa"]
    lines = [
        f"Young's modulus {moduli['E100']:.4g} kPa along an axis of the cell, {moduli['E111']:.4g} kPa "
        f"along a strut; relative density {summary['relative_density']:.4f}"
    ]
    for friction, found in summary.get("specimen", {}).items():
        values = ", ".join(f"{name} {value:.4g} kPa" for name, value in found["modulus_kPa"].items())
        lines.append(f"block between plates ({friction}): {values}")
    return lines
