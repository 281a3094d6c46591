"""The folder of measured data: experiments.toml and the CSV files it names."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..errors import InputError, did_you_mean
from ..reading import file_bytes, file_text, parse_toml
from ..run.inputs import digest
from ..table_cells.own_tables import own_text
from .experiment import Array, Experiment
from .kinds import ACCURACIES, AXES, KINDS, MODES, PLATES, ROLES, VALVES, Kind
from .table import Remark, read_table

FILE = "experiments.toml"
# Share of the largest strain by which strain and displacement over length may differ without a remark.
ATMOSPHERE_kPa = 101.325
PRESSURES = ("gauge", "absolute")
# A unit under little vacuum, and at most at twice the atmosphere's pressure: soft walls bear no more.
LIKE_ABSOLUTE_kPa = (90.0, 200.0)
DISAGREE = 0.02
# Spread of a weighed mass whose mass_sd_g is not given, as a share of it.
MASS_SPREAD = 0.01
# Stress without strain, as a share of the largest stress, that is remarked.
PRELOAD = 0.05


@attrs.frozen
class Measured:
    """The experiments of a folder in the order they were made, and remarks on data that can be used."""

    folder: Path
    experiments: tuple[Experiment, ...]
    remarks: tuple[Remark, ...]

    def of(self, kind: str, role: str | None = None) -> tuple[Experiment, ...]:
        """The experiments of a kind and, where it is given, of a role ("fit" or "held_out")."""
        return tuple(e for e in self.experiments if e.kind == kind and role in (None, e.role))


def read_folder(folder: Path) -> Measured:
    """Read and check a folder of measured data: experiments.toml and the CSV files that it names.

    Strain and stress are computed from displacement and force where needed. Raises InputError with file, row
    or key, and remedy.
    """
    path = Path(folder) / FILE
    text = _text(path, f"a folder of measured data holds {FILE}, which names its CSV files")
    document = parse_toml(text, str(path))
    entries = document.pop("experiment", None)
    if document:
        key = next(iter(document))
        raise InputError(
            f"unknown key {key!r}{did_you_mean(key, ['experiment'])}",
            _place(path, text, 0, key),
            "define every experiment under [[experiment]]",
        )
    if not isinstance(entries, list) or not entries:
        raise InputError("no experiment is defined", str(path), "begin each with a line [[experiment]]")
    experiments: list[Experiment] = []
    remarks: list[Remark] = []
    for number, entry in enumerate(entries, 1):
        at = _Place(path, text, number)
        if not isinstance(entry, dict):
            raise InputError("an experiment is not a table", at(), "begin each with a line [[experiment]]")
        found, notes = _experiment(entry, at)
        _check_apart(found, experiments, at)
        experiments.append(found)
        remarks += notes
    _require_gauge_pressures(experiments, entries)
    return Measured(Path(folder), _as_run(experiments, path), tuple(remarks))


def _as_run(experiments: Sequence[Experiment], path: Path) -> tuple[Experiment, ...]:
    """Experiments in the order they were made: by run_order if given, else by the file's order."""
    without = [e.name for e in experiments if e.run_order is None]
    if len(without) == len(experiments):
        return tuple(experiments)
    if without:
        raise InputError(
            f"run_order is given to some experiments, and not to {without[0]!r}",
            str(path),
            "give it to all of them, or to none if they are listed in the order they were made",
        )
    return tuple(sorted(experiments, key=lambda e: e.run_order or 0.0))


@attrs.frozen
class _Place:
    """Location of the keys of the n-th experiment."""

    path: Path
    text: str
    number: int

    def __call__(self, key: str = "") -> str:
        return _place(self.path, self.text, self.number, key)


