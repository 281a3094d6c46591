"""Inputs that several studies have and that are no plain values: a unit, a resin, a printer, a path."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import attrs

from .. import design, evidence, materials, measured
from ..design.quantity import Description, described, in_kPa, in_MPa
from ..design.settings import USUAL_RESIN
from ..errors import InputError
from ..reading import text_in
from ..run.inputs import named_path
from ..run.study import Found, Input, Written, given

UNIT, MODEL = "unit.toml", "model.toml"
# Characters of a path's points: some ten thousand of them.
_LONGEST_PATH = 1 << 18


def asked(
    of: type[Input],
    name: str,
    text: str,
    default: str = "",
    *,
    empty: Any = None,
    group: str = "",
    **more: Any,
) -> Any:
    """attrs field of an input that is made of one text; empty: its value without it; more: of the input."""
    return given(of(descriptions=(described(name, default, text, group=group),), **more), default=empty)


def once(described: Description, **more: Any) -> Any:
    """attrs field of a setting that no run keeps; more: of its input."""
    made = OnceInput(descriptions=(described,), **more)
    return given(made, default=described.default, converter=described.checked)


@attrs.frozen
class FileInput(Input):
    """A value in a file of its own beside the inputs; None is none.

    file: its name, "{name}" in it for that of the input; text: of a value; load: the value of a file, raises
    InputError; needed: there is always one; usual: stands for None in the inputs. One in several files
    overrides `texts` and `file_names`.
    """

    kind: str = "file"
    file: str = "{name}.toml"
    text: Callable[[Any], str] = str
    load: Callable[[Path], Any] = Path
    needed: bool = True
    usual: str | None = None

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Any:
        """The value of the file that is named; raises InputError."""
        return self.load(Path(values[0])) if values[0] else None

    def write(self, name: str, value: Any) -> Written:
        """The file's name, and the texts."""
        if value is None:
            return Written({name: self.usual} if self.usual else {})
        return Written({name: self.file_names(name)[0]}, files=self.texts(name, value))

    def texts(self, name: str, value: Any) -> dict[str, str]:
        """Texts of its files, by their names."""
        return {self.file_names(name)[0]: self.text(value)}

    def read(self, name: str, found: Found) -> Any:
        """The value of the folder's file; raises InputError."""
        if found.take(name, str, attrs.NOTHING if self.needed else self.usual) == self.usual:
            return None
        return self.load(found.path.parent / self.file_names(name)[0])

    def file_names(self, name: str) -> tuple[str, ...]:
        """Its file, or its files, the one that the inputs name first."""
        return (self.file.format(name=name),)


@attrs.frozen
class UnitInput(FileInput):
    """A unit; default: the preset where none is given.

    modelled: a command takes an extended model's parameters into it, and none of its other effects.
    """

    kind: str = "unit"
    file: str = UNIT
    text: Callable[[Any], str] = lambda unit: design.to_toml(unit)
    load: Callable[[Path], Any] = lambda path: design.read_unit(path)
    default: str = ""
    modelled: bool = True

    def same(self, value: design.Unit | None, other: design.Unit | None) -> bool:
        """Return True if they differ in name alone."""
        return value == (other and value and attrs.evolve(other, name=value.name))


@attrs.frozen
class WordsInput(Input):
    """Words, in any number."""

    kind: str = "words"
    many: bool = True

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> tuple[str, ...]:
        """The words of a text, or a list of them."""
        (value,) = values
        return tuple(value.split() if isinstance(value, str) else value or ())


@attrs.frozen
class MeasuredInput(Input):
    """A folder of measured data, read at its place.

    data: what of it decides, by the experiments' names.
    """

    kind: str = "measured"
    descriptions: tuple[Any, ...] = (
        described("folder", "", "folder of measured data: experiments.toml and its CSV files"),
    )
    argument: str = "FOLDER"
    data: Callable[[measured.Measured], dict[str, Any]] = lambda found: {
        e.name: e.hash() for e in found.experiments
    }

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> measured.Measured:
        """The folder's content; raises InputError."""
        return measured.read_folder(Path(values[0]))

    def write(self, name: str, value: measured.Measured) -> Written:
        """Its place, and what decides."""
        return Written({"data": self.data(value)}, {"data": str(value.folder.resolve())})

    def read(self, name: str, found: Found) -> measured.Measured:
        """The folder's content; raises InputError where it is gone or another."""
        before = found.keys.pop("data", None)
        data = measured.read_folder(named_path(found.path, found.run, "data", "folder of measured data"))
        from ..measured.folder import require_same_data

        require_same_data(data, before, self.data(data))
        return data


