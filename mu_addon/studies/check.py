"""`check`: the printability check of a unit or of a file, with the best build direction."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import attrs

from .. import design, report
from ..design.quantity import described
from ..design.settings import PRINTER, QUALITY, UP
from ..errors import InputError
from ..files import json_text
from ..run.inputs import digest, named_path, require_digest
from ..run.parts import (
    Beside,
    Chart,
    Fact,
    Fault,
    File,
    Part,
    Pictures,
    Sentence,
    Table,
    Warn,
    echo,
    recorded,
)
from ..run.study import Found, Input, Node, Study, Tell, Written, given, intermediate, section, setting, stage
from .inputs import NumbersInput, OnceInput, PrinterInput, UnitInput, WindowInput, asked

MOST_TRIANGLES = 1_000_000
"""Largest number of triangles of a file (nine units in one piece: 620 000); each takes 4 kB."""
# No STL is longer, in bytes: as text what so many triangles take.
_LONGEST = 1 << 28
# Of layers to draw: how many at most, how many by default; no part is so tall, in mm.
MOST_LAYERS, LAYERS, _FARTHEST = 60, 12, 1e5
MOST_ROWS = 12
STEPS = {
    "faces": 0.1,
    "thickness and gaps": 0.25,
    "chambers and drains": 0.5,
    "layers": 0.7,
    "build directions": 0.8,
}
"""Share of a check that is done where each of its steps begins."""
PART = "part.stl"


@attrs.frozen(eq=False)
class PartFile:
    """The file of a part, and its bytes."""

    path: Path
    content: bytes

    def hash(self) -> str:
        """Hash of its bytes: its place decides nothing."""
        return digest(self.content)

    @property
    def surface(self) -> tuple[Any, Any]:
        """Its vertices (n, 3) in mm and triangles (m, 3), equal corners merged; raises InputError."""
        return part_in(self.content, self.path.name)


def read_part(path: Path) -> PartFile:
    """The STL, OBJ or PLY file of a part; raises InputError."""
    from ..reading import file_bytes

    try:
        return PartFile(path, file_bytes(path, _LONGEST))
    except OSError as error:
        what = f"cannot read the file: {error.strerror or error}"
        raise InputError(what, str(path), "check its name") from error


def part_in(content: bytes, name: str) -> tuple[Any, Any]:
    """Surface of a part's STL, OBJ or PLY file, equal corners merged; raises InputError."""
    import numpy as np

    from ..design.body import MOST_MM
    from ..design.surface_reading import read_surface

    again = "export the part again"
    vertices, triangles = read_surface(content, name, MOST_TRIANGLES)
    if not len(triangles):
        raise InputError("the file holds no triangles", name, again)
    if len(triangles) > MOST_TRIANGLES:
        remedy = f"simplify it to {MOST_TRIANGLES} at most"
        raise InputError(f"the file holds {len(triangles)} triangles", name, remedy)
    if not np.isfinite(vertices).all():
        raise InputError("the file holds numbers that are not finite", name, again)
    if (farthest := float(np.abs(vertices).max())) > MOST_MM:
        raise InputError(f"a coordinate of {farthest:.3g} mm lies beyond {MOST_MM:g} mm", name, again)
    return vertices, triangles


@attrs.frozen
class PartInput(Input):
    """A part's file, read at its place; only its content decides."""

    kind: str = "part"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> PartFile | None:
        """The file of a path; None without one."""
        return read_part(Path(values[0])) if values[0] else None

    def write(self, name: str, value: PartFile | None) -> Written:
        """Its digest, and its place."""
        if value is None:
            return Written()
        return Written({f"{name}_sha256": digest(value.content)}, {name: str(value.path.resolve())})

    def read(self, name: str, found: Found) -> PartFile | None:
        """The file; raises InputError where it is gone or another."""
        before = found.keys.pop(f"{name}_sha256", None)
        if before is None:
            return None
        part = read_part(named_path(found.path, found.run, name, "STL file"))
        require_digest(part.path, part.content, before, "STL file")
        return part


@attrs.frozen(eq=False)
class Surface:
    """The surface to check, vertices (n, 3) in mm and triangles (m, 3), and how it was repaired."""

    vertices: Any
    triangles: Any
    mended: design.Repair | None = None


