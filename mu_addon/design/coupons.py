"""Parts to print and measure: a gauge for the printer's offsets, and coupons of strut, wall and waveguide."""

from __future__ import annotations

from typing import Any

import attrs
import numpy as np
from numpy.typing import ArrayLike

from . import shapes
from .dimensions import Dimensions
from .solid import printable
from .surface import Triangles, Vertices
from .waveguide import free_bar

GAUGE_MM = 25.0
"""Length of a tension coupon between its shoulders."""
STRIP_MM = 6.0
"""Width of the wall's coupon between its shoulders."""
ARM_MM = 40.0
"""Free length of the bending beam."""


@attrs.frozen
class Feature:
    """One dimension of the gauge to measure with calipers: nominal_mm in mm along `axis` "x", "y" or "z".

    kind: "solid" for material, "gap" for a slot; where: its place on the gauge, as text.
    """

    name: str
    kind: str
    axis: str
    nominal_mm: float
    where: str


def _fins(axis: str, sizes: tuple[float, ...]) -> tuple[Feature, ...]:
    where = {
        "x": "fins in the front row, thickness along the base's length",
        "y": "fins in the back row, thickness across the base",
        "z": "shelves on the post, thickness along the build axis",
    }[axis]
    return tuple(Feature(f"{axis}{k}", "solid", axis, size, where) for k, size in enumerate(sizes, 1))


FEATURES: tuple[Feature, ...] = (
    *_fins("x", (0.9, 1.5, 2.0, 3.0)),
    *_fins("y", (0.9, 1.5, 2.0)),
    *_fins("z", (0.9, 1.5, 2.0)),
    *(
        Feature(f"gap{k}", "gap", "x", size, "slots in the front block, by feeler gauge or pin")
        for k, size in enumerate((1.0, 1.5, 2.0), 1)
    ),
    Feature("length", "solid", "x", 44.0, "the base's length"),
    Feature("depth", "solid", "y", 18.0, "the base's depth"),
    Feature("height", "solid", "z", 22.0, "from the base's underside to the top of the post"),
)
"""Every size of the gauge, in the order of its sheet."""


def gauge() -> tuple[Vertices, Triangles]:
    """The gauge for the print offsets: vertices (n, 3) in mm and triangles (m, 3) of a closed surface.

    A base with the fins, slots and shelves of FEATURES, at their nominal sizes.
    """
    size = {feature.name: feature.nominal_mm for feature in FEATURES}
    boxes = [((0.0, 0.0, 0.0), (size["length"], size["depth"], 4.0))]
    x = 2.0
    for name in ("x1", "x2", "x3", "x4"):
        boxes.append(((x, 1.0, 3.0), (x + size[name], 7.0, 10.0)))
        x += size[name] + 4.0
    x = size["length"] - 1.0
    for name in ("gap3", "gap2", "gap1"):
        boxes.append(((x - 2.0, 1.0, 3.0), (x, 7.0, 10.0)))
        x -= 2.0 + size[name]
    boxes.append(((x - 2.0, 1.0, 3.0), (x, 7.0, 10.0)))
    for k, name in enumerate(("y1", "y2", "y3")):
        boxes.append(((2.0 + 10.0 * k, 12.0, 3.0), (9.0 + 10.0 * k, 12.0 + size[name], 10.0)))
    post = (34.0, 10.0, 3.0), (40.0, 17.0, size["height"])
    boxes.append(post)
    z = 7.0
    for name in ("z1", "z2", "z3"):
        boxes.append(((39.0, 10.0, z), (47.0, 17.0, z + size[name])))
        z += size[name] + 3.2
    return _united([shapes.box(low, high) for low, high in boxes])