def _experiment(entry: dict[str, Any], at: _Place) -> tuple[Experiment, list[Remark]]:
    kind = KINDS[_choice(entry, "kind", tuple(KINDS), at)]
    for key in entry:
        if key not in kind.keys:
            elsewhere = [k.name for k in KINDS.values() if key in k.keys]
            hint = f"; it belongs to {', '.join(elsewhere)}" if elsewhere else did_you_mean(key, kind.keys)
            raise InputError(f"unknown key {key!r}{hint}", at(key), f"known here: {', '.join(kind.keys)}")
    for key in ("name", "file", *kind.needs_keys):
        if key not in entry:
            raise InputError(f"key {key!r} is missing", at(), f"{kind.name} needs it")
    fields = _described(entry, kind, at)
    path = _file(_word(entry, "file", at), at)
    text = _text(path, f"{FILE} names it; correct the name or put the file there", own_text)
    table = read_table(text, kind, path)
    columns, remarks = dict(table.columns), list(table.remarks)
    if "pressure_kPa" in columns:
        columns["pressure_kPa"] = _gauge_pressure(columns["pressure_kPa"], entry, at)
    if kind.name in ("coupon", "lattice_compression"):
        columns = _strained(columns, fields, kind, path, remarks)
        _check_strain(columns["strain"], table.rows, kind, path, remarks)
        _check_preload(columns, table.rows, path, remarks)
    for column in columns:
        if "_sd_" in column:
            _check_spread(columns[column], column, table.rows, path)
    if kind.name == "lattice_compression" and fields.get("mass_g") is not None:
        spread = fields.get("mass_sd_g") or MASS_SPREAD * fields["mass_g"]
        columns["mass_g"] = np.full(len(table.rows), fields["mass_g"])
        columns["mass_sd_g"] = np.full(len(table.rows), spread)
    if kind.name == "beam_deadweight" and (columns["added_mass_g"] < 0).any():
        row = int(table.rows[np.argmax(columns["added_mass_g"] < 0)])
        raise InputError("added_mass_g is negative", f"{path}, row {row}", "give the mass that was added")
    digest = hashlib.sha256(file_bytes(path)).hexdigest()
    experiment = Experiment(
        kind=kind.name, file=path, columns=columns, rows=table.rows, sha256=digest, **fields
    )
    return experiment, remarks


def _gauge_pressure(pressure_kPa: Array, entry: dict[str, Any], at: _Place) -> Array:
    """Gauge pressure (n,) in kPa: as read, or less the atmosphere if it is marked as absolute."""
    if "pressure" in entry and _choice(entry, "pressure", PRESSURES, at) == "absolute":
        return pressure_kPa - ATMOSPHERE_kPa
    return pressure_kPa


def _require_gauge_pressures(experiments: Sequence[Experiment], entries: Sequence[dict[str, Any]]) -> None:
    """Raise InputError if all readings look like a unit's absolute pressures and are not marked."""
    read = [e for e in experiments if "pressure_kPa" in e.columns]
    if not read or any("pressure" in entry for entry in entries):
        return
    least = min(float(np.nanmin(e["pressure_kPa"])) for e in read)
    most = max(float(np.nanmax(e["pressure_kPa"])) for e in read)
    low, high = LIKE_ABSOLUTE_kPa
    if low < least and most < high:
        raise InputError(
            f"pressures are from {least:.4g} to {most:.4g} kPa, as if they were absolute; they are read as "
            "gauge pressures",
            f"{read[0].file}, column pressure_kPa",
            f'write pressure = "absolute" or pressure = "gauge" in each such experiment in {FILE}',
        )