@attrs.frozen(kw_only=True, eq=False)
class Check(Study):
    """Check the printability of a unit or an STL file and find the best build direction. Exit status 6 means
    not printable.
    """

    name = "check"
    example = "check --preset mu-1.0x --path alpha4 --out out/check"
    files = {
        "printer.toml": "limits of the printer; a template for `check --printer`",
        PART: "the part that was checked",
        "check.json": "every finding with its locations, and every build direction",
        "places.png": "the findings",
    }
    node = Node(
        "Print",
        "printability of the unit, and its best build direction",
        (("check", "print check", "findings"),),
        lambda summary: f"verdict: {summary['verdict']}",
        label="Check Print",
        answers=True,
        hidden=("stl", "repair", "limits", "layers"),
        no_body="the print check",
    )

    unit: design.Unit | None = given(UnitInput(needed=False), default=None)
    stl: PartFile | None = asked(
        PartInput,
        "stl",
        "STL file to check; if a unit is given too, the file is compared with the unit's nominal "
        "geometry; empty: none",
        metavar="FILE",
    )
    repair: bool = setting(
        described(
            "repair",
            False,
            "repair the STL file before the check and write part.stl: flipped and doubled faces, tiny gaps; "
            "a fault with more than one remedy is refused",
        )
    )
    path: design.Window | None = asked(
        WindowInput,
        "path",
        "path of the unit's waveguide: alpha1, alpha2, ...; empty: none",
        metavar="NAME",
    )
    limits: str = asked(
        OnceInput,
        "limits",
        "filled-in limits.csv of `specimens`: measured limits, which replace those of the "
        "printer; empty: none",
        empty="",
        metavar="FILE",
    )
    printer: design.Printer = given(PrinterInput(descriptions=(PRINTER,), metavar="NAME|FILE"))
    direction: tuple[float, ...] = given(
        NumbersInput(
            descriptions=tuple(
                described(
                    f"up_{axis}",
                    part,
                    "build direction in the unit's frame, away from the platform; 0 0 1: inlet down",
                    low=-1e3,
                    high=1e3,
                )
                for axis, part in zip("xyz", UP, strict=True)
            ),
            option="up",
            metavar=("X", "Y", "Z"),
        ),
        default=UP,
    )
    layers: tuple[float, ...] = asked(
        NumbersInput,
        "layers",
        "heights of the layers to draw, in mm above the part's lowest point; empty: 12, evenly spaced",
        empty=(),
        metavar="MM",
        many=True,
    )
    quality: str = setting(QUALITY)

    def __attrs_post_init__(self) -> None:
        if self.unit is None and self.stl is None:
            raise InputError("no part to check was given", "--preset, --unit or --stl", "give one of them")
        if self.repair and self.stl is None:
            remedy = "give --stl; the solid of a unit needs no repair"
            raise InputError("there is no file to repair", "--repair", remedy)
        if len(self.direction) != 3 or not 1e-6 < sum(x * x for x in self.direction) < 1e12:
            raise InputError(
                f"{self.direction} is not a direction", "--up", "give three numbers, such as 0 0 1"
            )
        if len(self.layers) > MOST_LAYERS or not all(0.0 <= z < _FARTHEST for z in self.layers):
            raise InputError(
                f"layers at {', '.join(f'{z:g}' for z in self.layers[:5])} mm",
                "layers",
                f"give up to {MOST_LAYERS} heights above the part's lowest point, in mm, from 0 on",
            )
        if self.stl is not None:
            # An invalid part must be refused before a folder is opened.
            _ = self.stl.surface

    @stage("part", 2.5, kept=False)
    def part(
        self, unit: design.Unit | None, stl: PartFile | None, path: design.Window | None, quality: str,
        repair: bool, tell: Tell,
    ) -> Surface:  # fmt: skip
        """The surface to check: of the file, repaired if that is asked for, or the unit's own solid."""
        if stl is None:
            assert unit is not None
            solid = design.build_solid(unit, path, quality)
            found = Surface(solid.vertices, solid.triangles)
        elif repair:
            mended = design.repaired(*stl.surface)
            _require_whole(mended, stl.path.name)
            found = Surface(mended.vertices, mended.triangles, mended)
        else:
            found = Surface(*stl.surface)
        tell.made(f"{len(found.triangles)} triangles")
        return found

    @intermediate()
    def nominal(
        self, unit: design.Unit | None, stl: PartFile | None, path: design.Window | None, quality: str
    ) -> Surface | None:
        """The unit's solid that a file is compared with."""
        if stl is None or unit is None:
            return None
        solid = design.build_solid(unit, path, quality)
        return Surface(solid.vertices, solid.triangles)

    @stage("check", 6.5, kept=False)
    def found(
        self, part: Surface, nominal: Surface | None, printer: design.Printer, unit: design.Unit | None,
        path: design.Window | None, direction: tuple[float, float, float], tell: Tell,
    ) -> design.PrintCheck:  # fmt: skip
        """Findings and build directions."""

        @contextmanager
        def step(name: str) -> Iterator[None]:
            tell(STEPS.get(name, 0.0), name)
            yield

        compared = None if nominal is None else (nominal.vertices, nominal.triangles)
        least = STEPS["build directions"]
        return design.check(
            part.vertices, part.triangles, printer, unit, path, direction, stage=step, nominal=compared,
            share=lambda share: tell(least + (1.0 - least) * share),
        )  # fmt: skip

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it the printer."""
        return f"Print check: {self.part_name}", self.printer.title

    @property
    def part_name(self) -> str:
        """Name of the part that is checked."""
        unit = "" if self.unit is None else self.unit.name
        path = "" if self.path is None else f", {self.path.name}"
        if self.stl is None:
            return unit + path
        return self.stl.path.name + (f" against {unit}{path}" if unit else "")

    @section()
    def answer(
        self, part: Surface, printer: design.Printer, direction: Sequence[float], found: design.PrintCheck
    ) -> Iterator[Part]:
        """The verdict."""
        name = "" if self.stl is None else self.stl.path.name
        if part.mended is not None:
            yield Warn(
                f"repaired: {'; '.join(part.mended.lines())}", name, "look at part.stl", repeated=False
            )
        faults = [f for f in found.findings if f.is_fault]
        errors = [f for f in faults if f.severity == "error"]
        for f in faults:
            first = "not printable: " if f.severity == "error" else ""
            yield Warn(f"{first}{f.check}: {f.what}", _where(f.places), f.remedy, repeated=False)
        assumed, measured = _standings(printer)["assumed"], _standings(printer)["measured"]
        if assumed:
            yield Sentence(
                f"{len(assumed)} of {len(design.MEANING)} limits are assumed, because no published values "
                "were found for this resin. Print the parts limit-... of `specimens`, and give the measured "
                "limits by --limits.",
                note=True,
            )
        if measured:
            yield Sentence(f"Measured: {', '.join(design.MEANING[m] for m in measured)}.", note=True)
        strong = {"error": "Not printable", "warning": "Printable with warnings", "pass": "Printable"}[
            found.worst
        ]
        listed = "; ".join(f"{f.check}, {f.what}" for f in (errors or faults))
        up = design.direction_name(direction)
        figures = found.figures
        optional = {
            "mass_g": ("mass", ".3g", "g"),
            "chamber_ml": ("resin to drain from chambers", ".3g", "ml"),
            "trapped_ml": ("resin trapped in sealed voids", ".3f", "ml"),
        }
        lead = [
            Sentence(f"{strong}: {listed or 'every check passed'}.", answer=True, strong=strong),
            Sentence(
                f"Built along {up}, away from the platform, on supports. Spheres mark findings: red must be "
                "corrected, orange needs a decision."
            ),
            Fact("size", "", " x ".join(f"{figures[f'{a}_mm']:.4g}" for a in "xyz") + " mm"),
            Fact("resin in the part", figures["volume_ml"], f"{figures['volume_ml']:.3g} ml"),
            *(
                Fact(text, figures[k], f"{figures[k]:{form}} {u}")
                for k, (text, form, u) in optional.items()
                if k in figures
            ),
        ]

        shown = part.vertices, part.triangles, found, direction
        yield Beside([lead, Pictures(lambda: [("places.png", report.places_picture(*shown))])])
        yield File(PART, lambda path: design.stl_bytes(part.vertices, part.triangles))
        yield File("check.json", lambda path: json_text(self._plain(part, found, printer, direction)))
        yield from self._summary(found, printer)
        if errors:
            more = f" (and {len(errors) - 1} more errors, see report.html)" if len(errors) > 1 else ""
            first = f"not printable: {errors[0].check}: {errors[0].what}{more}"
            yield Fault(design.GateError(first, _where(errors[0].places), errors[0].remedy))

    def _plain(
        self, part: Surface, found: design.PrintCheck, printer: design.Printer, direction: Sequence[float]
    ) -> dict[str, Any]:
        """Content of check.json."""
        return {
            "format": 1,
            "part": self.part_name,
            "printer": printer.title,
            "direction": direction,
            "verdict": found.worst,
            "findings": [finding.plain() for finding in found.findings],
            "figures": found.figures,
            "limits": _standings(printer),
            "orientation": [attrs.asdict(build) for build in found.builds],
            **({} if part.mended is None else {"repair": part.mended.plain()}),
        }

    def _summary(self, found: design.PrintCheck, printer: design.Printer) -> Iterator[Part]:
        """Key figures, and the lines of the terminal."""
        count = {s: sum(f.severity == s for f in found.findings) for s in ("error", "warning", "pass")}
        notes = [f"{f.check}: {f.what}" for f in found.findings if not f.is_fault and f.remedy]
        limits = _standings(printer)
        yield recorded("verdict", found.worst)
        yield recorded("count", count)
        yield recorded("figures", found.figures)
        yield recorded("faults", [f"{f.check}: {f.what}" for f in found.findings if f.is_fault])
        yield recorded("notes", notes)
        yield recorded("limits", limits)
        lines = [
            f"{count['pass']} checks passed, {count['warning']} warnings, {count['error']} errors",
            *notes,
        ]
        if limits["measured"]:
            lines.append(f"measured limits: {', '.join(limits['measured'])}")
        lines.append(f"assumed limits: {len(limits['assumed'])} of {len(design.MEANING)}, see report.html")
        if found.builds:
            best = found.builds[0]
            yield recorded("orientation", attrs.asdict(best))
            # Rounded first: no minus before a zero.
            towards = ", ".join(f"{round(x, 2) + 0.0:.2f}" for x in best.direction)
            lines.append(
                f"best build direction ({towards}): {best.islands} islands, {best.support_mm2:.0f} mm2 to "
                f"support, of it {best.inner_mm2:.0f} mm2 in chambers, cups of {best.cup_ml:.2g} ml"
            )
        yield from echo(*lines)

    @section("repair", "Repair")
    def repaired(self, part: Surface) -> Iterator[Part]:
        """Changes by the repair, and their size."""
        mended = part.mended
        if mended is None:
            return
        yield Sentence("The file was repaired where there is only one way to; part.stl is the repaired part.")
        rows = [(change.what, str(change.count)) for change in mended.changes]
        rows += [
            ("largest move of a vertex, mm", f"{mended.largest_move_mm:.2g}"),
            ("volume of the file's surface, mm³", f"{mended.volume_before_mm3:.6g}"),
            ("volume once repaired, mm³", f"{mended.volume_after_mm3:.6g}"),
        ]
        yield Table("", [("change", "text"), ("", "n")], rows)

    @section("findings", "What was checked")
    def findings(self, found: design.PrintCheck) -> Iterator[Part]:
        """Every finding, the worst first."""
        words = {"error": "FAILED", "warning": "warning", "pass": "passed", "info": "note"}
        order = ("error", "warning", "info", "pass")
        head = ["check", "outcome", ("found", "text"), ("limit", "n"), ("where, mm", "line")]
        rows = []
        for f in sorted(found.findings, key=lambda f: order.index(f.severity)):
            limit = "" if f.limit is None else f"{f.limit:g} {f.unit}".strip() + (" *" if f.assumed else "")
            remedy = f". {f.remedy[:1].upper()}{f.remedy[1:]}." if f.remedy else ""
            first = f"({', '.join(f'{x:.2f}' for x in f.places[0])})" if len(f.places) else ""
            first += f" + {f.count - 1}" if first and f.count > 1 else ""
            rows.append((f.check, words[f.severity], f.what + remedy, limit, first))
        yield Table("* assumed, see the printer's limits", head, rows)
        places = []
        for f in found.findings:
            if f.is_fault and len(f.places) > 1:
                text = "; ".join(f"({x:.1f}, {y:.1f}, {z:.1f})" for x, y, z in f.places[:MOST_ROWS])
                places.append((f.check, text + (" ..." if f.count > MOST_ROWS else "")))
        if places:
            yield Table("Locations in mm, worst first", ["check", ("places", "text")], places)

    @section("layers", "Layers")
    def drawn(self, part: Surface, direction: Sequence[float]) -> Iterator[Part]:
        """The layers that are asked for, or some evenly spaced."""
        if not design.has_volume(part.vertices, part.triangles):
            yield Sentence("The surface encloses no volume: it has no layers.")
            return

        def chart() -> str:
            heights = self.layers or design.even_heights(part.vertices, direction, LAYERS)
            # A file's chamber may lie elsewhere than its unit's.
            within = design.chamber(self.unit) if self.stl is None and self.unit is not None else None
            return report.layer_pictures(
                design.slices(part.vertices, part.triangles, direction, heights, within)
            )

        yield Chart(
            chart,
            "Layers by their height above the part's lowest point: material in grey; areas that a layer "
            "encloses, such as a chamber, in blue with its size. A unit's chamber is also blue at its inlet.",
            "Sections of the part at several heights",
        )

    @section("orientation", "Build direction")
    def builds(self, found: design.PrintCheck) -> Iterator[Part]:
        """Build directions, the best first."""
        builds = found.builds
        if not builds:
            return
        yield Sentence(
            f"{len(builds)} directions, pointing away from the platform: faces, edges and corners of a cube, "
            "and eight tilted by 20 degrees from the best of these. Order of criteria: the part fits, no cup "
            "of 0.5 ml or more, least flat surface in chambers (supports there cannot be removed), fewest "
            "islands, least supported surface, least height. A direction is Pareto-optimal if no other is at "
            "least as good in all of these criteria and better in one."
        )

        yield Chart(
            lambda: report.trade_off(builds),
            "Supported surface against the largest cup: one point per build direction, recommended direction "
            "in orange.",
            "Supported surface against the largest cup, one point per build direction",
        )
        rows = [
            (
                design.direction_name(b.direction) + ("" if b.fits else " (does not fit)"),
                f"{b.cup_ml:.2g}",
                f"{b.inner_mm2:.0f}",
                b.islands,
                f"{b.support_mm2:.0f}",
                f"{b.height_mm:.0f}",
                "yes" if b.best_among else "",
            )
            for b in [*builds[:MOST_ROWS], *(b for b in builds[MOST_ROWS:] if b.best_among)]
        ]
        head = [
            "build direction",
            *Table.numbers("cup ml", "in chambers mm²", "islands", "to support mm²", "height mm"),
            "Pareto-optimal",
        ]
        yield Table("", head, rows, (0,))

    @section("limits", "The printer's limits")
    def listed(self, printer: design.Printer) -> Iterator[Part]:
        """The limits and what they rest on."""
        head = [("limit", "text"), ("value", "n"), "rests on", ("source", "text")]
        rows = [
            (design.MEANING[name], f"{limit.value:g}", limit.standing, limit.source)
            for name, limit in printer.limits.items()
        ]
        yield Table("mm, degrees, ml and g/ml", head, rows)


def _require_whole(mended: design.Repair, name: str) -> None:
    """Raise GateError, with the changes and the remaining faults, unless a repair left none."""
    if not mended.is_whole:
        done = "; ".join(f"{change.count} {change.what}" for change in mended.changes) or "nothing"
        raise design.GateError(
            f"the repair is not unambiguous: {'; '.join(mended.remains)} (done before that: {done})",
            name,
            "correct the remaining faults in the program that made the part, or check it without --repair to "
            "see the places",
        )


def _standings(printer: design.Printer) -> dict[str, list[str]]:
    """Names of a printer's limits by their grounds: measured, published or assumed."""
    found: dict[str, list[str]] = {"measured": [], "published": [], "assumed": []}
    for name, limit in printer.limits.items():
        found[limit.standing].append(name)
    return found


def _where(places: Any) -> str:
    if not len(places):
        return ""
    x, y, z = places[0]
    more = f" and {len(places) - 1} places more" if len(places) > 1 else ""
    return f"({x:.2f}, {y:.2f}, {z:.2f}) mm{more}"
