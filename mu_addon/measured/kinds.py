"""Kinds of experiment: their columns, required ones, and keys."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence

import attrs

MODES = ("uniaxial", "equibiaxial", "pure_shear")
AXES = ("x", "y", "z")
# Whether a block's faces stick to the machine's plates.
PLATES = ("hold", "slide")
# Whether gauge and unit are shut off from the supply together.
VALVES = ("open", "shut")
ROLES = ("fit", "held_out")
PRESSURES = ("gauge", "absolute")
# Kinds that are of a unit, whose simulation predicts them.
OF_A_UNIT = ("unit_pressure", "pressure_step", "unit_pose", "blocked_force")

# Standard deviation of a reading, by quantity: an ordinary camera, gauge, load cell and voltmeter.
NOISE = {
    "angle": 0.3,
    "marker": 0.1,
    "stress": 0.1,
    "pressure": 0.1,
    "tip_deflection": 0.1,
    "voltage": 0.002,
}

# Every quantity is read in one unit, which its column's name ends with; "" has none.
UNITS = {
    "time": "s",
    "pressure": "kPa",
    "angle": "deg",
    "angle_sd": "deg",
    "displacement": "mm",
    "force": "N",
    "strain": "",
    "stress": "kPa",
    "stress_sd": "kPa",
    "added_mass": "g",
    "tip_deflection": "mm",
    "voltage": "V",
    "volume": "mm3",
    "orientation": "deg",
    "room": "C",
}
# What a column may be in instead: how much of the unit it is read in one of it is.
CONVERTED = {
    "s": {"ms": 1e-3, "us": 1e-6, "min": 60.0},
    "kPa": {"Pa": 1e-3, "MPa": 1e3, "mbar": 0.1, "bar": 100.0, "psi": 6.894757293168361},
    "deg": {"rad": 180.0 / math.pi},
    "mm": {"um": 1e-3, "cm": 10.0, "m": 1e3},
    "N": {"mN": 1e-3, "kN": 1e3, "kgf": 9.80665, "lbf": 4.4482216152605},
    "g": {"mg": 1e-3, "kg": 1e3},
    "V": {"mV": 1e-3},
    "mm3": {"ul": 1.0, "ml": 1e3, "cm3": 1e3},
    "": {"percent": 1e-2},
}
# What is read of a body that changes steadily: it never jumps by the factor between two units.
STEADY = {
    "coupon": ("force_N", "stress_kPa"),
    "lattice_compression": ("force_N", "stress_kPa"),
    "pressure_hold": ("pressure_kPa",),
}
# Columns with possible gaps, by a camera or a voltmeter; a gap in any other makes its row meaningless.
MAY_BE_MISSING = ("angle_deg", "voltage_V", "marker", "volume_mm3")

_MARKER = re.compile(r"marker([1-9]\d*)_([xyz])_mm")

# Keys for the stated accuracy of an instrument, and what it reads.
ACCURACIES = {
    "force_accuracy_N": "force_N",
    "displacement_accuracy_mm": "displacement_mm",
    "pressure_accuracy_kPa": "pressure_kPa",
    "angle_accuracy_deg": "angle_deg",
}

# Keys that are numbers: lowest and highest value, or the highest of those above zero; and those of a choice.
BETWEEN = {
    "scale": (0.01, 100.0),
    "orientation_deg": (-360.0, 360.0),
    "run_order": (-1e15, 1e15),
    "temperature_C": (-100.0, 300.0),
    "gap_mm": (0.0, 1e3),
    "added_mass_g": (0.0, 1e6),
}
UP_TO = {"length_mm": 1e4, "strut_mm": 1e3, "mass_g": 1e6, "mass_sd_g": 1e6, "chamber_volume_mm3": 1e9}
CHOICES = {"plates": PLATES, "axis": AXES, "valve": VALVES, "mode": MODES, "pressure": PRESSURES}

COMMON = (
    "name",
    "kind",
    "file",
    "role",
    "run_order",
    "scale",
    "orientation_deg",
    "specimen",
    "session",
    "temperature_C",
    "source",
)


@attrs.frozen
class Kind:
    """A kind of experiment.

    needs: groups of columns, at least one must be complete; may_have: further columns; timed: time_s is
    required; needs_keys, may_have_keys: keys of experiments.toml beyond `COMMON`; fewest: least number of
    rows; marked: it may have columns of markers.
    """

    name: str
    needs: tuple[tuple[str, ...], ...]
    may_have: tuple[str, ...] = ()
    timed: bool = True
    needs_keys: tuple[str, ...] = ()
    may_have_keys: tuple[str, ...] = ()
    fewest: int = 2
    marked: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of all columns that it may have, markers apart."""
        needed = [column for group in self.needs for column in group]
        return tuple(dict.fromkeys([*(("time_s",) if self.timed else ()), *needed, *self.may_have]))

    @property
    def keys(self) -> tuple[str, ...]:
        """All keys of experiments.toml that may describe it."""
        stated = tuple(key for key, column in ACCURACIES.items() if column in self.columns)
        return COMMON + self.needs_keys + self.may_have_keys + stated

    def knows(self, column: str) -> bool:
        """Return True if it may have a column of this name, with the unit that is read."""
        return column in self.columns or (self.marked and _MARKER.fullmatch(column) is not None)