def _described(entry: dict[str, Any], kind: Kind, at: _Place) -> dict[str, Any]:
    """Checked values of the keys that are present."""
    fields: dict[str, Any] = {
        "name": _word(entry, "name", at),
        "role": _choice(entry, "role", ROLES, at),
        "specimen": _word(entry, "specimen", at) if "specimen" in entry else "",
        "session": _word(entry, "session", at) if "session" in entry else "",
        "source": _word(entry, "source", at) if "source" in entry else "",
        "scale": _number(entry.get("scale", 1.0), "scale", at, 0.01, 100.0),
        "orientation_deg": _number(entry.get("orientation_deg", 0.0), "orientation_deg", at, -360.0, 360.0),
        "temperature_C": math.nan,
    }
    if "run_order" in entry:
        fields["run_order"] = _number(entry["run_order"], "run_order", at, -1e15, 1e15)
    if "temperature_C" in entry:
        fields["temperature_C"] = _number(entry["temperature_C"], "temperature_C", at, -100.0, 300.0)
    for key, most in (
        ("length_mm", 1e4),
        ("strut_mm", 1e3),
        ("mass_g", 1e6),
        ("mass_sd_g", 1e6),
        ("chamber_volume_mm3", 1e9),
    ):
        if key in entry:
            fields[key] = _number(entry[key], key, at, 0.0, most, above=True)
    if "strut_mm" in entry and "cells" not in entry:
        raise InputError(
            "strut_mm needs cells", at("strut_mm"), "give the count of cells, from which a block is computed"
        )
    fields["accuracy"] = {
        column: _number(entry[key], key, at, 0.0, 1e6, above=True)
        for key, column in ACCURACIES.items()
        if key in entry
    }
    if "gap_mm" in entry:
        fields["gap_mm"] = _number(entry["gap_mm"], "gap_mm", at, 0.0, 1e3)
    if "orientation_axis" in entry:
        fields["orientation_axis"] = _axis(entry["orientation_axis"], at)
    if kind.name == "unit_pose" and "orientation_deg" in entry:
        raise InputError(
            "orientation_deg is a column of unit_pose, one value a row",
            at("orientation_deg"),
            f"leave the key out of {FILE}",
        )
    if "added_mass_g" in entry:
        fields["added_mass_g"] = _number(entry["added_mass_g"], "added_mass_g", at, 0.0, 1e6)
    if "mode" in entry:
        fields["mode"] = _choice(entry, "mode", MODES, at)
    for key, choices in (("plates", PLATES), ("valve", VALVES)):
        if key in entry:
            fields[key] = _choice(entry, key, choices, at)
    if "axis" in entry:
        fields["axis"] = _choice(entry, "axis", AXES, at)
    if "section_mm" in entry:
        pair = entry["section_mm"]
        if not isinstance(pair, list) or len(pair) != 2:
            raise InputError(
                f"section_mm = {pair!r} is not a pair", at("section_mm"), "give width and thickness, [w, t]"
            )
        fields["section_mm"] = tuple(_number(v, "section_mm", at, 0.0, 1e4, above=True) for v in pair)
    for key, size in (("force_accuracy_N", "section_mm"), ("displacement_accuracy_mm", "length_mm")):
        if key in entry and size in kind.keys and size not in entry:
            raise InputError(
                f"{key} needs {size}", at(key), f"give {size}, which turns it into one of stress or strain"
            )
    if "cells" in entry:
        fields["cells"] = _cells(entry["cells"], at)
    return fields


def _axis(value: Any, at: _Place) -> tuple[float, float, float]:
    """A direction of length 1, of "x", "y", "z" or three numbers."""
    if isinstance(value, str) and value in AXES:
        return tuple(float(a == value) for a in AXES)  # type: ignore[return-value]
    if not isinstance(value, list) or len(value) != 3:
        raise InputError(
            f"orientation_axis = {value!r} is not a direction",
            at("orientation_axis"),
            'give "x", "y", "z" or three numbers, [x, y, z]',
        )
    x, y, z = (_number(v, "orientation_axis", at, -1e6, 1e6) for v in value)
    length = math.hypot(x, y, z)
    if not length > 0.0:
        raise InputError(
            "orientation_axis has no length", at("orientation_axis"), "give three numbers, not all of them 0"
        )
    return x / length, y / length, z / length


def _cells(value: Any, at: _Place) -> tuple[int, int, int]:
    cells = value if isinstance(value, list) else [value] * 3
    whole = all(isinstance(c, int) and not isinstance(c, bool) and 1 <= c <= 1000 for c in cells)
    if len(cells) != 3 or not whole:
        raise InputError(
            f"cells = {value!r} is not a number of cells",
            at("cells"),
            "give one whole number, or three along x, y, z",
        )
    return cells[0], cells[1], cells[2]


