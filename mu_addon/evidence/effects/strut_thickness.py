"""Strut thickness."""

from .declaration import Declaration, Law, Parameter, Setting, Values

THICKER = Parameter(
    "thicker_mm", "mm", -0.4, 0.6, 0.0, (0.05,), "diameter less that drawn; printers are 0.05 to 0.2 mm off"
)


def _thicker(printed: tuple[float, float], v: Values, at: Setting) -> tuple[float, float]:
    offset, excess = printed
    # Both sides of a strut.
    return offset + 0.5 * v["thicker_mm"], excess


EFFECT = Declaration(
    mechanism="the struts of a specimen are not as thick as drawn, or not those that were drawn",
    reveals="struts of each specimen measured under a microscope, each specimen weighed",
    remedy="measure the struts of each specimen, and write one unit file for each design",
    differs=Law(("lattice_compression",), (THICKER,), {"printed": _thicker}),
)
