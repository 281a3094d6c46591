"""Thinnest solid, narrowest gap and chamber walls against the printer's limits."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .finding import Finding, Severity, clustered, judged
from .printer import Printer
from .thickness import RayHits, Samples

OPPOSED = -0.9
"""Cosine between two faces up to which the space between them is a wall or a gap and not a wedge."""


def thinnest(surface: Samples, inward: RayHits, printer: Printer) -> Finding:
    """Finding on the thinnest solid in mm against the limit solid_mm; inward: rays into the solid."""
    return _measured(
        "thinnest solid",
        surface,
        inward,
        inward.cosine < OPPOSED,
        printer,
        "solid_mm",
        "error",
        "thick",
        "thicken it",
    )


def narrowest(surface: Samples, outward: RayHits, printer: Printer) -> Finding:
    """Finding on the narrowest gap in mm against the limit gap_mm; outward: rays out of the solid."""
    remedy = "widen it, or close it in the drawing: resin may close it in print"
    facing = outward.cosine < OPPOSED
    return _measured("narrowest gap", surface, outward, facing, printer, "gap_mm", "warning", "wide", remedy)


def _measured(
    name: str,
    surface: Samples,
    rays: RayHits,
    counts: NDArray[np.bool_],
    printer: Printer,
    key: str,
    severity: Severity,
    adjective: str,
    remedy: str,
    facets_mm: float = 0.0,
) -> Finding:
    limit = printer.limits[key]
    width = np.where(counts, rays.distance, np.inf)
    least = float(width.min(initial=np.inf))
    bad = width < limit.value - facets_mm
    if not np.isfinite(least):
        words = "no wall is near the limit" if adjective == "thick" else "no gap is near the limit"
        return judged(name, False, severity, words, np.nan, limit)
    middle = 0.5 * (surface.points + rays.at)
    places = clustered(middle[bad], -width[bad])
    what = f"{least:.3g} mm {adjective} at least"
    if bad.any():
        what += f", in {len(places)} places below the limit"
    elif least < limit.value:
        what += ", due to flat facets; not below the limit as drawn"
    shown = middle[[int(width.argmin())]]
    return judged(name, bool(bad.any()), severity, what, least, limit, places, remedy, shown=shown)


def chamber_walls(
    surface: Samples,
    inward: RayHits,
    between: NDArray[np.bool_],
    printer: Printer,
    facets_mm: float = 0.0,
) -> list[Finding]:
    """Finding on the thinnest wall in mm between chambers and the outside; empty without such a wall.

    inward: rays from samples into the solid; between (s,): marks those from a chamber to outside every
    chamber; facets_mm: distance by which flat facets may lie inside the curved wall.
    """
    if not between.any():
        return []
    counts = between & (inward.cosine < -0.5)
    remedy = "thicken the wall"
    return [
        _measured(
            "chamber wall", surface, inward, counts, printer, "wall_mm", "error", "thick", remedy, facets_mm
        )
    ]