@attrs.frozen
class PlaceInput(Input):
    """A file or folder, read at its place, or several; what of it decides is a `ReadInput`'s.

    what: in errors; needed: there is always one.
    """

    kind: str = "place"
    what: str = "file"
    needed: bool = True

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Any:
        """The path of a text, or those of several; None without."""
        if self.many:
            return tuple(map(Path, values[0]))
        return Path(values[0]) if values[0] else None

    def write(self, name: str, value: Any) -> Written:
        """Its place."""
        if value is None:
            return Written()
        return Written(run={name: [str(p.resolve()) for p in value] if self.many else str(value.resolve())})

    def read(self, name: str, found: Found) -> Any:
        """The place; raises InputError where there is nothing."""
        if not self.needed and name not in found.run:
            return None
        places = found.run.get(name)
        if not self.many:
            return named_path(found.path, found.run, name, self.what)
        listed = places if isinstance(places, list) and places else [None]
        return tuple(named_path(found.path, {name: place}, name, self.what) for place in listed)


@attrs.frozen
class Resin:
    """Resin of the struts: neo-Hookean, Young's modulus in MPa, Poisson's ratio; density in g/ml."""

    name: str
    modulus_MPa: float
    poisson: float
    density_g_per_ml: float


@attrs.frozen
class ResinInput(Input):
    """A resin, by a name of the library or a file, or the unit's own. Its values are kept with the inputs."""

    kind: str = "resin"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> Resin:
        """The resin of a name, of a file, or of the unit: its struts are printed with its membrane."""
        (value,) = values
        if not value:
            own, known = given["unit"].material, materials.load_material(USUAL_RESIN)
            moduli = own.membrane_modulus_MPa, own.membrane_poisson, known.density_g_per_ml
            return Resin("that of the unit's membrane", *moduli)
        path = Path(value)
        known = materials.read_material(path) if path.suffix == ".toml" else materials.load_material(value)
        return Resin(known.name, known.modulus_MPa, known.poisson, known.density_g_per_ml)

    def write(self, name: str, value: Resin) -> Written:
        """Its table, the modulus in kPa."""
        values = attrs.asdict(value)
        modulus = in_kPa(values.pop("modulus_MPa"))
        return Written({name: {"name": values.pop("name"), "modulus_kPa": modulus, **values}})

    def read(self, name: str, found: Found) -> Resin:
        """The resin of its table; raises InputError."""
        table = found.table.inner(name)
        found.keys.pop(name, None)
        modulus = in_MPa(table.take("modulus_kPa", float))
        values = {key: value for key, value in table.values.items() if key != "modulus_kPa"}
        return attrs.evolve(table, values=values).made(Resin, modulus_MPa=modulus)


@attrs.frozen
class MaterialInput(FileInput):
    """A resin with all its figures, by a name of the library or a file; None stands for the usual one.

    So a window that writes inputs loads no library.
    """

    kind: str = "material"
    text: Callable[[Any], str] = lambda resin: materials.material_text(resin)
    load: Callable[[Path], Any] = lambda path: materials.read_material(path)
    needed: bool = False
    usual: str | None = USUAL_RESIN

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> materials.Material | None:
        """The resin of a name or of a file; raises InputError."""
        (name,) = values
        if not name:
            return None
        return self.load(Path(name)) if name.endswith(".toml") else materials.load_material(name)


@attrs.frozen
class WindowInput(Input):
    """The path of the unit's waveguide, by its name."""

    kind: str = "window"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> design.Window | None:
        """The path of a name; raises InputError, also without a unit."""
        (name,) = values
        if not name:
            return None
        if given["unit"] is None:
            raise InputError("--path needs a unit", "--path", "give --preset or --unit as well")
        return design.window(given["unit"], name)

    def write(self, name: str, value: design.Window | None) -> Written:
        """Its name."""
        return Written() if value is None else Written({name: value.name})

    def read(self, name: str, found: Found) -> design.Window | None:
        """The path that the file names."""
        return self.made((found.keys.pop(name, ""),), found.given)


@attrs.frozen
class NodePath:
    """A path along nodes of the lattice, with its points in mm."""

    name: str
    points: tuple[tuple[float, float, float], ...]


@attrs.frozen
class PathInput(Input):
    """The path of the unit's waveguide: a window by its name, or one of a paths.csv, by `path_row`."""

    kind: str = "window"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> design.Window | NodePath | None:
        """The path of a name or of a table; raises InputError."""
        return path_of(given["unit"], values[0] or "", given.get("path_row") or "")

    def write(self, name: str, value: design.Window | NodePath | None) -> Written:
        """Its name, and the points of one along nodes."""
        points = {"points_mm": value.points} if isinstance(value, NodePath) else {}
        return Written({name: value.name if value else "", **points})

    def read(self, name: str, found: Found) -> design.Window | NodePath | None:
        """The path of the file; raises InputError."""
        path = found.take(name, str, "")
        points = found.take("points_mm", tuple[tuple[float, float, float], ...], ())
        return NodePath(path, points) if points else self.made((path,), found.given)