# Section and length of the specimen turn force and displacement into stress and strain.
_LOAD = (
    ("strain", "stress_kPa"),
    ("displacement_mm", "force_N"),
    ("strain", "force_N"),
    ("displacement_mm", "stress_kPa"),
)
_BENT = (
    ("pressure_kPa", "angle_deg"),
    ("pressure_kPa", "marker1_y_mm", "marker1_z_mm"),
    ("pressure_kPa", "volume_mm3"),
)
_DRIVEN = ("added_mass_g", "chamber_volume_mm3", "valve", "pressure", "orientation_axis")

KINDS = {
    kind.name: kind
    for kind in (
        Kind("unit_pressure", _BENT, ("angle_sd_deg",), may_have_keys=_DRIVEN, marked=True),
        Kind("pressure_step", _BENT[:2], may_have_keys=_DRIVEN, fewest=10, marked=True),
        Kind(
            "unit_pose",
            (("pressure_kPa", "orientation_deg", "angle_deg"),),
            timed=False,
            may_have_keys=("pressure", "orientation_axis"),
        ),
        Kind(
            "blocked_force",
            (("pressure_kPa", "force_N"),),
            may_have_keys=("gap_mm", "valve", "pressure", "orientation_axis"),
        ),
        Kind(
            "lattice_compression",
            _LOAD,
            ("time_s", "stress_sd_kPa"),
            timed=False,
            may_have_keys=(
                "section_mm",
                "length_mm",
                "cells",
                "strut_mm",
                "plates",
                "axis",
                "mass_g",
                "mass_sd_g",
            ),
        ),
        Kind(
            "coupon",
            _LOAD,
            ("time_s", "stress_sd_kPa"),
            timed=False,
            needs_keys=("mode",),
            may_have_keys=("section_mm", "length_mm", "axis", "mass_g"),
        ),
        Kind(
            "pressure_hold",
            (("pressure_kPa",),),
            ("room_C",),
            may_have_keys=("chamber_volume_mm3", "pressure"),
        ),
        Kind(
            "beam_deadweight",
            (("added_mass_g", "tip_deflection_mm"),),
            timed=False,
            needs_keys=("section_mm", "length_mm"),
            may_have_keys=("mass_g",),
            fewest=1,
        ),
        Kind(
            "waveguide_bending",
            (("angle_deg", "voltage_V"),),
            may_have_keys=("section_mm", "length_mm"),
        ),
    )
}


def quantity_of(column: str) -> tuple[str, str] | None:
    """Quantity and unit in a column's name, such as ("pressure", "kPa"); None for an unknown quantity."""
    if re.fullmatch(r"marker[1-9]\d*_[xyz](_\w+)?", column):
        head, _, tail = column.rpartition("_")
        return (column, "") if tail in "xyz" else (head, tail)
    for quantity in sorted(UNITS, key=len, reverse=True):
        if column == quantity or column.startswith(quantity + "_"):
            return quantity, column[len(quantity) + 1 :]
    return None


def named(quantity: str) -> str:
    """Name of a quantity's column with the unit that is read, such as pressure_kPa; mm for a marker."""
    unit = UNITS.get(quantity, "mm")
    return f"{quantity}_{unit}" if unit else quantity


def units_of(quantity: str) -> dict[str, float]:
    """Units that a quantity's column may have, each with its factor to the unit that is read."""
    unit = UNITS.get(quantity, "mm")
    return {unit: 1.0, **CONVERTED[unit]}


def markers(columns: Sequence[str]) -> dict[int, set[str]]:
    """Axes x, y and z among the columns, by the number of the marker."""
    found: dict[int, set[str]] = {}
    for column in columns:
        match = _MARKER.fullmatch(column)
        if match:
            found.setdefault(int(match[1]), set()).add(match[2])
    return found


def may_be_missing(column: str) -> bool:
    """Return True if single values of this column may be missing: angle, voltage, volume or a marker."""
    return column.startswith(MAY_BE_MISSING)
