"""Specimens ready to print, their data sheets, and a folder of templates for the measurements."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from ...design import coupons
from ...design.parameters import Unit, read_unit, to_toml
from ...design.printing.limit_parts import LimitPart, limit_parts
from ...design.printing.printer import Printer, load_printer, printer_text, read_printer
from ...design.printing.sheets import gauge_sheet, limit_sheet
from ...design.settings import USUAL_RESIN
from ...design.strut_cell import specimen_solid, strut_cell
from ...design.surface import Triangles, Vertices, bad_edges, stl_bytes, stl_surface, volume
from ...errors import OutputError
from ...files import write_bytes, write_json, write_text
from ...measured.kinds import KINDS
from ...report.html import page, table
from ...run.context import RunContext
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, read_inputs
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from ...toml_writer import toml_text, toml_value
from .job import UNIT, read_resin, resin_of, resin_text

if TYPE_CHECKING:
    from ...materials.library import Material

SCALES = (0.75, 1.0, 1.5)
CELLS = 3
TEMPLATE = "measured"
LAYOUT = FolderLayout(
    "specimens.toml",
    "# The inputs of these specimens; unit.toml beside it belongs to them.",
    results=("*.stl", "manifest.json", "gauge.csv", "limits.csv", "sheet.html", TEMPLATE),
)
PRINTER = "printer.toml"

Surface = tuple[Vertices, Triangles]


@attrs.frozen(eq=False)
class Specimen:
    """One part: its design, the measurement, and its experiment in a folder of measured data.

    kind: of `measured.kinds`, "" for the gauge; keys: of the experiment; columns: to be recorded.
    """

    name: str
    make: Callable[[], Surface]
    measure: str
    kind: str = ""
    keys: Mapping[str, Any] = attrs.field(factory=dict)
    columns: tuple[str, ...] = ()
    scale: float = 1.0
    copies: int = 1


def specimens(unit: Unit, scales: tuple[float, ...] = SCALES, cells: int = CELLS) -> list[Specimen]:
    """Every specimen of a unit's design, of nominal size; the paper tested three cubes a scale."""
    found = [
        Specimen(
            "gauge",
            coupons.gauge,
            "measure every size of gauge.csv with calipers; `export --compensate gauge.csv` uses them",
        )
    ]
    for scale in scales:
        scaled = attrs.evolve(unit, scale=scale)
        nominal = attrs.evolve(strut_cell(scaled), offset_xy_mm=0.0, offset_z_mm=0.0)
        found.append(
            Specimen(
                f"cube-{scale:g}x",
                lambda cell=nominal: specimen_solid(cell, cells),  # type: ignore[misc]
                "weigh it; compress it between plates to 40 % at 10 mm/min along its build axis",
                "lattice_compression",
                {
                    "cells": [cells] * 3,
                    "section_mm": [round(cells * nominal.size_mm, 4)] * 2,
                    "length_mm": round(cells * nominal.size_mm, 4),
                    "axis": "z",
                    "mass_g": None,
                },
                ("displacement_mm", "force_N"),
                scale,
                3,
            )
        )
    d = unit.dimensions
    side = float(np.sqrt(np.pi) / 2.0 * d.junction_diameter)
    length = 3.0 * d.cell
    found += [
        Specimen(
            "strut",
            lambda: coupons.strut_coupon(d),
            "diameter at three places, give section_mm of the same area; weigh it; pull it to 50 %",
            "coupon",
            {
                "mode": "uniaxial",
                "section_mm": [round(side, 4)] * 2,
                "length_mm": coupons.GAUGE_MM,
                "axis": "z",
            },
            ("displacement_mm", "force_N"),
            unit.scale,
            3,
        ),
        Specimen(
            "wall",
            lambda: coupons.wall_coupon(d),
            "width and thickness at three places; weigh it; pull it to 50 %",
            "coupon",
            {
                "mode": "uniaxial",
                "section_mm": [coupons.STRIP_MM, round(d.wall, 4)],
                "length_mm": coupons.GAUGE_MM,
                "axis": "z",
            },
            ("displacement_mm", "force_N"),
            unit.scale,
            3,
        ),
        Specimen(
            "beam",
            lambda: coupons.beam_coupon(d),
            "clamp the block with the beam level; record the tip deflection under each weight",
            "beam_deadweight",
            {"section_mm": [d.waveguide_section] * 2, "length_mm": coupons.ARM_MM},
            ("added_mass_g", "tip_deflection_mm"),
            unit.scale,
        ),
        Specimen(
            "waveguide",
            lambda: coupons.waveguide_coupon(d, length),
            "insert light source and detector into the seats; bend it between two arms, wells outward",
            "waveguide_bending",
            {"section_mm": [d.waveguide_section] * 2, "length_mm": round(length, 4)},
            ("time_s", "angle_deg", "voltage_V"),
            unit.scale,
        ),
    ]
    return found


