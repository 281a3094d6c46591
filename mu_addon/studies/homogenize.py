"""`homogenize`: from a unit's struts and resin to its lattice's moduli, virtual tests and law."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import attrs

from .. import design, fem, homogenize, meshing, report
from ..design.quantity import described
from ..errors import InputError
from ..meshing.settings import REFINE
from ..run.parts import Beside, Chart, Fact, File, Part, Pictures, Sentence, Table, Warn, csv, echo, recorded
from ..run.study import (
    Dropped,
    Members,
    Node,
    Over,
    Study,
    Tell,
    derived,
    given,
    intermediate,
    section,
    setting,
    stage,
)
from .inputs import Resin, ResinInput, UnitInput, asked

FRICTIONS: tuple[homogenize.Friction, ...] = ("slide", "stick")
# Elements to a strut's diameter in the block: its cell's modulus is within 2 % of a fine mesh's.
BLOCK_PER_DIAMETER = 1.0
# Below it less than half an element to a diameter, which no cell is meshed with.
LEAST_OF_BLOCK = 0.5
# Strains of the periodic cell at which points of its curve are kept.
STRETCHES = tuple(round(0.04 * k - 0.4, 12) for k in range(21))
PLATES = {"slide": "frictionless plates", "stick": "bonded plates"}
VOIGT = ("xx", "yy", "zz", "yz", "xz", "xy")


def _with_refinement(seconds: float, least: float) -> Any:
    """Expected seconds of a stage on the cell: more than the unknowns, which grow as the refinement cubed."""
    return lambda study: max(seconds * study.refine**3.5, least)


def _block(study: Homogenize) -> float:
    return 110.0 * (study.cells / 3.0) ** 3


@attrs.frozen(kw_only=True)
class Homogenize(Study):
    """Homogenize the lattice: compute effective moduli from struts and resin, run virtual compression tests,
    and fit a law of the lattice's continuum.
    """

    name = "homogenize"
    example = "homogenize --preset mu-1.0x --out out/lattice"
    node = Node(
        "Simulate",
        "the lattice's moduli from its struts and its resin",
        (("moduli", "file", "moduli, and a law of the lattice's continuum"),),
        lambda summary: f"{summary['moduli_kPa']['E100']:.4g} kPa",
    )
    files = {
        "effective.toml": "moduli of the lattice, and a law of its continuum",
        "tensor.csv": "effective elasticity, kPa, in Voigt's order with engineering shears",
        "cell.csv": "the periodic lattice in tension and compression along an axis",
        "cell.vtu": "analysis mesh of an eighth of a cell (ParaView)",
        "cell.png": "a printed cell",
        "modulus.png": "Young's modulus in every direction",
        "specimen.stl": "printable block of cells, nominal size, mm",
        "specimen_slide.csv": "the block between frictionless plates",
        "specimen_stick.csv": "the block between bonded plates",
        "specimen_*.png": "the block between plates",
    }

    unit: design.Unit = given(UnitInput())
    resin: Resin = asked(
        ResinInput,
        "resin",
        "material of the struts: one of the library or a TOML file; empty: that of the unit's membrane",
        empty=attrs.NOTHING,
        metavar="NAME|FILE",
    )
    cells: int = setting(
        described("cells", 3, "number of cells along each side of the specimen", low=1, high=12), metavar="N"
    )
    friction: str = setting(
        described(
            "friction",
            "both",
            "contact of the specimen with the plates: frictionless (slide), bonded (stick), both, or none "
            "for the periodic lattice alone",
            choices=("both", *FRICTIONS, "none"),
        )
    )
    strain: float = setting(
        described("strain", 0.4, "largest nominal compressive strain", low=0.01, high=0.8), metavar="E"
    )
    refine: float = setting(
        REFINE._replace(text="mesh refinement: the cell's element size is divided by it", low=0.3, high=4.0),
        metavar="F",
    )

    def __attrs_post_init__(self) -> None:
        if self.frictions and self.refine < LEAST_OF_BLOCK:
            raise InputError(
                f"refine = {self.refine:g} is too coarse for the specimen",
                "refine",
                f"give {LEAST_OF_BLOCK:g} or more, or leave the specimen out (friction none)",
            )

    @property
    def frictions(self) -> tuple[homogenize.Friction, ...]:
        """Contacts of the specimen that are simulated."""
        return tuple(f for f in FRICTIONS if self.friction in (f, "both"))

    @property
    def strains(self) -> tuple[float, ...]:
        """Nominal strains of the specimen's test."""
        return (*(s for s in homogenize.STRAINS if s < self.strain - 1e-9), self.strain)

    # What the stages take of the inputs.

    @derived
    def cell(self, unit: design.Unit) -> design.StrutCell:
        """Cell of the unit, as printed."""
        from ..design.strut_cell import strut_cell

        return strut_cell(unit)

    @derived
    def shape(self, cell: design.StrutCell) -> design.StrutCell:
        """The printed cell at a size of 2 mm, without its skin: all that its mesh depends on."""
        lengths = {
            name: round(getattr(cell, name) / cell.half_mm, 12)
            for name in ("size_mm", "junction_radius_mm", "midspan_radius_mm", "offset_xy_mm", "offset_z_mm")
        }
        return attrs.evolve(cell, **lengths, skin_depth_mm=0.0, skin_factor=1.0)

    @derived
    def fine(self, refine: float) -> homogenize.CellMeshSettings:
        """Settings of the cell's mesh."""
        standard = homogenize.CellMeshSettings()
        return attrs.evolve(standard, per_diameter=standard.per_diameter * refine)

    @derived
    def coarse(self, fine: homogenize.CellMeshSettings, refine: float) -> homogenize.CellMeshSettings:
        """Settings of each cell's mesh in the block: coarse, as there are many."""
        return attrs.evolve(fine, per_diameter=BLOCK_PER_DIAMETER * refine)

    @derived
    def stiffness(self, resin: Resin) -> tuple[float, float]:
        """Young's modulus in MPa and Poisson's ratio of the resin."""
        return resin.modulus_MPa, resin.poisson

    @derived
    def stretches(self) -> tuple[float, ...]:
        """Nominal strains of the periodic cell."""
        return STRETCHES

    @derived
    def documents(self) -> str:
        """All inputs as text."""
        return "".join(self.texts().values())

    # The periodic cell.

    @stage("mesh of the cell", _with_refinement(30.0, 4.0))
    def octant(self, shape: design.StrutCell, fine: homogenize.CellMeshSettings, tell: Tell) -> meshing.Mesh:
        """An eighth of the cell, at a size of 2 mm."""
        mesh = homogenize.mesh_cell(shape, fine)
        tell.made(f"{len(mesh.nodes)} nodes and {len(mesh.tets)} elements")
        return mesh

    @intermediate()
    def mesh(self, octant: meshing.Mesh, cell: design.StrutCell) -> meshing.Mesh:
        """The eighth at the cell's size."""
        return attrs.evolve(octant, nodes=octant.nodes * cell.half_mm)

    @intermediate()
    def filled(
        self, mesh: meshing.Mesh, cell: design.StrutCell, stiffness: tuple[float, float]
    ) -> fem.Materials:
        """Resin in every element of the eighth."""
        return homogenize.cell_materials(cell, mesh, *stiffness)

    @stage("moduli", _with_refinement(5.0, 0.5))
    def elasticity(self, mesh: meshing.Mesh, filled: fem.Materials) -> homogenize.Elasticity:
        """Effective elasticity of the infinite lattice."""
        return homogenize.effective_tensor(mesh, filled)

    @stage("stretch of the cell", _with_refinement(35.0, 4.0))
    def stretched(
        self, mesh: meshing.Mesh, filled: fem.Materials, stretches: tuple[float, ...], tell: Tell
    ) -> homogenize.Stretched:
        """Tension and compression of the infinite lattice along an axis, without the states themselves."""
        done = iter(range(1, len(stretches) + 1))
        found = homogenize.stretch_lattice(
            mesh, filled, stretches, lambda _: tell(next(done) / len(stretches))
        )
        return attrs.evolve(found, points=())

    @stage("law", _with_refinement(12.0, 3.5), failing="No law for the analysis mesh, and no effective.toml")
    def fit(self, stretched: homogenize.Stretched, elasticity: homogenize.Elasticity) -> homogenize.FoamFit:
        """Law of the lattice's continuum."""
        e = elasticity
        return homogenize.fit_foam(stretched.curve, e.C11, e.C12, e.C44)

    @stage("law", failing="No law for the analysis mesh, and no effective.toml")
    def effective(
        self,
        fit: homogenize.FoamFit,
        elasticity: homogenize.Elasticity,
        cell: design.StrutCell,
        resin: Resin,
        documents: str,
    ) -> str:
        """The lattice's moduli and law with their origin, as effective.toml has them."""
        return homogenize.effective_text(fit, elasticity, cell_table(cell), attrs.asdict(resin), documents)

    # The block between plates.

    @stage("printable specimen", 2.0, wanted=lambda study: study.frictions, failing="No printable specimen")
    def block(self, cell: design.StrutCell, cells: int) -> bytes:
        """STL of the printable block at nominal size: the printer adds its offset itself."""
        from ..design.strut_cell import specimen_solid
        from ..design.surface import stl_bytes

        nominal = attrs.evolve(cell, offset_xy_mm=0.0, offset_z_mm=0.0)
        return stl_bytes(*specimen_solid(nominal, cells))

    @stage("mesh of the specimen", lambda study: 4.0, wanted=lambda study: study.frictions)
    def block_octant(self, shape: design.StrutCell, coarse: homogenize.CellMeshSettings) -> meshing.Mesh:
        """An eighth of the block's cell, at a size of 2 mm."""
        return homogenize.mesh_cell(shape, coarse)

    @intermediate()
    def specimen(
        self, block_octant: meshing.Mesh, cell: design.StrutCell, cells: int, stiffness: tuple[float, float]
    ) -> homogenize.Specimen:
        """An eighth of the block to be compressed."""
        mesh = attrs.evolve(block_octant, nodes=block_octant.nodes * cell.half_mm)
        return homogenize.block_specimen(mesh, cells, homogenize.cell_materials(cell, mesh, *stiffness))

    @intermediate(Over(("contact",), lambda study: study.frictions))
    def plates(self, contact: homogenize.Friction, specimen: homogenize.Specimen) -> homogenize.Plates:
        """The plates and the block's equations."""
        return homogenize.Plates(specimen, contact)

    @stage(
        "specimen, {contact}",
        _block,
        over=Over(
            ("contact", "at"),
            lambda study: [(f, strain) for f in study.frictions for strain in study.strains],
            lambda study, member: {
                "plates": member[0],
                "states": [(member[0], s) for s in study.strains if s < member[1]],
            },
        ),
        failing="The specimen was not compressed ({contact})",
    )
    def states(
        self, contact: homogenize.Friction, at: float, plates: homogenize.Plates, states: Members
    ) -> homogenize.Reached:
        """The block compressed to a strain, from the states before it."""
        earlier = list(states.values())
        if earlier and earlier[-1].ended:
            raise Dropped
        return plates.reached(at, earlier)

    @stage(
        "limits of the specimen, {contact}",
        _block,
        over=Over(
            ("contact",),
            lambda study: study.frictions,
            lambda study, friction: {"states": [(friction, s) for s in study.strains]},
        ),
    )
    def limits(
        self, contact: homogenize.Friction, specimen: homogenize.Specimen, states: Members
    ) -> homogenize.Limits:
        """Where struts meet, and where the block buckles."""
        if not states:
            raise Dropped
        return homogenize.limits_of(specimen, contact, list(states.values()))

    @intermediate(
        Over(
            ("contact",),
            lambda study: study.frictions,
            lambda study, friction: {
                "limits": friction,
                "states": [(friction, strain) for strain in study.strains],
            },
        ),
    )
    def tests(
        self,
        contact: homogenize.Friction,
        specimen: homogenize.Specimen,
        states: Members,
        limits: homogenize.Limits,
    ) -> homogenize.Compression:
        """The block's test."""
        return homogenize.compression_of(specimen, contact, list(states.values()), limits)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the cell and its resin."""
        cell = self.cell(self.unit)
        return f"From struts to moduli: the lattice of {self.unit.name}", (
            f"Cell of {cell.size_mm:g} mm, {cell.kind.name}, struts of {2 * cell.junction_radius_mm:g} to "
            f"{2 * cell.midspan_radius_mm:g} mm, resin of {kPa(1e3 * self.resin.modulus_MPa)}"
        )

    @section()
    def answer(
        self,
        unit: design.Unit,
        cell: design.StrutCell,
        cells: int,
        resin: Resin,
        elasticity: homogenize.Elasticity,
        tests: Mapping[str, homogenize.Compression] | None = None,
    ) -> Iterator[Part]:
        """The moduli, beside those of the unit's parameters."""
        from ..design.strut_cell import mass_g

        e, mass = elasticity, mass_g(cell, resin.density_g_per_ml, cells)
        yield Sentence(
            f"Along its axes this lattice has a Young's modulus of {kPa(1e3 * e.E100)}; along its struts it "
            f"is {e.E111 / e.E100:.1f} times as stiff.",
            answer=True,
            strong=kPa(1e3 * e.E100),
        )
        yield from echo(
            f"Young's modulus {1e3 * e.E100:.4g} kPa along an axis of the cell, {1e3 * e.E111:.4g} kPa along "
            f"a strut; relative density {e.relative_density:.4f}"
        )
        words = []
        if tests:
            found = {
                f: 1e3 * homogenize.moduli(t.curve).get(homogenize.DEFAULT, float("nan"))
                for f, t in tests.items()
            }
            listed = " and ".join(f"{kPa(v)} between {PLATES[f]}" for f, v in found.items())
            words.append(
                f"A block of {cells} x {cells} x {cells} cells has {listed} ({homogenize.DEFAULT} of strain)."
            )
        measured = unit.material.lattice_modulus_kPa
        ratio = measured / (1e3 * e.E100)
        words.append(
            f"A measured block has {kPa(measured)} by the unit's parameters, {ratio:.2g} times the "
            "prediction: "
            + (
                "they agree within 10 %."
                if 0.9 < ratio < 1.1
                else "resin, print offset or strut diameters differ from the values assumed here. The mass "
                "of a printed specimen shows which: see the computed mass below."
            )
        )
        yield Sentence(" ".join(words))
        yield Fact("relative density", e.relative_density, f"{e.relative_density:.1%}", "relative_density")
        yield Fact(f"mass of {cells}³ cells", mass, f"{mass:.3g} g", "specimen_mass_g")
        yield Fact("E along an axis", 1e3 * e.E100, kPa(1e3 * e.E100), "moduli_kPa.E100")
        yield Fact("E along a strut", 1e3 * e.E111, kPa(1e3 * e.E111), "moduli_kPa.E111")
        yield Fact("Poisson's ratio", e.nu100, f"{e.nu100:.3f}", "poisson_100")
        yield Fact("Zener's ratio", e.zener, f"{e.zener:.2f}", "zener")
        for name in ("C11", "C12", "C44", "E110", "bulk", "shear"):
            yield recorded(f"moduli_kPa.{name}", 1e3 * getattr(e, name))
        yield recorded("cubic_error", e.cubic_error)

    @section("cell", "The cell and its moduli")
    def moduli(
        self,
        cell: design.StrutCell,
        mesh: meshing.Mesh,
        filled: fem.Materials,
        elasticity: homogenize.Elasticity | None = None,
    ) -> Iterator[Part]:
        """The effective elasticity, drawn and as a table."""
        from ..report.vtk import write_mesh

        yield recorded("mesh.nodes", len(mesh.nodes))
        yield recorded("mesh.tetrahedra", len(mesh.tets))
        modulus, _ = filled.small_strain(len(mesh.tets))
        yield File("cell.vtu", lambda path: write_mesh(path, mesh, modulus))
        if elasticity is None:
            return
        e = elasticity
        rows = [(name, *(f"{1e3 * c:.9g}" for c in row)) for name, row in zip(VOIGT, e.C, strict=True)]
        yield csv("tensor.csv", ["C_kPa", *VOIGT], rows)

        def pictures() -> list[tuple[str, Any]]:
            faces = report.skin(mesh.tets)
            shown = report.cell_picture(mesh.nodes, faces, cell.size_mm, e.relative_density)
            return [("cell.png", shown), ("modulus.png", report.modulus_surface(e.C))]

        yield Pictures(pictures)
        yield Table(
            "Effective elasticity of the periodic lattice, kPa.",
            ["", *Table.numbers(*VOIGT)],
            [
                (name, *(f"{1e3 * c:.4g}" if c else "0" for c in row))
                for name, row in zip(VOIGT, e.C, strict=True)
            ],
        )
        yield Sentence(
            f"A cubic tensor has three constants; this one is cubic to {e.cubic_error:.2%}, which is mesh "
            "error unless the print offset differs along z."
        )

    @section("test", "Block between plates")
    def compressed(
        self,
        cells: int,
        block: bytes | None = None,
        tests: Mapping[str, homogenize.Compression] | None = None,
        stretched: homogenize.Stretched | None = None,
    ) -> Iterator[Part]:
        """The block's stress-strain curves and moduli."""
        if block is not None:
            yield File("specimen.stl", block)
        if not tests:
            return
        rows: list[tuple[str, ...]] = []
        best: list[int] = []
        for friction, found in tests.items():
            curve = found.curve
            values = homogenize.moduli(curve)
            points = zip(curve.strain, curve.stress_MPa, curve.lateral, found.valid, strict=True)
            yield csv(
                f"specimen_{friction}.csv",
                ["strain", "stress_kPa", "lateral_stretch_x", "lateral_stretch_y", "valid"],
                [
                    (f"{-e:.9g}", f"{-1e3 * s:.9g}", f"{a:.9g}", f"{b:.9g}", int(valid))
                    for e, s, (a, b), valid in list(points)[::-1]
                ],
            )
            yield recorded(f"specimen.{friction}.modulus_kPa", {p: 1e3 * m for p, m in values.items()})
            yield recorded(f"specimen.{friction}.valid_to_strain", found.valid_to_strain)
            yield recorded(f"specimen.{friction}.why", found.why)
            shown = ", ".join(f"{name} {1e3 * value:.4g} kPa" for name, value in values.items())
            yield from echo(f"block between plates ({friction}): {shown}")
            for procedure, value in values.items():
                needs = {"slope 0-40 %": 0.4, "secant at 40 %": 0.4, homogenize.DEFAULT: 0.1}.get(
                    procedure, 0.0
                )
                beyond = "beyond its validity" if needs > found.valid_to_strain + 1e-9 else ""
                best += [len(rows)] if procedure == homogenize.DEFAULT else []
                rows.append((procedure, PLATES[friction], f"{1e3 * value:.3g}", beyond))
        yield Sentence(
            f"{cells} x {cells} x {cells} cells, cut flat, between two rigid plates. Real plates lie between "
            "two bounds: frictionless and bonded."
        )

        named = {PLATES[f]: t for f, t in tests.items()}
        yield Beside(
            [
                Chart(
                    lambda: report.compression_chart(report.lines_of(named, stretched)),
                    "Nominal stress of the block and of the periodic lattice. Dot: end of the valid range, "
                    "for the reason below; a test would not follow the dotted part.",
                    "Nominal stress against compression.",
                ),
                Table(
                    "Modulus by evaluation procedure. The paper does not give its procedure; the marked one "
                    "is used here.",
                    ["procedure", "plates", ("modulus [kPa]", "n"), ""],
                    rows,
                    best,
                ),
            ]
        )
        for friction, found in tests.items():
            yield Sentence(f"Between {PLATES[friction]}: {found.why}.")

        one = tests.get("stick") or next(iter(tests.values()))
        yield Pictures(lambda: report.test_pictures(one))

    @section("law", "Lattice law for the analysis mesh")
    def law(
        self,
        stretched: homogenize.Stretched,
        fit: homogenize.FoamFit | None = None,
        effective: str | None = None,
    ) -> Iterator[Part]:
        """The law beside the cell that it is fitted to."""
        curve = stretched.curve
        points = zip(curve.strain, curve.stress_MPa, curve.lateral, strict=True)
        yield csv(
            "cell.csv",
            ["strain", "stress_kPa", "lateral_stretch_x", "lateral_stretch_y"],
            [(f"{e:.9g}", f"{1e3 * s:.9g}", f"{a:.9g}", f"{b:.9g}") for e, s, (a, b) in points],
        )
        yield recorded("cell_curve.strain", [float(curve.strain[0]), float(curve.strain[-1])])
        yield recorded("cell_curve.stopped", stretched.stopped)
        if stretched.stopped:
            yield Warn(f"The curve of the periodic lattice ends early: {stretched.stopped}.")
        if fit is None:
            return
        if effective is not None:
            yield File("effective.toml", effective)
        yield recorded("law.misfit", attrs.asdict(fit.misfit))
        small = {"E_kPa": 1e3 * fit.E_MPa, "poisson": fit.poisson, "C44_kPa": 1e3 * fit.C44_MPa}
        yield recorded("law.small_strain", small)
        yield recorded("law.stretch", fit.stretch)
        low, high, m = *fit.stretch, fit.misfit
        yield Sentence(
            "Compressible foam with separate parameters in tension and compression, in parallel with a cubic "
            "shear term that raises the shear modulus to the cell's. Valid for the lattice between stretches "
            f"of {low:g} and {high:g} along the axes; misfit (root mean square) {m.tension:.1%} of the "
            f"largest stress in tension, {m.compression:.1%} in compression, {m.lateral:.0%} of the largest "
            "lateral strain."
        )

        along = "Stress along an axis."
        aside = "Lateral stretch: a foam law cannot follow the kinematics of the struts."
        yield Beside(
            [
                Chart(lambda: report.stretch_chart(curve, fit, lateral=False), along, along),
                Chart(lambda: report.stretch_chart(curve, fit, lateral=True), aside, aside),
            ]
        )
        yield Table(
            "At small strain.",
            ["", *Table.numbers("cell", "law")],
            [
                ("E along an axis [kPa]", f"{1e3 * fit.cell_E_MPa:.4g}", f"{1e3 * fit.E_MPa:.4g}"),
                ("Poisson's ratio", f"{fit.cell_poisson:.3f}", f"{fit.poisson:.3f}"),
                ("C44 [kPa]", f"{1e3 * fit.cell_C44_MPa:.4g}", f"{1e3 * fit.C44_MPa:.4g}"),
            ],
        )

    @section("inputs", "Inputs")
    def listed(
        self, cell: design.StrutCell, resin: Resin, octant: meshing.Mesh | None = None
    ) -> Iterator[Part]:
        """The cell and the resin, with the mesh."""
        yield recorded("inputs.cell", cell_table(cell))
        yield recorded("inputs.resin", attrs.asdict(resin))
        rows = {
            "lattice": cell.kind.name,
            "cell [mm]": cell.size_mm,
            "strut at a junction [mm]": 2 * cell.junction_radius_mm,
            "strut at mid-span [mm]": 2 * cell.midspan_radius_mm,
            "print offset in the plane [mm]": cell.offset_xy_mm,
            "print offset along z [mm]": cell.offset_z_mm,
            "skin depth [mm]": cell.skin_depth_mm,
            "skin modulus over core modulus": cell.skin_factor,
            "resin": resin.name,
            "resin's Young's modulus [kPa]": 1e3 * resin.modulus_MPa,
            "resin's Poisson's ratio": resin.poisson,
            "resin's density [g/ml]": resin.density_g_per_ml,
        }
        if octant is not None:
            rows |= {"mesh: nodes": len(octant.nodes), "mesh: tetrahedra": len(octant.tets)}
        yield Table("", ["input", "value"], list(rows.items()))


def kPa(value: float) -> str:
    """A stress in kPa to three figures."""
    return f"{value:.0f} kPa" if abs(value) >= 1000 else f"{value:.3g} kPa"


def cell_table(cell: design.StrutCell) -> dict[str, str | float]:
    """A printed cell as text and numbers."""
    numbers = {f.name: float(getattr(cell, f.name)) for f in attrs.fields(type(cell)) if f.name != "kind"}
    return {"kind": cell.kind.name} | numbers