def _strained(
    columns: dict[str, Array], fields: dict[str, Any], kind: Kind, path: Path, remarks: list[Remark]
) -> dict[str, Array]:
    """The columns with strain and nominal stress added, from displacement and force where needed."""
    needed = {"strain": ("displacement_mm", "length_mm"), "stress_kPa": ("force_N", "section_mm")}
    for column, (source, key) in needed.items():
        if column in columns:
            continue
        if source not in columns:
            raise InputError(
                f"neither {column} nor {source} is there", str(path), f"{kind.name} needs one of them"
            )
        if fields.get(key) is None:
            raise InputError(
                f"{column} cannot be computed from {source}: {key} is not given",
                f"{path}, experiment {fields['name']!r}",
                f"add {key} to the experiment in {FILE}, or a column {column}",
            )
    if "strain" not in columns:
        columns["strain"] = columns["displacement_mm"] / fields["length_mm"]
        first, span = columns["strain"][0], np.ptp(columns["strain"])
        if abs(first) > DISAGREE * span:
            remarks.append(
                Remark(
                    f"the displacement begins at {columns['displacement_mm'][0]:g} mm, which is read as a "
                    f"strain of {first:.3g}",
                    str(path),
                    "subtract it if it is only the position of the grips",
                )
            )
    elif "displacement_mm" in columns and fields.get("length_mm") is not None:
        moved = columns["displacement_mm"] - columns["displacement_mm"][0]
        strain = columns["strain"] - columns["strain"][0]
        apart = float(np.abs(moved / fields["length_mm"] - strain).max())
        if apart > DISAGREE * float(np.abs(strain).max()):
            remarks.append(
                Remark(
                    f"strain and displacement over length differ by up to {apart:.3g}; the strain is used",
                    str(path),
                    "check that length_mm is the length between the marks",
                )
            )
    if "stress_kPa" not in columns:
        width, thickness = fields["section_mm"]
        # N/mm2 is MPa.
        columns["stress_kPa"] = columns["force_N"] / (width * thickness) * 1e3
    return columns


def _check_strain(strain: Array, rows: Array, kind: Kind, path: Path, remarks: list[Remark]) -> None:
    """Check for strain that no body can have, or that looks like percent."""
    gone = strain >= 1 if kind.name == "lattice_compression" else strain <= -1
    if gone.any():
        row = int(rows[np.argmax(gone)])
        value = strain[np.argmax(gone)]
        raise InputError(
            f"a strain of {value:g} is a compression of 100 % or more",
            f"{path}, row {row}, column strain",
            "give strain as a bare number, not in percent, and positive in "
            + ("compression" if kind.name == "lattice_compression" else "tension"),
        )
    if np.abs(strain).max() > 12:
        remarks.append(
            Remark(
                f"the strain reaches {np.abs(strain).max():g}",
                f"{path}, row {int(rows[np.argmax(np.abs(strain))])}, column strain",
                "give strain as a bare number, not in percent; check length_mm, if it is by displacement",
            )
        )


def _check_preload(columns: dict[str, Array], rows: Array, path: Path, remarks: list[Remark]) -> None:
    """Check for stress where there is no strain."""
    strain, stress = np.abs(columns["strain"]), columns["stress_kPa"]
    rest = int(np.argmin(strain))
    if strain[rest] < 1e-3 * strain.max() and abs(stress[rest]) > PRELOAD * np.abs(stress).max():
        remarks.append(
            Remark(
                f"without strain the stress is {stress[rest]:.4g} kPa: a preload, or the load cell's zero",
                f"{path}, row {int(rows[rest])}, column stress_kPa",
                "subtract it where it is the zero; a law that is 0 without strain cannot follow it",
            )
        )


