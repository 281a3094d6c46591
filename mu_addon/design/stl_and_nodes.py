"""Files of a design: the printable STL and the lattice's node coordinates."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from ..files import write_bytes
from .anchors import anchor_points
from .lattice import lattice_of
from .parameters import Unit
from .solid import Solid
from .surface import stl_bytes


def write_stl(solid: Solid, path: str | Path) -> None:
    """Write the solid as binary STL in mm; equal solids give equal files. Raises OutputError."""
    write_bytes(Path(path), stl_bytes(solid.vertices, solid.triangles))


def write_nodes(unit: Unit, path: str | Path) -> None:
    """Write `nodes_text`. Raises OutputError."""
    write_bytes(Path(path), nodes_text(unit).encode())


def nodes_text(unit: Unit) -> str:
    """Every lattice node as text: `#` header lines, then id, kind and x, y, z in mm, split by spaces.

    The id counts from 0; kind is `centre` or `corner` of a cell, `node` for another, or `P1`, `P2`, ... for
    those that are anchors.
    """
    lattice = lattice_of(unit.dimensions)
    kinds = np.select([lattice.is_centre, lattice.is_corner], ["centre", "corner"], "node").tolist()
    for number, anchor in enumerate(anchor_points(unit), 1):
        gap = abs(lattice.nodes - anchor).sum(axis=1)
        if gap.min() < 1e-6 * lattice.cell:
            kinds[int(gap.argmin())] = f"P{number}"
    lines = [
        f"# lattice nodes of {unit.name} at scale {unit.scale:g}",
        f"# {len(kinds)} nodes; kind: centre or corner of a cell, P1 .. P{unit.chambers.count} the anchors",
        "# frame: z from the inlet to the tip, x = 0 the bending plane, +y the side with more lattice",
        "# id kind x_mm y_mm z_mm",
    ]
    for index, (kind, (x, y, z)) in enumerate(zip(kinds, lattice.nodes, strict=True)):
        lines.append(f"{index} {kind} {x:.6f} {y:.6f} {z:.6f}")
    return "\n".join(lines) + "\n"
