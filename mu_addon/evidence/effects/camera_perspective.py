"""Camera perspective."""

import attrs
import numpy as np

from ..camera import View
from .declaration import BENCH, CYCLED, Declaration, Law, Parameter, Setting, Values

# Assumed distance of a camera, in unit lengths.
AWAY = 3.0
# What is nearer is larger, by this share at half a unit's length from the middle: of a camera that far away
# which is turned by 20 degrees, the sine over six half lengths.
KEYSTONE = 0.06
_SOURCE = (
    "a camera three unit lengths away, turned by 20 degrees; above 0 parts in that direction are farther"
)
# Laws of a camera at an angle, to first order: along the axis and across.
FIRST = tuple(Parameter(way, "", -KEYSTONE, KEYSTONE, 0.0, (0.01,), _SOURCE) for way in ("along", "across"))
# In full, tried where one of the others is found: it includes foreshortening, of second order in the angle.
WHOLE = (
    Parameter("view_deg", "deg", 0.0, 35.0, 0.0, (10.0,), "off the normal to the plane of bending"),
    Parameter(
        "farther_deg",
        "deg",
        -360.0,
        360.0,
        45.0,
        (-135.0, -45.0, 45.0, 135.0),
        "way in the picture that leads away from the camera, from across toward along the axis",
    ),
    Parameter("lengths_away", "", 1.5, 30.0, AWAY, (AWAY,), "cameras 10 cm to 2 m from a unit"),
)


def _oblique(view: View, v: Values, at: Setting) -> View:
    way = np.array([v.get("across", 0.0), v.get("along", 0.0)])
    return attrs.evolve(view, farther=way)


def _pinhole(view: View, v: Values, at: Setting) -> View:
    """Of a pinhole turned by an angle v toward a direction n: cos v along n, and sin v over its distance."""
    off, way = np.radians(v["view_deg"]), np.radians(v["farther_deg"])
    n = np.array([np.cos(way), np.sin(way)])
    return attrs.evolve(
        view,
        away=view.away + (np.cos(off) - 1.0) * np.outer(n, n),
        farther=view.farther + np.sin(off) / (2.0 * v["lengths_away"]) * n,
    )


EFFECT = Declaration(
    mechanism=(
        "the camera does not look at right angles to the plane of bending, so that nearer parts look larger"
    ),
    reveals="a square of known sides in the plane of bending; the camera from farther away",
    remedy="set the camera at right angles to the plane of bending",
    of=BENCH,
    instrument=True,
    camera=True,
    laws=(
        *(Law(CYCLED, (p,), {"view": _oblique}) for p in FIRST),
        Law(CYCLED, WHOLE, {"view": _pinhole}, refines=True),
    ),
)
