"""`specimens`: parts to print and to test, their data sheet, and templates for what is measured on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import attrs

from .. import design, materials
from ..design.settings import PRESET, PRINTER, USUAL_RESIN
from ..errors import OutputError
from ..files import json_text
from ..run.inputs import digest
from ..run.parts import File, Part, Sentence, Table, echo, recorded
from ..run.study import Members, Over, Study, derived, given, section, stage
from .inputs import MaterialInput, PrinterInput, UnitInput, asked

SCALES = (0.75, 1.0, 1.5)
CELLS = 3
TEMPLATE = "measured"


@attrs.frozen(eq=False)
class Specimen:
    """One part: its surface, the measurement, and its experiment in a folder of measured data.

    kind: of `measured.kinds`, "" for a part that is no experiment; keys: of the experiment; columns: to be
    recorded.
    """

    name: str
    make: Callable[[], Any]
    measure: str
    kind: str = ""
    keys: Mapping[str, Any] = attrs.field(factory=dict)
    columns: tuple[str, ...] = ()
    scale: float = 1.0
    copies: int = 1


@attrs.frozen(eq=False)
class Printed:
    """A part's STL, its volume in mm3 and its size (3,) in mm."""

    stl: bytes
    volume_mm3: float
    size_mm: tuple[float, ...]


