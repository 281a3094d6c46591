"""The optical waveguide: a straight square bar along a window of anchors, with wells on its outer face."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .anchors import Window, anchors
from .lattice import lattice_of
from .parameters import Dimensions, Unit


@attrs.frozen(eq=False)
class Bar:
    """Axis-aligned boxes in mm as (low, high) corners: the bar (2, 3) and its wells (n, 2, 3)."""

    box: NDArray[np.float64]
    wells: NDArray[np.float64]


def junction_reach(d: Dimensions) -> float:
    """Distance (mm) from a node along the bar over which strut roots cover its faces.

    A strut of radius rho along the unit vector a cuts the face at height h above the node in an ellipse that
    reaches h a_z/a_y + rho sqrt(1 - a_x^2)/a_y along the bar; that point lies
    h/a_y + rho a_z/(a_y sqrt(1 - a_x^2)) up the strut, where rho is taken. Along (1, 1, 1) that is
    h + sqrt(2) rho, at sqrt(3) h + sqrt(3/2) rho. A strut square to y covers nothing unless it is wider than
    the bar, and then all its length. Raises InputError for a lattice without a node at the cell's centre.
    """
    kind, h = d.kind, d.waveguide_section / 2.0
    ways = kind.from_centre
    if not len(ways):
        raise InputError(
            f"lattice {kind.name!r} has no node at the cell's centre, where the anchors are",
            "[lattice] kind",
            "choose a kind that has one, or build the unit without a waveguide",
        )
    lattice = lattice_of(d)
    furthest = 0.0
    for way in np.abs(ways):
        length = float(np.linalg.norm(way)) * d.cell
        x, y, z = way * d.cell / length
        if y < 1e-9:
            if lattice.radius([0.0, 0.5]).max() > h:
                furthest = max(furthest, length)
            continue
        rho = float(lattice.radius(0.0))
        side = np.sqrt(1.0 - x**2)
        for _ in range(20):
            up = (h + rho * z / side) / y
            rho = float(lattice.radius(min(up / length, 0.5)))
        furthest = max(furthest, h * z / y + rho * side / y)
    return furthest


def well_centres(d: Dimensions, spans: int) -> NDArray[np.float64]:
    """Distances (mm) from the first anchor, at constant pitch over `spans` cells, of the wells that lie open.

    A well that strut roots would cover is left out: it would be a tunnel, which neither drains nor scatters.
    """
    length = spans * d.cell
    at = np.arange(int(np.floor(length / d.well_pitch + 1e-9)) + 1) * d.well_pitch
    to_node = np.abs(at - np.rint(at / d.cell) * d.cell)
    return at[to_node - d.well_width / 2.0 > junction_reach(d)]


def waveguide(unit: Unit, window: Window) -> Bar:
    """Bar along the window's anchors, reaching beyond both ends; wells face away from the actuator's axis."""
    d = unit.dimensions
    path = anchors(unit)[list(window.indices)]
    first, last = path[0], path[-1]
    half = d.waveguide_section / 2.0
    side = np.array([half, half, d.waveguide_end])
    box = np.stack([first - side, last + side])

    z = first[2] + well_centres(d, window.length - 1)
    beyond = 0.02 * d.waveguide_section  # past the bar's own faces, so that none coincide
    outward = float(np.sign(d.row))
    y = np.sort(first[1] + outward * np.array([half - d.well_depth, half + beyond]))
    wells = np.empty((len(z), 2, 3))
    wells[:, :, 0] = first[0] - half - beyond, first[0] + half + beyond
    wells[:, :, 1] = y
    wells[:, :, 2] = np.stack([z - d.well_width / 2.0, z + d.well_width / 2.0], axis=1)
    return Bar(box, wells)
