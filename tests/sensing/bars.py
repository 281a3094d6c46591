"""Bars of a preset, and a plain mesh of its box, to bend and stretch them by formulas."""

from __future__ import annotations

import attrs
import numpy as np

from mu_addon.design.anchors import anchor_points, window
from mu_addon.design.parameters import Unit, load_preset
from mu_addon.design.waveguide import waveguide
from mu_addon.meshing.mesh import Mesh
from mu_addon.sensing.embedded_waveguide import EmbeddedWaveguide, embed_waveguide
from tests.fem.bodies import box


def of_window(name: str, preset: str = "mu-1.0x") -> EmbeddedWaveguide:
    """The printed bar along a window of a preset."""
    unit = load_preset(preset)
    path = window(unit, name)
    return embed_waveguide(waveguide(unit, path), anchor_points(unit)[path.indices], unit.printed)


def bent_to_a_circle(points: np.ndarray, curvature: float, y: float) -> np.ndarray:
    """Points (n, 3) bent toward +y about x; what lies at `y` keeps its length."""
    angle = curvature * points[:, 2]
    radius = 1 / curvature - (points[:, 1] - y)
    return np.column_stack([points[:, 0], y + 1 / curvature - radius * np.cos(angle), radius * np.sin(angle)])


def body(unit: Unit) -> Mesh:
    """A unit's box, filled, with nodes at those of its lattice."""
    low, high = np.array(unit.dimensions.bounds).T
    mesh = box(tuple(np.rint((high - low) / unit.dimensions.cell * 2).astype(int)), tuple(high - low))
    return attrs.evolve(mesh, nodes=mesh.nodes + low)
