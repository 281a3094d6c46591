"""Test parts that show each limit of a printer and its resin: a row of features from too fine to safe."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import attrs
import numpy as np

from .. import shapes
from ..solid import printable
from ..surface import Triangles, Vertices
from .printer import MEANING, Printer

# Sizes of a row, over the limit that the printer's file gives.
RATIOS = (0.4, 0.55, 0.7, 0.85, 1.0, 1.2, 1.5)
# Of all parts, in mm: thickness of the foot under the features, distance between them, their height and
# depth, and thickness of supporting walls.
_FOOT, _APART, _HIGH, _DEEP, _SOLID = 2.0, 4.0, 10.0, 10.0, 3.0
# Legs under a cup, in mm, so that it stands off the platform.
_LEG = 6.0
_FACETS = 32
# Side in mm of the weighed cube, and its possible density, relative to that of the printer's file.
_WEIGHED = 20.0
_DENSITIES = (0.7, 1.3)


@attrs.frozen(eq=False)
class LimitPart:
    """A part with a row of features for one limit, named as in `printer.MEANING`.

    sizes (n,): of the features, in the limit's unit, ascending from the part's notched corner along x; of the
    weighed cube, the least and the largest possible density. best: the limit is the smallest, or the largest,
    size that is printed. how: the measurement, as text. make: the surface.
    """

    limit: str
    sizes: tuple[float, ...]
    best: str
    how: str
    make: Callable[[], tuple[Vertices, Triangles]]

    @property
    def name(self) -> str:
        """Name of its file, without the ending."""
        return f"limit-{self.limit.replace('_', '-')}"

    @property
    def measure(self) -> str:
        """Instructions for a measurement, as text, and where to write its result."""
        return f"{MEANING[self.limit]}: write {self.how} into limits.csv"


def limit_parts(printer: Printer, strut_mm: float) -> list[LimitPart]:
    """A part for every limit of a printer that a print can show.

    strut_mm: length of the unit's struts, half a cell's diagonal. Without a part are the build volume, the
    layer, its time and the supports, which are settings and not limits.
    """
    rows: dict[str, tuple[Callable[[float], Any], str, str]] = {
        "solid_mm": (_held_wall, "the wall between its posts is whole and straight", "smallest"),
        "wall_mm": (_free_wall, "the wall stands straight, without a hole", "smallest"),
        "strut_mm": (lambda size: _strut(size, strut_mm), "both struts are whole and straight", "smallest"),
        "gap_mm": (
            lambda size: _slotted(size, _HIGH - _SOLID),
            "a sheet of paper passes through the slot, all of it",
            "smallest",
        ),
        "well_width_mm": (
            lambda size: _slotted(size, size),
            "the groove is seen, all along and as deep as it is wide",
            "smallest",
        ),
        "well_depth_mm": (
            lambda size: _slotted(2.0, size),
            "the groove can be felt with a needle",
            "smallest",
        ),
        "drain_diameter_mm": (_drained, "no resin is left in the pocket after washing", "smallest"),
        "leak_diameter_mm": (_hole, "light passes through the hole", "smallest"),
        "overhang_deg": (_slope, "the underside of the slope is smooth and straight", "smallest"),
        "overhang_mm": (_ledge, "the ledge is level and as thick as its root", "largest"),
        "bridge_mm": (_bridge, "the bridge does not sag by more than a layer", "largest"),
        "cup_ml": (_cup, "the cup is whole, without a torn or thin place", "largest"),
    }
    found = []
    for name, (feature, judge, best) in rows.items():
        sizes = tuple(float(f"{ratio * printer[name]:.2g}") for ratio in RATIOS)
        row = ", ".join(f"{size:g}" for size in sizes)
        how = f"the {best} of {row}, in this order from the notched corner, at which {judge},"
        found.append(LimitPart(name, sizes, best, how, _row(sizes, feature, on_foot=name != "cup_ml")))
    name = "density_g_per_ml"
    sizes = tuple(float(f"{ratio * printer[name]:.2g}") for ratio in _DENSITIES)
    how = (
        f"the printed cube's mass in g over its volume in ml, {_WEIGHED**3 / 1e3:g} as drawn, better that of "
        "the water which it displaces,"
    )
    found.append(LimitPart(name, sizes, "mass over volume", how, _weighed))
    return found


def _weighed() -> tuple[Vertices, Triangles]:
    """A solid cube."""
    return printable(shapes.box([0.0] * 3, [_WEIGHED] * 3))


def _row(
    sizes: tuple[float, ...], feature: Callable[[float], Any], on_foot: bool
) -> Callable[[], tuple[Vertices, Triangles]]:
    """The surface of features side by side along x, on a common foot with a notch before the first."""

    def make() -> tuple[Vertices, Triangles]:
        from manifold3d import Manifold, OpType

        solids, x, depth = [], _APART, 0.0
        for size in sizes:
            solid = feature(size)
            low, high = np.reshape(solid.bounding_box(), (2, 3))
            solids.append(solid.translate([x - low[0], -low[1], 0.0]))
            x += high[0] - low[0] + _APART
            depth = max(depth, high[1] - low[1])
        if on_foot:
            foot = shapes.box([0.0, -_APART, -_FOOT], [x, depth + _APART, 0.1])
            notch = shapes.box([-1.0, -_APART - 1.0, -_FOOT - 1.0], [2.0, -_APART + 2.0, 1.0])
        else:
            # Cups stand off the platform and are held together by a rail above them.
            top = max(np.reshape(s.bounding_box(), (2, 3))[1, 2] for s in solids)
            foot = shapes.box([0.0, 0.0, top - 0.1], [x, _SOLID, top + _SOLID])
            solids = [
                s.translate([0.0, 0.0, top - np.reshape(s.bounding_box(), (2, 3))[1, 2]]) for s in solids
            ]
            notch = shapes.box([-1.0, -1.0, top + 1.0], [2.0, 4.0, top + _SOLID + 1.0])
        return printable(Manifold.batch_boolean([*solids, foot], OpType.Add) - notch)

    return make


def _held_wall(thickness: float) -> Any:
    wall = shapes.box([0.0, 0.0, 0.0], [thickness, 3 * _DEEP, _HIGH])
    for y in (0.0, 3 * _DEEP - _SOLID):
        wall += shapes.box([-_SOLID / 2, y, 0.0], [_SOLID / 2 + thickness, y + _SOLID, _HIGH])
    return wall


def _free_wall(thickness: float) -> Any:
    return shapes.box([0.0, 0.0, 0.0], [thickness, _DEEP, _HIGH])


def _strut(diameter: float, length: float) -> Any:
    """Two rods, inclined as in a body-centred cell, from the foot to a bar above."""
    from manifold3d import Manifold

    way = length / np.sqrt(3.0)
    solid = Manifold()
    for y, turn in ((0.0, 1.0), (2 * way + 2 * diameter, -1.0)):
        axis = np.array([way, turn * way, way])
        # Into foot and bar by a radius, so that both ends are within them.
        over = 1.0 + diameter / length
        rod = shapes.spindle(over * axis, np.array([diameter / 2, diameter / 2]), _FACETS)
        solid += rod.translate((np.array([0.0, y, 0.0]) - (over - 1) / 2 * axis).tolist())
    wide = 2 * way + 2 * diameter
    solid += shapes.box([way - _SOLID / 2, 0.0, way], [way + _SOLID / 2, wide, way + _SOLID])
    for y in (0.0, wide - _SOLID):
        solid += shapes.box([way - _SOLID / 2, y, 0.0], [way + _SOLID / 2, y + _SOLID, way + 1.0])
    return solid.trim_by_plane([0.0, 0.0, 1.0], -_FOOT / 2)


def _slotted(width: float, depth: float) -> Any:
    """A block with a slot of that width and depth along its top."""
    block = shapes.box([0.0, 0.0, 0.0], [width + 2 * _SOLID, _DEEP, _HIGH])
    return block - shapes.box([_SOLID, -1.0, _HIGH - depth], [_SOLID + width, _DEEP + 1.0, _HIGH + 1.0])


def _drained(diameter: float) -> Any:
    """A pocket with a drain hole near its foot, like a chamber with its inlet."""
    side = max(_DEEP, 2 * diameter)
    block = shapes.box([0.0, 0.0, 0.0], [side + 2 * _SOLID, side + 2 * _SOLID, side + 2 * _SOLID])
    block -= shapes.box([_SOLID] * 3, [side + _SOLID] * 3)
    hole = shapes.cylinder(diameter / 2, 0.0, _SOLID + 2.0, _FACETS).rotate([90.0, 0.0, 0.0])
    return block - hole.translate([side / 2 + _SOLID, _SOLID + 1.0, _SOLID + diameter / 2])


def _hole(diameter: float) -> Any:
    wall = shapes.box([0.0, 0.0, 0.0], [4 * diameter + _SOLID, 1.0, _HIGH])
    hole = shapes.cylinder(diameter / 2, -1.0, 3.0, _FACETS).rotate([90.0, 0.0, 0.0])
    return wall - hole.translate([2 * diameter + _SOLID / 2, 2.0, _HIGH / 2])


def _slope(angle_deg: float) -> Any:
    """A plate that leans out from a post at an angle from level."""
    rise = np.tan(np.radians(angle_deg)) * _DEEP
    plate = np.array([[0.0, 0.0], [_DEEP, rise], [_DEEP, rise + _SOLID], [0.0, _SOLID]])
    return _leaning(plate, float(plate[3, 1]))


def _ledge(length: float) -> Any:
    plate = np.array([[0.0, 0.0], [length, 0.0], [length, _SOLID / 2], [0.0, _SOLID / 2]])
    return _leaning(plate, _SOLID / 2)


def _leaning(section: Any, root: float) -> Any:
    """A section (n, 2) in mm of y and z, extruded from a post's side, some way above the foot."""
    from manifold3d import CrossSection, Manifold

    # Extruded along z, then turned so that it is along x.
    flat = Manifold.extrude(CrossSection([section]), _DEEP).rotate([90.0, 0.0, 90.0])
    post = shapes.box([0.0, -_SOLID, 0.0], [_DEEP, 0.0, _HIGH + root])
    return post + flat.translate([0.0, 0.0, _HIGH])


def _bridge(span: float) -> Any:
    solid = shapes.box([0.0, 0.0, _HIGH - _SOLID / 2], [_SOLID, span + 2 * _SOLID, _HIGH])
    for y in (0.0, span + _SOLID):
        solid += shapes.box([0.0, y, 0.0], [_SOLID, y + _SOLID, _HIGH])
    return solid


def _cup(volume_ml: float) -> Any:
    """A round cup of that volume, with depth equal to its width, open toward the platform, on three legs."""
    radius = (1000.0 * volume_ml / (2.0 * np.pi)) ** (1.0 / 3.0)
    deep, outside = 2.0 * radius, radius + _SOLID / 2
    cup = shapes.cylinder(outside, _LEG, _LEG + deep + _SOLID / 2, 2 * _FACETS)
    cup -= shapes.cylinder(radius, _LEG - 1.0, _LEG + deep, 2 * _FACETS)
    for turn in (90.0, 210.0, 330.0):
        at = (radius + _SOLID / 4) * np.array([np.cos(np.radians(turn)), np.sin(np.radians(turn))])
        leg = shapes.cylinder(_SOLID / 4, 0.0, _LEG + 1.0, _FACETS)
        cup += leg.translate([float(at[0]), float(at[1]), 0.0])
    return cup
