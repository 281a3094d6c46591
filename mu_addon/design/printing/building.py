"""Islands, cups, overhangs and spans of a build against the printer's limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from . import layers, trapped_resin
from .chambers import Chambers
from .finding import Finding, Points, Severity, clustered, counted, judged
from .printer import Limit, Printer
from .voxels import VoxelRows


def build_findings(
    built: VoxelRows, chambers: Chambers, printer: Printer
) -> tuple[list[Finding], dict[str, float]]:
    """Findings on islands, cups, overhangs and bridges of a build, and the volumes of its cups in ml by name.

    built: the part's cells along the build direction, one layer high; chambers: to distinguish islands inside
    them from those outside. The limits are the printer's.
    """
    begun = layers.islands(built, layers.regions(built, free=False))
    closed = trapped_resin.cups(built, layers.regions(built, free=True))
    over = layers.overhangs(built, printer["overhang_deg"])
    inner = chambers.hold(begun.places)
    found = [
        _islands("islands", begun.places[~inner], printer, "warning", "support each of them"),
        _islands(
            "islands in chambers",
            begun.places[inner],
            printer,
            "error",
            "rotate the part: supports there cannot be removed",
        ),
        _cups(closed, printer),
        _spans("overhang", "overhang_mm", over.places, over.reach, ~over.bridge, printer),
        _spans("bridge", "bridge_mm", over.places, 2.0 * over.reach, over.bridge, printer),
    ]
    ml = {
        "trapped_ml": float(closed.volume[closed.sealed].sum()) / 1e3,
        "largest_cup_ml": float(closed.volume[:1].sum()) / 1e3,
    }
    return found, ml


def _islands(name: str, places: Points, printer: Printer, severity: Severity, remedy: str) -> Finding:
    layer = printer.limits["layer_mm"]
    none = Limit(0.0, f"layers of {layer.value:g} mm: {layer.source}", layer.assumed)
    what = counted(
        len(places), "region starts without support (island)", "regions start without support (islands)"
    )
    return judged(name, len(places) > 0, severity, what, float(len(places)), none, places, remedy, "")


def _cups(closed: trapped_resin.Cups, printer: Printer) -> Finding:
    limit = printer.limits["cup_ml"]
    most = float(closed.volume[:1].sum()) / 1e3
    large = closed.volume / 1e3 > limit.value
    remedy = (
        "print with the opening toward the platform: see the build directions; or vent it: "
        "export --vent-along"
    )
    what = f"{most:.3f} ml at most sealed against the film"
    return judged("cups", bool(large.any()), "warning", what, most, limit, closed.places[large], remedy, "ml")


def _spans(
    name: str, key: str, places: Points, size: Points, mine: NDArray[np.bool_], printer: Printer
) -> Finding:
    limit = printer.limits[key]
    bad = mine & (size > limit.value)
    most = float(size[mine].max(initial=0.0))
    where = "between supports" if name == "bridge" else "beyond support"
    what = f"{most:.3g} mm {where} at most, flatter than {printer['overhang_deg']:g} degrees"
    worst = clustered(places[bad], size[bad])
    return judged(
        name, bool(bad.any()), "warning", what, most, limit, worst, "support it, or rotate the part"
    )