def _check_spread(spread: Array, column: str, rows: Array, path: Path) -> None:
    """Check that the spread of a record is positive somewhere and nowhere negative."""
    if spread.max() > 0 and spread.min() >= 0:
        return
    row = int(rows[np.argmin(spread)])
    raise InputError(
        "a standard deviation is negative, or none is above 0",
        f"{path}, row {row}, column {column}",
        "give the spread of every reading, or leave the column out",
    )


def _check_apart(found: Experiment, before: Sequence[Experiment], at: _Place) -> None:
    """Check that names differ and that no held-out data were fitted."""
    for other in before:
        if other.name == found.name:
            raise InputError(
                f"two experiments are named {found.name!r}", at("name"), "give them different names"
            )
        if other.sha256 == found.sha256 and other.role != found.role:
            raise InputError(
                f"{found.name!r} and {other.name!r} contain the same data, and one of them is held out",
                at("file"),
                "hold out data that no fit uses",
            )


def _file(name: str, at: _Place) -> Path:
    path = Path(name)
    if path.is_absolute() or ".." in path.parts:
        raise InputError(
            f"file {name!r} lies outside the folder",
            at("file"),
            "keep a folder's files in it, so that it can be moved",
        )
    return at.path.parent / path


def _text(path: Path, remedy: str, read: Callable[[Path], str] = file_text) -> str:
    try:
        return read(path)
    except UnicodeDecodeError as error:
        raise InputError("the file is not UTF-8 text", str(path), "save it as UTF-8") from error
    except OSError as error:
        raise InputError(f"cannot read {path.name}: {error.strerror}", str(path), remedy) from error


def _word(entry: dict[str, Any], key: str, at: _Place) -> str:
    value = entry[key]
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{key} = {value!r} is not a name", at(key), f'write {key} = "..."')
    return value


def _choice(entry: dict[str, Any], key: str, choices: tuple[str, ...], at: _Place) -> str:
    if key not in entry:
        raise InputError(f"key {key!r} is missing", at(), f"choose one of {', '.join(choices)}")
    value = entry[key]
    if value not in choices:
        hint = did_you_mean(value, choices) if isinstance(value, str) else ""
        raise InputError(
            f"{key} = {value!r} is not known{hint}", at(key), f"choose one of {', '.join(choices)}"
        )
    return str(value)


def _number(value: Any, key: str, at: _Place, low: float, high: float, above: bool = False) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{key} = {value!r} is not a number", at(key), "give a number without its unit")
    if not low <= value <= high or (above and value == low):
        range_ = f"above {low:g}, up to {high:g}" if above else f"from {low:g} to {high:g}"
        raise InputError(f"{key} = {value:g} is out of bounds", at(key), f"give a number {range_}")
    return float(value)


def _place(path: Path, text: str, number: int, key: str = "") -> str:
    """File and line of a key of the n-th experiment, or of the line that begins it."""
    count = 0
    for line, words in enumerate(text.splitlines(), 1):
        if re.match(r"\s*\[\[", words):
            count += 1
            if count == number and not key:
                return f"{path}, line {line}"
        elif count == number and key and re.match(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=", words):
            return f"{path}, line {line}"
    return str(path)


def experiments_digest(measured: Measured) -> str:
    """SHA-256 of the file that describes a folder's experiments."""
    return digest(file_bytes(measured.folder / FILE))


def described(measured: Measured) -> dict[str, list[str]]:
    """Kind, role and SHA-256 of each experiment's file, by name."""
    return {e.name: [e.kind, e.role, e.sha256] for e in measured.experiments}


def require_same_data(measured: Measured, before: Any, now: Mapping[str, Any]) -> None:
    """Raise InputError if measured data differ from those that a run was made with.

    before: in the run's inputs by name, or None; now: the present ones.
    """
    if before is None or before == now:
        return
    known = before if isinstance(before, Mapping) else {}
    other = [name for name in {**known, **now} if known.get(name) != now.get(name)]
    raise InputError(
        f"the measured data have changed since the run was made: {', '.join(other[:3])}",
        str(measured.folder),
        "restore those, or use a separate results folder for these",
    )
