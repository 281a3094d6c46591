"""Frame compliance."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from .declaration import ALL, MACHINE, Array, Declaration, Law, Parameter, Setting, Values

FRAME = Parameter("mm_per_N", "mm/N", 0.0, 0.1, 0.0, (0.005,), "steel 1e-5, printed plates 0.1")
# A compliance that falls with the load: grips that settle, wedges that bite. Source of its form: a hyperbolic
# tangent, as the toe of such records has one scale of load.
SETTLING = (
    Parameter("settling_mm_N", "mm/N", 0.0, 5.0, 0.0, (0.01, 0.3), "at no load; printed plates 0.1"),
    Parameter(
        "settled_at", "", 0.005, 1.0, 0.1, (0.05, 0.3), "of the largest load, where grips have settled"
    ),
    Parameter("stays", "", 0.0, 1.0, 0.0, (0.0, 0.3), "share of that compliance that does not settle"),
)
Frame = tuple[float, Callable[[Array], Array]]
"""Strain that it takes a kPa at no load, and strain (n,) at stresses (n,) in kPa."""


def _linear(frame: Frame | None, v: Values, at: Setting) -> Frame:
    first = at.strain_per_kPa_mm_N * v["mm_per_N"]
    return first, lambda stress: first * stress


def _settling(frame: Frame | None, v: Values, at: Setting) -> Frame:
    first, stays = at.strain_per_kPa_mm_N * v["settling_mm_N"], v["stays"]
    load = v["settled_at"] * (at.largest_N or 1.0) * at.kPa_per_N

    def taken(stress: Array) -> Array:
        return first * (stays * stress + (1.0 - stays) * load * np.tanh(stress / load))

    return first, taken


def _clamp(beam: Mapping[str, Any], v: Values, at: Setting) -> Mapping[str, Any]:
    return {**beam, "give": v["mm_per_N"] / at.thickness_mm**2 * at.bending / at.length_mm}


EFFECT = Declaration(
    mechanism="the testing machine deforms",
    reveals="specimens of two sections, which load it by as much more",
    remedy="subtract the machine's compliance, found with a rigid block, or use an extensometer",
    shown_by={
        "beam_deadweight": "one load on beams of two lengths",
        "blocked_force": "a dead weight hung from the load cell, the deflection of its stand measured",
    },
    of=ALL,
    grips=True,
    laws=(
        Law(MACHINE, (FRAME,), {"frame": _linear}),
        Law(
            MACHINE,
            SETTLING,
            {"frame": _settling},
            "the testing machine and its grips deform, less the larger the load",
            refines=True,
        ),
        Law(
            ("beam_deadweight",),
            (FRAME,),
            {"beam": _clamp},
            "the clamp turns under the moment at the root, its jaws a thickness apart giving way",
        ),
        Law(
            ("blocked_force",),
            (
                Parameter(
                    "stand_mm_per_N", "mm/N", 0.0, 1.0, 0.0, (0.05,), "beams of load cells, printed stands"
                ),
            ),
            {"stand": lambda compliance, v, at: compliance + v["stand_mm_per_N"]},
        ),
    ),
)
