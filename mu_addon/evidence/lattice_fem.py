"""Response of the lattice to a print offset, from virtual tests of blocks between plates."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path

import attrs

from ..design.assets import asset_file, asset_names
from ..design.parameters import Printing, Unit
from ..design.strut_cell import StrutCell, relative_density, strut_cell
from ..errors import InputError
from ..files import write_text
from ..homogenize.cell_mesh import CellMeshSettings, cell_materials, mesh_cell
from ..homogenize.compression import Friction, compress
from ..homogenize.offset_response import OffsetResponse
from ..homogenize.specimen import block_specimen
from ..homogenize.stress_strain_curve import modulus
from ..measured import Experiment
from ..reading import file_text, parse_toml
from ..run.cache import Cache
from ..toml_writer import toml_text
from .prediction.lattice_compression import KIND, ComputedCell, Scaling

# Gets a block and the finished share.
Progress = Callable[[str, float], None]

SHIPPED = "responses"
# Part of every key: raise it when a change of the code changes what is computed.
REVISION = 1
# Of every surface at 1.0x. Smaller prints are looked up further out: 0.25 mm at 0.75x is 0.33 mm here.
OFFSETS_mm = (-0.05, 0.0, 0.05, 0.1, 0.15, 0.2, 0.3, 0.4)
# Order 2 with one element across a strut is within 2.5 % at every offset (docs/engineering/method.md).
MESH = CellMeshSettings(per_diameter=1.0)
STRAIN = 0.005
# Only ratios of moduli are used.
RESIN_MPa = 1.0
FRICTION: dict[str, Friction] = {"hold": "stick", "slide": "slide"}
HELD = "hold"


@attrs.frozen
class Block:
    """A compression test to compute: a cube of `cells` cells a side between two plates.

    cell: at 1.0x, as drawn. plates: "hold" (bonded faces) or "slide" (frictionless). poisson: Poisson's ratio
    of the resin.
    """

    cell: StrutCell
    cells: int
    plates: str
    poisson: float

    def key(self) -> str:
        """Hash (32 hex digits) of cell, count, plates, mesh and offsets: all that the response depends on."""
        cell = {a.name: getattr(self.cell, a.name) for a in attrs.fields(StrutCell) if a.name != "kind"}
        mesh = attrs.asdict(MESH)
        parts = [REVISION, self.cell.kind.name, cell, self.cells, self.plates, self.poisson]
        return hashlib.sha256(repr([*parts, OFFSETS_mm, mesh, STRAIN]).encode()).hexdigest()[:32]

    def __str__(self) -> str:
        straight = self.cell.junction_radius_mm == self.cell.midspan_radius_mm
        struts = f" of {2.0 * self.cell.midspan_radius_mm:.4g} mm struts (at 1.0x)" if straight else ""
        count = f"{self.cells} x {self.cells} x {self.cells}"
        return f"{count} cells{struts} between plates that {self.plates} its faces"


def _silent(what: str, share: float) -> None:
    pass


def shipped(block: Block) -> OffsetResponse | None:
    """The block's response in the program's data, or None."""
    key = block.key()
    for name in asset_names(SHIPPED):
        kept = parse_toml(file_text(asset_file(SHIPPED, "response", name)), name)
        if kept["key"] == key:
            return OffsetResponse(kept["offset_mm"], kept["modulus"], kept["density"])
    return None


def response(block: Block, cache: Path | None = None, report: Progress = _silent) -> OffsetResponse:
    """The block's response to a print offset: shipped, kept in the folder `cache`, or computed.

    report: called with the step and the share done, 0 to 1. The paper's block of 27 cells takes a minute or
    two to compute. Raises InputError for a cell that cannot be printed so, MeshingError and ConvergenceError.
    """
    known, key = shipped(block), block.key()
    if known is not None:
        return known
    table = Cache(cache) if cache else None
    stored = table.get("lattice", key) if table else None
    if stored is not None and set(stored) == {"offset_mm", "modulus", "density"}:
        return OffsetResponse(stored["offset_mm"], stored["modulus"], stored["density"])
    moduli, densities = [], []
    for done, offset in enumerate(OFFSETS_mm):
        report(f"block of {block} with {offset:g} mm of print offset", done / len(OFFSETS_mm))
        relative, density = at_offset(block, offset, cache)
        moduli.append(relative)
        densities.append(density)
    found = OffsetResponse(OFFSETS_mm, moduli, densities)
    if table:
        arrays = {"offset_mm": found.offsets_mm, "modulus": found.modulus, "density": found.density}
        table.put("lattice", key, arrays)
    return found


def at_offset(block: Block, offset_mm: float, cache: Path | None = None) -> tuple[float, float]:
    """Initial modulus over the resin's, and relative density, of a block with a print offset.

    offset_mm: of every surface, outward, at 1.0x. The modulus is the initial tangent of a finite-element
    compression to a strain of `STRAIN`; both results are ratios. Raises InputError, MeshingError and
    ConvergenceError.
    """
    cell = attrs.evolve(
        block.cell,
        offset_xy_mm=block.cell.offset_xy_mm + offset_mm,
        offset_z_mm=block.cell.offset_z_mm + offset_mm,
    )
    mesh = mesh_cell(cell, MESH, cache)
    materials = cell_materials(cell, mesh, RESIN_MPa, block.poisson)
    test = compress(
        block_specimen(mesh, block.cells, materials), (STRAIN,), FRICTION[block.plates], stability=False
    )
    return modulus(test.curve, "initial tangent") / RESIN_MPa, relative_density(cell)


def save(found: OffsetResponse, block: Block, path: Path) -> None:
    """Write a block's response as a TOML file that `response` finds among those shipped; raises OutputError.

    Values keep six significant digits.
    """
    arrays = {"offset_mm": found.offsets_mm, "modulus": found.modulus, "density": found.density}
    values = {name: [float(f"{v:.6g}") for v in array] for name, array in arrays.items()}
    head = (
        f"Modulus over the resin's, and relative density, of {block},\n"
        f"the {block.cell.kind.name} lattice at 1.0x with a print offset of every surface."
    )
    write_text(path, toml_text({"key": block.key(), **values}, head))


def printed(print_: Printing) -> tuple[float, float]:
    """Mean outward print offset in mm, (2 xy + z)/3, and skin depth times (skin factor - 1) in mm."""
    offset = (2 * print_.offset_xy_mm + print_.offset_z_mm) / 3
    return offset, print_.skin_depth_mm * (print_.skin_factor - 1)


def block_of(experiment: Experiment, unit: Unit) -> Block | None:
    """The block of a unit's lattice that an experiment compressed; None where it gives no count of cells.

    Struts are the unit's, or straight ones of the experiment's diameter. By default plates hold the faces.
    Raises InputError for a block that is no cube, and for struts that cannot be.
    """
    if experiment.cells is None:
        return None
    if len(set(experiment.cells)) > 1:
        raise InputError(
            f"a block of {experiment.cells} cells is no cube",
            experiment.name,
            "compress cubes, or omit cells: the specimen is then modelled as slender struts",
        )
    cell = strut_cell(attrs.evolve(unit, scale=1.0, print=Printing()))
    if experiment.strut_mm is not None:
        radius = 0.5 * experiment.strut_mm / experiment.scale
        cell = attrs.evolve(cell, junction_radius_mm=radius, midspan_radius_mm=radius)
    return Block(cell, experiment.cells[0], experiment.plates or HELD, unit.material.membrane_poisson)


def to_compute(experiments: Sequence[Experiment], unit: Unit) -> int:
    """Number of blocks whose response is not in the program's data; raises the errors of `block_of`."""
    blocks = {block_of(e, unit) for e in experiments if e.kind == KIND} - {None}
    return sum(shipped(block) is None for block in blocks if block is not None)


def scalings(
    experiments: Sequence[Experiment],
    unit: Unit,
    cache: Path | None = None,
    report: Progress = _silent,
) -> tuple[dict[str, Scaling], list[str]]:
    """Response of each compressed block's stiffness and mass to printing, by name of the experiment.

    Also returns the modelling assumptions, as text. All moduli are relative to that of the first block as
    drawn at 1.0x. The unit's print offset and skin are applied before any effect's. Experiments without a
    count of cells have no entry. Raises the errors of `block_of` and `response`.
    """
    blocks = {e.name: block_of(e, unit) for e in experiments if e.kind == KIND}
    distinct = list(dict.fromkeys(b for b in blocks.values() if b is not None))
    found = {b: response(b, cache, report) for b in distinct}
    assumed = [f"lattice specimens are modelled as {b}, computed from their struts" for b in distinct]
    if None in blocks.values():
        assumed.append("lattice specimens without a number of cells are modelled as slender bending struts")
    first = found[distinct[0]] if distinct else None
    return {
        n: ComputedCell(found[b], first, *printed(unit.print)) for n, b in blocks.items() if b is not None
    }, assumed
