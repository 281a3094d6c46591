"""The optical waveguide: a straight square bar along a window of anchors, with wells on its outer face."""

from __future__ import annotations

import attrs
import numpy as np
from numpy.typing import NDArray

from .anchors import Window, anchors
from .lattice import body_centred
from .parameters import Dimensions, Unit


@attrs.frozen(eq=False)
class Bar:
    """Axis-aligned boxes in mm as (low, high) corners: the bar (2, 3) and its wells (n, 2, 3)."""

    box: NDArray[np.float64]
    wells: NDArray[np.float64]


def junction_reach(d: Dimensions) -> float:
    """Distance (mm) from a node along the bar over which strut roots cover its faces.

    A strut of radius rho along (1, 1, 1) cuts the face at height h above the node in an ellipse that reaches
    h + sqrt(2) rho along the bar; that point lies sqrt(3) h + sqrt(3/2) rho up the strut, where rho is taken.
    """
    h = d.waveguide_section / 2.0
    lattice = body_centred(d)
    rho = lattice.junction_radius
    for _ in range(20):
        up = np.sqrt(3.0) * h + np.sqrt(1.5) * rho
        rho = float(lattice.radius(min(up / (np.sqrt(0.75) * d.cell), 0.5)))
    return h + np.sqrt(2.0) * rho


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