def offsets(features: list[Feature], measured: ArrayLike) -> dict[str, tuple[float, float, float]]:
    """Print offsets from measured sizes (n,) in mm of features, for "xy" and "z" apart.

    Values are the outward offset o of every surface, its standard error, and the scale s, by least squares of
    measured - nominal = +-2 o + s nominal, minus for gaps. A direction of fewer than three sizes is left
    out.
    """
    measured = np.asarray(measured, float)
    found = {}
    for direction in ("xy", "z"):
        chosen = [k for k, feature in enumerate(features) if feature.axis in direction]
        if len(chosen) < 3:
            continue
        nominal = np.array([features[k].nominal_mm for k in chosen])
        sign = np.array([1.0 if features[k].kind == "solid" else -1.0 for k in chosen])
        design = np.stack([2.0 * sign, nominal], axis=1)
        residual = measured[chosen] - nominal
        solution, *_ = np.linalg.lstsq(design, residual, rcond=None)
        left = residual - design @ solution
        spread = float(left @ left) / max(1, len(chosen) - 2)
        error = float(np.sqrt(spread * np.linalg.inv(design.T @ design)[0, 0]))
        found[direction] = (float(solution[0]), error, float(solution[1]))
    return found


def strut_coupon(d: Dimensions) -> tuple[Vertices, Triangles]:
    """A round tension coupon as thick as a strut's junction: vertices (n, 3) in mm, triangles (m, 3).

    Its axis is z, its gauge length GAUGE_MM between tapered grips.
    """
    r, grip = d.junction_diameter / 2.0, max(4.0, 2.0 * d.junction_diameter)
    taper = 1.5 * (grip - r)
    z = np.cumsum([0.0, 12.0, taper, GAUGE_MM, taper, 12.0])
    outline = np.array(
        [[0, z[0]], [grip, z[0]], [grip, z[1]], [r, z[2]], [r, z[3]], [grip, z[4]], [grip, z[5]], [0, z[5]]]
    )
    return _united([shapes.revolved(outline, 48)])


def wall_coupon(d: Dimensions) -> tuple[Vertices, Triangles]:
    """A flat tension coupon as thick as the membrane's wall: vertices (n, 3) in mm, triangles (m, 3).

    It is upright in the xz plane, STRIP_MM wide over a gauge length of GAUGE_MM between wider grips.
    """
    from manifold3d import CrossSection, Manifold

    half, grip, z = STRIP_MM / 2.0, 10.0, np.cumsum([0.0, 15.0, 8.0, GAUGE_MM, 8.0, 15.0])
    right = [[grip, z[0]], [grip, z[1]], [half, z[2]], [half, z[3]], [grip, z[4]], [grip, z[5]]]
    outline = np.array(right + [[-x, y] for x, y in right[::-1]])
    flat = Manifold.extrude(CrossSection([outline]), d.wall).rotate([90.0, 0.0, 0.0])
    return _united([flat.translate([0.0, d.wall, 0.0])])


def beam_coupon(d: Dimensions) -> tuple[Vertices, Triangles]:
    """A cantilever with the waveguide's square section: vertices (n, 3) in mm, triangles (m, 3).

    The beam extends ARM_MM along x from a block to be clamped; weights are hung from its tip.
    """
    h = d.waveguide_section / 2.0
    return _united(
        [shapes.box([-12.0, -6.0, -4.0], [0.0, 6.0, 4.0]), shapes.box([-1.0, -h, -h], [ARM_MM, h, h])]
    )


def waveguide_coupon(d: Dimensions, length: float) -> tuple[Vertices, Triangles]:
    """A straight waveguide along z with wells and seats: vertices (n, 3) in mm, triangles (m, 3).

    length: distance in mm between the points that are its end nodes in a lattice.
    """
    bar = free_bar(d, length)
    body = bar.solid()
    for cut in bar.cut_solids():
        body -= cut
    return printable(body)


def _united(solids: list[Any]) -> tuple[Vertices, Triangles]:
    from manifold3d import Manifold, OpType

    return printable(Manifold.batch_boolean(solids, OpType.Add))