@attrs.frozen(eq=False)
class Job:
    """Inputs of the specimens: the unit, its resin, and parts for a printer's limits."""

    unit: Unit
    resin: Material | None
    printer: Printer = attrs.field(factory=load_printer)

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; specimens.toml is the first."""
        resin = USUAL_RESIN if self.resin is None else self.resin.name
        values = {"format": FORMAT, "unit": UNIT, "resin": resin, "printer": PRINTER}
        return {
            LAYOUT.inputs: toml_text(values, LAYOUT.header),
            UNIT: to_toml(self.unit),
            **resin_text(self.resin),
            PRINTER: printer_text(self.printer),
        }

    @property
    def limit_parts(self) -> list[LimitPart]:
        """Parts that show the limits in the printer's file."""
        return limit_parts(self.printer, math.sqrt(0.75) * self.unit.dimensions.cell)


def read_job(folder: Path) -> Job:
    """The job that a folder of `specimens` describes; raises InputError."""
    values, _ = read_inputs(folder / LAYOUT.inputs)
    resin = read_resin(folder, str(values.get("resin")))
    return Job(read_unit(folder / UNIT), resin, read_printer(folder / PRINTER))


def make_specimens(job: Job, folder: Path, context: RunContext) -> None:
    """Write every specimen, the gauge's sheet, the manifest and the folder to fill; raises MuError."""
    unit, resin, progress = job.unit, job.resin or resin_of(None), context.progress
    limits = job.limit_parts
    every = [*specimens(unit), *(Specimen(p.name, p.make, p.measure) for p in limits)]
    rows = []
    with progress.stage("specimens", 4.0):
        for done, specimen in enumerate(every, 1):
            rows.append(_written(specimen, folder, resin))
            progress.update(done / len(every))
    write_text(folder / "gauge.csv", gauge_sheet())
    write_text(folder / "limits.csv", limit_sheet(limits))
    _write_template(every, folder / TEMPLATE)
    context.summary |= {"resin": resin.name, "density_g_per_ml": resin.density_g_per_ml, "specimens": rows}
    write_json(folder / "manifest.json", context.summary)
    write_text(folder / "sheet.html", _page(unit, resin, rows))


def _written(specimen: Specimen, folder: Path, resin: Material) -> dict[str, Any]:
    vertices, triangles = specimen.make()
    enclosed = volume(vertices, triangles)
    content = stl_bytes(vertices, triangles)
    path = folder / f"{specimen.name}.stl"
    write_bytes(path, content)
    points, faces = stl_surface(path.read_bytes())
    again = volume(points, faces)
    if bad_edges(faces) or abs(again / enclosed - 1.0) > 1e-4:
        raise OutputError(
            f"{path.name}, read back, encloses {again:.3f} mm3 and not {enclosed:.3f}, or is open",
            str(path),
            "report it; do not print this file",
        )
    return {
        "name": specimen.name,
        "file": path.name,
        "copies": specimen.copies,
        "volume_mm3": enclosed,
        "mass_g": enclosed / 1e3 * resin.density_g_per_ml,
        "size_mm": np.ptp(vertices, axis=0),
        "measure": specimen.measure,
        "kind": specimen.kind,
        "sha256": hashlib.sha256(content).hexdigest(),
    }