def path_of(unit: design.Unit, name: str, row: str = "") -> design.Window | NodePath | None:
    """A path: a window, alpha1 .., or one of a paths.csv of `place`, its first by default; "" for none."""
    if row and not name.endswith(".csv"):
        raise InputError(
            f"--path-row {row} names a row of a paths.csv, but --path does not give that file",
            "--path-row",
            "give the paths.csv of `place --paths graph` with --path, or leave --path-row out",
        )
    if not name.endswith(".csv"):
        return design.window(unit, name) if name else None
    text = text_in(name, "paths", "give paths.csv of `place --paths graph`")
    rows = csv.DictReader(io.StringIO(text))
    named = next((r for r in rows if not row or r.get("path") == row), None)
    if named is None:
        raise InputError(
            f"there is no path {row!r}" if row else "there is no path", name, "see its first column"
        )
    try:
        return NodePath(named["path"], _points(named.get("points_mm") or ""))
    except (KeyError, ValueError) as error:
        raise InputError(
            "its column points_mm is not a list of points", name, "write it again by `place`"
        ) from error


def _points(text: str) -> tuple[tuple[float, float, float], ...]:
    """Points in mm of a cell of paths.csv; raises ValueError."""
    if len(text) > _LONGEST_PATH:
        raise ValueError("no path of a lattice is that long")
    return tuple((float(x), float(y), float(z)) for x, y, z in (p.split() for p in text.split(";")))


@attrs.frozen
class PrinterInput(FileInput):
    """A printer with its resin, and limits measured on it in place of the printer's; its values are kept."""

    kind: str = "printer"
    text: Callable[[Any], str] = lambda printer: design.printer_text(printer)
    load: Callable[[Path], Any] = lambda path: design.read_printer(path)

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> design.Printer:
        """The printer of a name or a file, with the limits of a filled sheet; raises InputError."""
        from ..design.printing.sheets import measured_limits

        printer, limits = design.load_printer(values[0]), given.get("limits")
        return printer.with_limits(measured_limits(Path(limits))) if limits else printer


@attrs.frozen
class OnceInput(Input):
    """A plain value that other inputs are made of, and that no run keeps."""

    kind: str = "once"

    def write(self, name: str, value: Any) -> Written:
        """Nothing."""
        return Written()

    def read(self, name: str, found: Found) -> Any:
        """The default."""
        return self.descriptions[0].default


@attrs.frozen
class NumbersInput(Input):
    """Several numbers."""

    kind: str = "numbers"

    def made(self, values: tuple[Any, ...], given: Mapping[str, Any]) -> tuple[float, ...]:
        """The numbers of a text, or a list of them; raises InputError."""
        if len(self.descriptions) > 1:
            return tuple(d.checked(float(value)) for d, value in zip(self.descriptions, values, strict=True))
        words = values[0].split() if isinstance(values[0], str) else values[0] or ()
        try:
            return tuple(float(word) for word in words)
        except ValueError:
            where = f"--{self.descriptions[0].name}"
            raise InputError(f"{values[0]!r} are not numbers", where, "give numbers") from None

    def write(self, name: str, value: tuple[float, ...]) -> Written:
        """The numbers, if there are any."""
        return Written({name: value} if value else {})


@attrs.frozen
class ModelInput(FileInput):
    """An extended model of a diagnosis, or None."""

    kind: str = "model"
    file: str = MODEL
    text: Callable[[Any], str] = lambda model: model.text()
    load: Callable[[Path], Any] = lambda path: evidence.load_model(path)
    needed: bool = False
    descriptions: tuple[Any, ...] = (
        described(
            "model",
            "",
            "extended model, the model.toml of `diagnose`: its identified effects are applied to the unit; "
            "empty: none",
        ),
    )
    metavar: str = "FILE"


_SCHEDULER = described(
    "scheduler",
    "",
    "address of a Dask scheduler whose workers do the simulations, such as tcp://host:8786; empty: none",
)


@attrs.frozen
class SchedulerInput(OnceInput):
    """Address of a Dask scheduler. Its workers get code from it, so a folder does not name one."""

    descriptions: tuple[Any, ...] = (_SCHEDULER,)
    decides: bool = False
    metavar: str = "ADDRESS"
