"""Figures of a study, as columns of a parameter study's table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Row = dict[str, Any]


def angles_of(summary: Mapping[str, Any]) -> dict[float, float]:
    """Bending angles in degrees that a run's summary has, by pressure in kPa, ascending."""
    return dict(sorted((float(p), float(a)) for p, a in (summary.get("angle_deg") or {}).items()))


def figures(summary: Mapping[str, Any], density_g_per_ml: float) -> Row:
    """Figures of a study's finished stages; angle_deg has a column for every pressure."""
    found: Row = {}
    solid = (summary.get("gates") or {}).get("unit.stl") or {}
    if "volume_mm3" in solid:
        found["volume_mm3"] = solid["volume_mm3"]
        found["mass_g"] = solid["volume_mm3"] * density_g_per_ml / 1e3
    mesh = summary.get("mesh") or {}
    for name in ("cavity_volume_mm3", "nodes"):
        if name in mesh:
            found[name] = mesh[name]
    if angles := angles_of(summary):
        found["angle_lowest_deg"], found["angle_highest_deg"] = min(angles.values()), max(angles.values())
        found["angle_range_deg"] = max(angles.values()) - min(angles.values())
        found |= {f"angle_deg at {p:g} kPa": a for p, a in angles.items() if p}
        crossed = summary.get("walls_cross_at_kPa") or {}
        found["walls_cross_at_kPa"] = " ".join(sorted(crossed, key=float))
    if best := summary.get("chosen"):
        found["chosen"] = best
        found["J_hat_mm"] = summary["J_hat_mm"][best]
        found["tied"] = " ".join(summary["tied_with_chosen"])
    if of_lattice := (summary.get("search") or {}).get("best"):
        found |= {"J_hat_mm lattice": of_lattice["J_hat_mm"], "length_mm lattice": of_lattice["length_mm"]}
    return found
