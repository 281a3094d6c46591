"""The folder of measured data: experiments.toml and the CSV files it names."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ..arrays import Array
from ..errors import InputError
from ..reading import file_bytes, text_in
from ..table_cells.own_tables import own_text
from ..toml_reader import TomlTable, read_toml
from .experiment import Experiment
from .kinds import ACCURACIES, AXES, BETWEEN, CHOICES, KINDS, PRESSURES, ROLES, UP_TO, Kind
from .table import Remark, Remarks, read_table

FILE = "experiments.toml"
# Share of the largest strain by which strain and displacement over length may differ without a remark.
ATMOSPHERE_kPa = 101.325
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
    remedy = f"a folder of measured data holds {FILE}, which names its CSV files"
    document = read_toml(path, "experiments", remedy).only(("experiment",))
    entries = document.tables("experiment")
    if not entries:
        raise InputError("no experiment is defined", str(path), "begin each with a line [[experiment]]")
    experiments: list[Experiment] = []
    remarks = Remarks()
    for entry in entries:
        found, notes = _experiment(entry, path.parent)
        _check_apart(found, experiments, entry)
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


def _experiment(entry: TomlTable, folder: Path) -> tuple[Experiment, Remarks]:
    kind = KINDS[entry.word("kind", tuple(KINDS))]
    entry.only(kind.keys, {f"to {k.name}": k.keys for k in KINDS.values()})
    for key in kind.needs_keys:
        if key not in entry:
            raise InputError(f"{key} is missing", entry.at(), f"{kind.name} needs it")
    fields, path = _described(entry, kind), _file(entry, folder)
    remedy = f"{FILE} names it; correct the name or put the file there"
    text = text_in(path, "data", remedy, read=own_text)
    table = read_table(text, kind, path)
    columns, remarks = dict(table.columns), Remarks(table.remarks)
    if "pressure_kPa" in columns:
        columns["pressure_kPa"] = _gauge_pressure(columns["pressure_kPa"], entry)
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


def _gauge_pressure(pressure_kPa: Array, entry: TomlTable) -> Array:
    """Gauge pressure (n,) in kPa: as read, or less the atmosphere if it is marked as absolute."""
    absolute = entry.word("pressure", PRESSURES, "gauge") == "absolute"
    return pressure_kPa - ATMOSPHERE_kPa if absolute else pressure_kPa


def _require_gauge_pressures(experiments: Sequence[Experiment], entries: Sequence[TomlTable]) -> None:
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


def _described(entry: TomlTable, kind: Kind) -> dict[str, Any]:
    """Checked values of the keys that are present."""
    fields: dict[str, Any] = {"name": entry.word("name"), "role": entry.word("role", ROLES)}
    fields |= {key: entry.word(key) for key in ("specimen", "session", "source") if key in entry}
    fields |= {key: entry.number(key, *bounds) for key, bounds in BETWEEN.items() if key in entry}
    above = {key: entry.number(key, 0.0, most, above=True) for key, most in UP_TO.items() if key in entry}
    chosen = {key: entry.word(key, names) for key, names in CHOICES.items() if key in entry}
    fields |= above | {key: word for key, word in chosen.items() if key != "pressure"}
    fields["accuracy"] = {
        column: entry.number(key, 0.0, 1e6, above=True) for key, column in ACCURACIES.items() if key in entry
    }
    if "strut_mm" in entry and "cells" not in entry:
        remedy = "give the count of cells, from which a block is computed"
        raise InputError("strut_mm needs cells", entry.at("strut_mm"), remedy)
    if "orientation_axis" in entry:
        fields["orientation_axis"] = _axis(entry)
    if kind.name == "unit_pose" and "orientation_deg" in entry:
        raise InputError(
            "orientation_deg is a column of unit_pose, one value a row",
            entry.at("orientation_deg"),
            f"leave the key out of {FILE}",
        )
    if "section_mm" in entry:
        pair = entry.take("section_mm", tuple[float, float])
        fields["section_mm"] = tuple(entry.bounded("section_mm", v, 0.0, 1e4, above=True) for v in pair)
    for key, size in (("force_accuracy_N", "section_mm"), ("displacement_accuracy_mm", "length_mm")):
        if key in entry and size in kind.keys and size not in entry:
            remedy = f"give {size}, which turns it into one of stress or strain"
            raise InputError(f"{key} needs {size}", entry.at(key), remedy)
    if "cells" in entry:
        alone = type(entry.values["cells"]) is int
        cells = entry.take("cells", int if alone else tuple[int, int, int])
        fields["cells"] = (cells,) * 3 if alone else cells
        for count in fields["cells"]:
            entry.bounded("cells", count, 1, 1000)
    return fields


def _axis(entry: TomlTable) -> tuple[float, float, float]:
    """A direction of length 1, of "x", "y", "z" or three numbers."""
    key = "orientation_axis"
    if entry.values[key] in AXES:
        return tuple(float(a == entry.values[key]) for a in AXES)  # type: ignore[return-value]
    x, y, z = entry.take(key, tuple[float, float, float])
    length = math.hypot(x, y, z)
    if not 0.0 < length < math.inf:
        remedy = 'give "x", "y", "z" or three numbers, not all of them 0'
        raise InputError(f"{key} has no length", entry.at(key), remedy)
    return x / length, y / length, z / length


def _strained(
    columns: dict[str, Array], fields: dict[str, Any], kind: Kind, path: Path, remarks: Remarks
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
            remarks.add(
                f"the displacement begins at {columns['displacement_mm'][0]:g} mm, which is read as a "
                f"strain of {first:.3g}",
                str(path),
                "subtract it if it is only the position of the grips",
            )
    elif "displacement_mm" in columns and fields.get("length_mm") is not None:
        moved = columns["displacement_mm"] - columns["displacement_mm"][0]
        strain = columns["strain"] - columns["strain"][0]
        apart = float(np.abs(moved / fields["length_mm"] - strain).max())
        if apart > DISAGREE * float(np.abs(strain).max()):
            remarks.add(
                f"strain and displacement over length differ by up to {apart:.3g}; the strain is used",
                str(path),
                "check that length_mm is the length between the marks",
            )
    if "stress_kPa" not in columns:
        width, thickness = fields["section_mm"]
        # N/mm2 is MPa.
        columns["stress_kPa"] = columns["force_N"] / (width * thickness) * 1e3
    return columns


def _check_strain(strain: Array, rows: Array, kind: Kind, path: Path, remarks: Remarks) -> None:
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
        remarks.add(
            f"the strain reaches {np.abs(strain).max():g}",
            f"{path}, row {int(rows[np.argmax(np.abs(strain))])}, column strain",
            "give strain as a bare number, not in percent; check length_mm, if it is by displacement",
        )


def _check_preload(columns: dict[str, Array], rows: Array, path: Path, remarks: Remarks) -> None:
    """Check for stress where there is no strain."""
    strain, stress = np.abs(columns["strain"]), columns["stress_kPa"]
    rest = int(np.argmin(strain))
    if strain[rest] < 1e-3 * strain.max() and abs(stress[rest]) > PRELOAD * np.abs(stress).max():
        remarks.add(
            f"without strain the stress is {stress[rest]:.4g} kPa: a preload, or the load cell's zero",
            f"{path}, row {int(rows[rest])}, column stress_kPa",
            "subtract it where it is the zero; a law that is 0 without strain cannot follow it",
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


def _check_apart(found: Experiment, before: Sequence[Experiment], entry: TomlTable) -> None:
    """Check that names differ and that no held-out data were fitted."""
    for other in before:
        if other.name == found.name:
            raise InputError(
                f"two experiments are named {found.name!r}", entry.at("name"), "give them different names"
            )
        if other.sha256 == found.sha256 and other.role != found.role:
            raise InputError(
                f"{found.name!r} and {other.name!r} contain the same data, and one of them is held out",
                entry.at("file"),
                "hold out data that no fit uses",
            )


def _file(entry: TomlTable, folder: Path) -> Path:
    name = entry.word("file")
    path = Path(name)
    if path.is_absolute() or ".." in path.parts:
        raise InputError(
            f"file {name!r} lies outside the folder",
            entry.at("file"),
            "keep a folder's files in it, so that it can be moved",
        )
    return folder / path


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