def _write_template(every: list[Specimen], folder: Path) -> None:
    """Write experiments.toml and CSV files of headers alone, so that only rows are missing."""
    lines = ["# Fill in measured values, delete the others; see docs/guide/measure.md for every key."]
    for specimen in (s for s in every if s.kind):
        for letter in "ABC"[: specimen.copies]:
            name = f"{specimen.name}-{letter}"
            role = "held_out" if letter == "C" else "fit"
            lines += [
                "",
                "[[experiment]]",
                f"name = {toml_value(name)}",
                f"kind = {toml_value(specimen.kind)}",
                f"file = {toml_value(f'{name}.csv')}",
                f"role = {toml_value(role)}",
                f"scale = {specimen.scale:g}",
                f"specimen = {toml_value(letter)}",
            ]
            for key, value in specimen.keys.items():
                if value is None:
                    lines.append(f"# {key} =   # as weighed")
                else:
                    lines.append(f"{key} = {toml_value(value)}")
            write_text(folder / f"{name}.csv", ",".join(specimen.columns) + "\n")
    lines += [
        "",
        "# The unit itself, with a camera for its angle (kind unit_pressure), and its valve shut",
        "# (kind pressure_hold), columns " + ", ".join(KINDS["unit_pressure"].columns) + ".",
    ]
    write_text(folder / "experiments.toml", "\n".join(lines) + "\n")


def _page(unit: Unit, resin: Material, rows: list[dict[str, Any]]) -> str:
    parts = [
        (
            [
                r["file"],
                str(r["copies"]),
                " x ".join(f"{s:.4g}" for s in r["size_mm"]),
                f"{r['mass_g']:.2f}",
                r["kind"] or "-",
                r["measure"],
            ],
            False,
        )
        for r in rows
    ]
    sizes = [([f.name, f.where, f.kind, f.axis, f"{f.nominal_mm:g}", ""], False) for f in coupons.FEATURES]
    head = [
        ("file", ""),
        ("copies", "n"),
        ("size [mm]", "n"),
        ("mass [g]", "n"),
        ("experiment", ""),
        ("measure", ""),
    ]
    gauge = [
        ("size", ""),
        ("where", ""),
        ("kind", ""),
        ("along", ""),
        ("nominal [mm]", "n"),
        ("measured [mm]", "n"),
    ]
    lead = (
        "<p>Print all specimens with z upward, wash and cure them like the unit, and wait a day. The mass "
        f"is that of {escape(resin.name)} at nominal size: a heavier part has thicker struts.</p>"
    )
    back = (
        "<p>Write the sizes into gauge.csv, in millimetres; leave cells empty where a size cannot be "
        "measured. Then <code>run.py export --compensate gauge.csv</code> compensates the print offset. "
        "Solids come out larger by twice the offset, gaps smaller; the long sizes separate shrinkage from "
        "the offset.</p>"
    )
    limits = (
        "<p>Parts named limit-... have a row of features from too fine to safe, the first next to the "
        "notched corner. Write into limits.csv the finest feature that was printed, if all safer ones were, "
        "too. Then <code>run.py check --limits limits.csv</code> uses these limits in place of published or "
        "assumed ones.</p>"
    )
    return page(
        "Specimens",
        f"of {unit.name}, scale {unit.scale:g}",
        "",
        lead,
        [
            ("parts", "Parts", table("", head, parts)),
            ("gauge", "Gauge: caliper measurements", back + table("", gauge, sizes)),
            ("limits", "Limits of the printer", limits),
        ],
    )


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on the specimens' `summary`."""
    return [f"{row['file']}: {row['mass_g']:.2f} g, {row['measure']}" for row in summary["specimens"]] + [
        "sheet.html lists the measurements; measured/ holds the templates that `diagnose` reads"
    ]


def plan_of(job: Job) -> Plan:
    """Stages of the specimens with the expected seconds of each on two cores."""
    return [("specimens", 4.0)]


USE_CASE = UseCase("specimens", LAYOUT, read_job, make_specimens, console_summary, plan=plan_of)
