"""Inputs of a print check: the part, its printer, the build direction."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import attrs
import numpy as np

from ...design.anchors import Window, window
from ...design.body import MOST_MM
from ...design.parameters import Unit, read_unit, to_toml
from ...design.printing.printer import Printer, printer_text, read_printer
from ...design.settings import QUALITY, UP
from ...design.surface import Triangles, Vertices
from ...design.surface_reading import read_surface
from ...errors import InputError
from ...reading import file_bytes
from ...run.folder import FolderLayout
from ...run.inputs import FORMAT, digest, named_path, read_inputs, require_digest, structured
from ...toml_writer import toml_text

MOST_TRIANGLES = 1_000_000
"""Largest number of triangles of an STL file (nine units in one piece: 620 000); each takes 4 kB."""
# No STL is longer, in bytes: as text what so many triangles take.
_LONGEST = 1 << 28
# Of layers to draw: how many at most, and no part is so tall, in mm.
MOST_LAYERS, _FARTHEST = 60, 1e5

UNIT, PRINTER = "unit.toml", "printer.toml"
LAYOUT = FolderLayout(
    "check.toml",
    "# The inputs of this print check; the files beside it belong to it.",
    results=("part.stl", "check.json", "report.html", "places.png"),
    optional=(UNIT,),
)


@attrs.frozen(eq=False)
class Job:
    """Inputs of a check: a unit, or the bytes of an STL file, or a file checked against its unit.

    direction points away from the platform, in the part's frame. layers: heights in mm, above the part's
    lowest point, of the layers to draw, by default evenly spaced. repair: first repair the file's surface
    where the repair is unambiguous.
    """

    printer: Printer
    unit: Unit | None = None
    window: Window | None = None
    quality: str = QUALITY.field()
    stl: bytes | None = None
    stl_file: Path | None = None
    direction: tuple[float, float, float] = UP
    layers: tuple[float, ...] = attrs.field(default=(), converter=tuple)
    repair: bool = False

    def __attrs_post_init__(self) -> None:
        if self.repair and self.stl is None:
            raise InputError(
                "there is no file to repair", "--repair", "give --stl; the solid of a unit needs no repair"
            )
        if len(self.layers) > MOST_LAYERS or not all(0.0 <= z < _FARTHEST for z in self.layers):
            raise InputError(
                f"layers at {', '.join(f'{z:g}' for z in self.layers[:5])} mm",
                "layers",
                f"give up to {MOST_LAYERS} heights above the part's lowest point, in mm, from 0 on",
            )
        # An invalid part must be refused before a folder is opened.
        _ = self.stl_surface

    @cached_property
    def stl_surface(self) -> tuple[Vertices, Triangles] | None:
        """The surface (n, 3), (m, 3) of the STL file, if there is one. Raises InputError."""
        return None if self.stl is None else part_in(self.stl, self.stl_name)

    @property
    def stl_name(self) -> str:
        """Name of the STL file, or ""."""
        return "" if self.stl_file is None else self.stl_file.name

    @property
    def name(self) -> str:
        """Name of the part that is checked."""
        unit = "" if self.unit is None else self.unit.name
        path = "" if self.window is None else f", {self.window.name}"
        if self.stl is None:
            return unit + path
        return self.stl_name + (f" against {unit}{path}" if unit else "")

    def texts(self) -> dict[str, str]:
        """Text of every file of inputs, by name; check.toml is the first."""
        values = {
            "format": FORMAT,
            "printer": PRINTER,
            "unit": None if self.unit is None else UNIT,
            "quality": None if self.unit is None else self.quality,
            "path": None if self.window is None else self.window.name,
            "stl_sha256": None if self.stl is None else digest(self.stl),
            "direction": self.direction,
            "layers": list(self.layers) or None,
            "repair": self.repair or None,
            "run": {"stl": str(self.stl_file.resolve())} if self.stl_file is not None else None,
        }
        texts = {LAYOUT.inputs: toml_text(values, LAYOUT.header), PRINTER: printer_text(self.printer)}
        return texts if self.unit is None else texts | {UNIT: to_toml(self.unit)}


def read_stl(path: Path) -> bytes:
    """The bytes of an STL file to check; raises InputError."""
    try:
        return file_bytes(path, _LONGEST)
    except OSError as error:
        raise InputError(
            f"cannot read the file: {error.strerror or error}", str(path), "check its name"
        ) from error


def part_in(content: bytes, name: str) -> tuple[Vertices, Triangles]:
    """Surface of a part's STL, OBJ or PLY file, equal corners merged; raises InputError."""
    again = "export the part again"
    vertices, triangles = read_surface(content, name, MOST_TRIANGLES)
    if not len(triangles):
        raise InputError("the file holds no triangles", name, again)
    if len(triangles) > MOST_TRIANGLES:
        raise InputError(
            f"the file holds {len(triangles)} triangles", name, f"simplify it to {MOST_TRIANGLES} at most"
        )
    if not np.isfinite(vertices).all():
        raise InputError("the file holds numbers that are not finite", name, again)
    if (farthest := float(np.abs(vertices).max())) > MOST_MM:
        raise InputError(f"a coordinate of {farthest:.3g} mm lies beyond {MOST_MM:g} mm", name, again)
    return vertices, triangles


def read_job(folder: Path) -> Job:
    """The job that a folder of `check` describes, its STL file at its original path; raises InputError."""
    path = folder / LAYOUT.inputs
    values, run = read_inputs(path)
    stl = named_path(path, run, "stl", "STL file") if "stl_sha256" in values else None
    content = None if stl is None else read_stl(stl)
    if stl is not None and content is not None:
        require_digest(stl, content, values["stl_sha256"], "STL file")
    unit = read_unit(folder / UNIT) if "unit" in values else None
    taken = {key: values[key] for key in ("quality", "direction", "layers", "repair") if key in values}
    return structured(
        Job,
        taken,
        str(path),
        printer=read_printer(folder / PRINTER),
        unit=unit,
        window=window(unit, str(values["path"])) if unit is not None and "path" in values else None,
        stl_file=stl,
        stl=content,
    )
