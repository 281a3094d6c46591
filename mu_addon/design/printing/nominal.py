"""A part compared with its unit's solid: tunnels (genus) and volume."""

from __future__ import annotations

from ..surface import Triangles, Vertices, genus, volume
from .finding import Finding

VOLUME_TOLERANCE = 0.02
"""Share of the volume by which facets may differ; a print offset taken off the drawing changes more."""


def against_nominal(
    vertices: Vertices, triangles: Triangles, nominal: tuple[Vertices, Triangles]
) -> list[Finding]:
    """Findings on what a part lacks, or has more, than the nominal solid; both closed surfaces in mm.

    Every strut of a lattice closes a tunnel: a part without one has a genus that is less by one, however it
    is divided into facets. The genus must be the same, else `error`; a volume that differs by more than
    VOLUME_TOLERANCE is a `warning`.
    """
    found, wanted = genus(vertices, triangles), genus(*nominal)
    tunnels = Finding(
        "tunnels",
        "pass" if found == wanted else "error",
        f"the part has {found} tunnels (genus), the unit's own solid {wanted}" + _difference(found - wanted),
        float(found),
        float(wanted),
        source="the unit's own solid",
        count=int(found != wanted),
        remedy="" if found == wanted else "export the unit again, or give the --path of the part's waveguide",
    )
    mm3, expected = volume(vertices, triangles), volume(*nominal)
    share = mm3 / expected - 1.0
    same = abs(share) <= VOLUME_TOLERANCE
    size = Finding(
        "volume",
        "pass" if same else "warning",
        f"{mm3 / 1e3:.4g} ml, {share:+.1%} against {expected / 1e3:.4g} ml of the unit's own solid",
        mm3 / 1e3,
        expected / 1e3,
        "ml",
        source=f"the unit's own solid, within {VOLUME_TOLERANCE:.0%}",
        count=int(not same),
        remedy="" if same else "see whether the print offset was taken off, or export the unit again",
    )
    return [tunnels, size]


def _difference(more: int) -> str:
    """Meaning of a genus that differs, in words."""
    if not more:
        return ""
    if more < 0:
        return f": {-more} less, as where struts are missing or openings are closed"
    return f": {more} more, as where there is a hole or a strut too many"