@attrs.frozen(kw_only=True, eq=False)
class Specimens(Study):
    """Write test specimens as STL: lattice cubes, coupons, a gauge for the printer and a part for each of its
    limits, with data sheets for the measurements.
    """

    name = "specimens"
    example = "specimens --out out/specimens"
    files = {
        "*.stl": "the specimens, of nominal size",
        "manifest.json": "volumes, masses, sizes and SHA-256 of all specimens",
        "gauge.csv": "sheet for the gauge's sizes, of `export --compensate`",
        "limits.csv": "sheet for the printer's limits, of `check --limits`",
        TEMPLATE: "templates that `diagnose` reads once they are filled in",
    }

    to_fill = ("gauge.csv", "limits.csv", TEMPLATE)

    unit: design.Unit = given(UnitInput(default=PRESET))
    resin: materials.Material | None = asked(
        MaterialInput,
        "resin",
        "resin for masses, a name of the library or a TOML file; empty: Elastic 50A, V1",
        metavar="NAME|FILE",
    )
    # The parts named limit-... show its limits.
    printer: design.Printer = given(PrinterInput(descriptions=(PRINTER,), metavar="NAME|FILE"))

    @derived
    def parts(self, unit: design.Unit, printer: design.Printer) -> dict[str, Specimen]:
        """Every part by its name."""
        return parts_of(unit, printer)

    @derived
    def material(self, resin: materials.Material | None) -> materials.Material:
        """The resin that gives the masses."""
        return resin or materials.load_material(USUAL_RESIN)

    @stage(
        "specimens",
        4.0,
        kept=False,
        over=Over(("part",), lambda study: list(parts_of(study.unit, study.printer))),
    )
    def printed(self, part: str, unit: design.Unit, printer: design.Printer) -> Printed:
        """A part's STL, read back."""
        import numpy as np

        from ..design.surface import bad_edges, stl_bytes, stl_surface, volume

        vertices, triangles = parts_of(unit, printer)[part].make()
        enclosed, content = volume(vertices, triangles), stl_bytes(vertices, triangles)
        points, faces = stl_surface(content)
        again = volume(points, faces)
        if bad_edges(faces) or abs(again / enclosed - 1.0) > 1e-4:
            raise OutputError(
                f"{part}.stl, read back, encloses {again:.3f} mm3 and not {enclosed:.3f}, or is open",
                f"{part}.stl",
                "report it; do not print this part",
            )
        return Printed(content, enclosed, tuple(np.ptp(vertices, axis=0).tolist()))

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the unit."""
        return "Specimens", f"of {self.unit.name}, scale {self.unit.scale:g}"

    @section()
    def answer(self, material: materials.Material) -> Iterator[Part]:
        """How to print them."""
        yield Sentence(
            "Print all specimens with z upward, wash and cure them like the unit, and wait a day. The mass "
            f"is that of {material.name} at nominal size: a heavier part has thicker struts."
        )

    @section("parts", "Parts")
    def listed(
        self, parts: dict[str, Specimen], printed: Members, material: materials.Material
    ) -> Iterator[Part]:
        """Every part that is made."""
        rows = []
        for name, made in printed.items():
            one = parts[name]
            mass = made.volume_mm3 / 1e3 * material.density_g_per_ml
            yield File(f"{name}.stl", made.stl)
            yield from echo(f"{name}.stl: {mass:.2f} g, {one.measure}")
            rows.append(
                {
                    "name": name,
                    "file": f"{name}.stl",
                    "copies": one.copies,
                    "volume_mm3": made.volume_mm3,
                    "mass_g": mass,
                    "size_mm": made.size_mm,
                    "measure": one.measure,
                    "kind": one.kind,
                    "sha256": digest(made.stl),
                }
            )
        listed = {"resin": material.name, "density_g_per_ml": material.density_g_per_ml, "specimens": rows}
        for key, value in listed.items():
            yield recorded(key, value)
        yield File("manifest.json", lambda path: json_text(listed))
        head = ["file", *Table.numbers("copies", "size [mm]", "mass [g]"), "experiment", "measure"]
        yield Table(
            "",
            head,
            [
                (
                    row["file"],
                    str(row["copies"]),
                    " x ".join(f"{s:.4g}" for s in row["size_mm"]),
                    f"{row['mass_g']:.2f}",
                    row["kind"] or "-",
                    row["measure"],
                )
                for row in rows
            ],
        )
        yield from echo(
            f"report.html lists the measurements; {TEMPLATE}/ holds the templates that `diagnose` reads"
        )

    @section("gauge", "Gauge: caliper measurements")
    def gauge(self) -> Iterator[Part]:
        """The sheet of the gauge."""
        from ..design.coupons import FEATURES
        from ..design.printing.sheets import gauge_sheet

        yield _to_fill("gauge.csv", gauge_sheet)
        yield Sentence(
            "Write the sizes into gauge.csv, in millimetres; leave cells empty where a size cannot be "
            "measured. Then `run.py export --compensate gauge.csv` compensates the print offset. Solids come "
            "out larger by twice the offset, gaps smaller; the long sizes separate shrinkage from the offset."
        )
        names = ("size", "where", "kind", "along")
        yield Table(
            "",
            [*names, *Table.numbers("nominal [mm]", "measured [mm]")],
            [(f.name, f.where, f.kind, f.axis, f"{f.nominal_mm:g}", "") for f in FEATURES],
        )

    @section("limits", "Limits of the printer")
    def limits(self, unit: design.Unit, printer: design.Printer) -> Iterator[Part]:
        """The sheet of the limits."""
        from ..design.printing.sheets import limit_sheet

        found = design.limit_parts(printer, math.sqrt(0.75) * unit.dimensions.cell)
        yield _to_fill("limits.csv", lambda: limit_sheet(found))
        yield Sentence(
            "Parts named limit-... have a row of features from too fine to safe, the first next to the "
            "notched corner. Write into limits.csv the finest feature that was printed, if all safer ones "
            "were, too. Then `run.py check --limits limits.csv` uses these limits in place of published or "
            "assumed ones."
        )

    @section()
    def template(self, parts: dict[str, Specimen]) -> Iterator[Part]:
        """The folder of measured data to be filled in."""
        for one in parts.values():
            for letter in "ABC"[: one.copies] if one.kind else "":
                header = ",".join(one.columns) + "\n"
                yield _to_fill(f"{TEMPLATE}/{one.name}-{letter}.csv", header.__str__)
        yield _to_fill(f"{TEMPLATE}/experiments.toml", lambda: experiments(parts))


def _to_fill(name: str, text: Callable[[], str]) -> File:
    """A file that is filled in at the bench: one that is there is left."""
    return File(name, lambda path: None if path.exists() else text())


def parts_of(unit: design.Unit, printer: design.Printer) -> dict[str, Specimen]:
    """Every part by its name."""
    limits = design.limit_parts(printer, math.sqrt(0.75) * unit.dimensions.cell)
    every = [*specimens(unit), *(Specimen(p.name, p.make, p.measure) for p in limits)]
    return {one.name: one for one in every}


def experiments(parts: Mapping[str, Specimen]) -> str:
    """Text of experiments.toml for the parts that are experiments, without measured values."""
    from ..measured.kinds import KINDS
    from ..toml_writer import toml_value

    lines = ["# Fill in measured values, delete the others; see docs/guide/measure.md for every key."]
    for one in (s for s in parts.values() if s.kind):
        for letter in "ABC"[: one.copies]:
            name = f"{one.name}-{letter}"
            lines += [
                "",
                "[[experiment]]",
                f"name = {toml_value(name)}",
                f"kind = {toml_value(one.kind)}",
                f"file = {toml_value(f'{name}.csv')}",
                f"role = {toml_value('held_out' if letter == 'C' else 'fit')}",
                f"scale = {one.scale:g}",
                f"specimen = {toml_value(letter)}",
            ]
            for key, value in one.keys.items():
                lines.append(f"# {key} =   # as weighed" if value is None else f"{key} = {toml_value(value)}")
    lines += [
        "",
        "# The unit itself, with a camera for its angle (kind unit_pressure), and its valve shut",
        "# (kind pressure_hold), columns " + ", ".join(KINDS["unit_pressure"].columns) + ".",
    ]
    return "\n".join(lines) + "\n"


def specimens(unit: design.Unit) -> list[Specimen]:
    """Every specimen of a unit's design, of nominal size; the paper tested three cubes a scale."""
    from ..design import coupons
    from ..design.strut_cell import specimen_solid, strut_cell

    force = ("displacement_mm", "force_N")
    gauge = "measure every size of gauge.csv with calipers; `export --compensate gauge.csv` uses them"
    found = [Specimen("gauge", coupons.gauge, gauge)]
    for scale in SCALES:
        scaled = attrs.evolve(unit, scale=scale)
        nominal = attrs.evolve(strut_cell(scaled), offset_xy_mm=0.0, offset_z_mm=0.0)
        side = round(CELLS * nominal.size_mm, 4)
        found.append(
            Specimen(
                f"cube-{scale:g}x",
                lambda cell=nominal: specimen_solid(cell, CELLS),  # type: ignore[misc]
                "weigh it; compress it between plates to 40 % at 10 mm/min along its build axis",
                "lattice_compression",
                {
                    "cells": [CELLS] * 3,
                    "section_mm": [side] * 2,
                    "length_mm": side,
                    "axis": "z",
                    "mass_g": None,
                },
                force,
                scale,
                3,
            )
        )
    d = unit.dimensions
    strut = round(math.sqrt(math.pi) / 2.0 * d.junction_diameter, 4)
    length = 3.0 * d.cell
    pulled = {"mode": "uniaxial", "length_mm": coupons.GAUGE_MM, "axis": "z"}
    square = [d.waveguide_section] * 2
    return [
        *found,
        Specimen(
            "strut",
            lambda: coupons.strut_coupon(d),
            "diameter at three places, give section_mm of the same area; weigh it; pull it to 50 %",
            "coupon",
            {"mode": "uniaxial", "section_mm": [strut] * 2} | pulled,
            force,
            unit.scale,
            3,
        ),
        Specimen(
            "wall",
            lambda: coupons.wall_coupon(d),
            "width and thickness at three places; weigh it; pull it to 50 %",
            "coupon",
            {"mode": "uniaxial", "section_mm": [coupons.STRIP_MM, round(d.wall, 4)]} | pulled,
            force,
            unit.scale,
            3,
        ),
        Specimen(
            "beam",
            lambda: coupons.beam_coupon(d),
            "clamp the block with the beam level; record the tip deflection under each weight",
            "beam_deadweight",
            {"section_mm": square, "length_mm": coupons.ARM_MM},
            ("added_mass_g", "tip_deflection_mm"),
            unit.scale,
        ),
        Specimen(
            "waveguide",
            lambda: coupons.waveguide_coupon(d, length),
            "insert light source and detector into the seats; bend it between two arms, wells outward",
            "waveguide_bending",
            {"section_mm": square, "length_mm": round(length, 4)},
            ("time_s", "angle_deg", "voltage_V"),
            unit.scale,
        ),
    ]
