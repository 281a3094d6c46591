"""The print offset: from a unit's own [print], or from calipers on the printed gauge."""

from __future__ import annotations

import math
from pathlib import Path

from ...design.coupons import FEATURES, offsets
from ...design.parameters import Unit
from ...errors import InputError
from .sheet import sheet_rows, sheet_text

COLUMNS = ("feature", "kind", "axis", "nominal_mm", "measured_mm")


def gauge_sheet() -> str:
    """The gauge's sheet as CSV text, its last column to be filled in."""
    return sheet_text(COLUMNS, [(f.name, f.kind, f.axis, f"{f.nominal_mm:g}") for f in FEATURES])


def read_sheet(path: Path) -> dict[str, tuple[float, float, float]]:
    """Offset, its standard error and scale, for "xy" and "z", of a filled sheet; raises InputError."""
    known = {feature.name: feature for feature in FEATURES}
    chosen, sizes = [], []
    for where, row in sheet_rows(path, "give the gauge's CSV file"):
        name, value = row.get("feature") or "", (row.get("measured_mm") or "").strip()
        if name not in known:
            raise InputError(
                f"the gauge has no feature {name!r}",
                where,
                "the features are those of `specimens`",
            )
        if not value:
            continue
        try:
            size = float(value)
        except ValueError:
            size = math.nan
        if not 0.0 < size < 3.0 * known[name].nominal_mm:
            raise InputError(
                f"{name} measured as {value!r}, nominal {known[name].nominal_mm:g} mm",
                where,
                "give millimetres, or leave it empty",
            )
        chosen.append(known[name])
        sizes.append(size)
    found = offsets(chosen, sizes)
    if set(found) != {"xy", "z"}:
        raise InputError(
            f"{len(chosen)} sizes were measured, which is too few in {'z' if 'xy' in found else 'the plane'}",
            str(path),
            "measure at least three along x and y, and three along z",
        )
    return found


def compensation_offsets(unit: Unit, source: str | None) -> tuple[tuple[float, float], str]:
    """Offsets in mm, in the plane and along z, to subtract from a drawing, and their source.

    source: None for nothing, "unit" for the unit's [print], else the gauge's filled sheet. Raises InputError.
    """
    if source is None:
        return (0.0, 0.0), ""
    if source == "unit":
        found = unit.print.offset_xy_mm, unit.print.offset_z_mm
        if not any(found):
            raise InputError(
                "the unit's [print] has no print offset to compensate",
                "--compensate",
                "give a --model with overcure, or the filled CSV sheet of the gauge",
            )
        return found, "the unit's [print]"
    of = read_sheet(Path(source))
    (xy, xy_error, _), (z, z_error, _) = of["xy"], of["z"]
    return (
        round(xy, 4),
        round(z, 4),
    ), f"{Path(source).name}: {xy:.3f} +- {xy_error:.3f} in the plane, {z:.3f} +- {z_error:.3f} along z"
