"""Co-design rules of a Monolithic Unit; a broken one is reported by name with a valid value."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NoReturn

import attrs

from ..errors import InputError
from .dimensions import Dimensions
from .lattice import graph_of
from .printed import as_printed

LEAST_STRUT_MM = 0.2
"""Least diameter of a strut at scale 1, that of `parameters.Envelope`."""


class RuleError(InputError):
    """A broken co-design rule; true_size: the same with lengths as they are at the unit's scale, or None.

    order: number of its group of rules; those of lower number hold. rule: its name.
    """

    true_size: RuleError | None = None
    order = 0
    rule = ""


def check(d: Dimensions, allow_symmetric: bool = False) -> None:
    """Raise InputError for the first co-design rule that the dimensions break.

    The message names the rule and a value that fits; lengths that scale are given in mm at scale 1.
    allow_symmetric: accept as many cells on -y as on +y.
    """
    try:
        _check(d, allow_symmetric)
    except RuleError as error:
        if d.scale != 1.0:
            try:
                # The same rule, since rules are about ratios, with lengths at the unit's scale.
                _check(attrs.evolve(d, scale=1.0), allow_symmetric)
            except RuleError as true:
                error.true_size = true
        raise


def _check(d: Dimensions, allow_symmetric: bool) -> None:
    groups: list[Callable[[Dimensions], None]] = [
        _node_apex_alignment,
        _profile,
        _symmetry,
        lambda d: _asymmetry(d, allow_symmetric),
        _wall,
        _ends,
        _struts,
        _waveguide,
    ]
    for order, group in enumerate(groups):
        try:
            group(d)
        except RuleError as error:
            error.order = order
            raise


def check_printed(d: Dimensions, offset_xy: float, offset_z: float) -> None:
    """Raise InputError where the printer's offsets in mm erase, fill or close a part of a unit that fits.

    The message names the largest share of both offsets that is possible.
    """
    broken = _printed_breach(d, offset_xy, offset_z)
    if broken is None:
        return
    rule, what = broken
    for share in range(100, -1, -1):
        xy, z = (math.trunc(10.0 * share * offset) / 1000.0 for offset in (offset_xy, offset_z))
        if _printed_breach(d, xy, z) is None:
            break
    _refuse(
        rule,
        f"offsets of {offset_xy:g} mm in the plane and {offset_z:g} mm along z {what}",
        "[print] offset_xy_mm, offset_z_mm",
        f"offset_xy_mm = {xy:g} with offset_z_mm = {z:g} fits this scale; or thicken or widen that part",
    )


def _printed_breach(d: Dimensions, offset_xy: float, offset_z: float) -> tuple[str, str] | None:
    """Rule and complaint of the first part that the offsets erase, fill or close."""
    least, most = min(offset_xy, offset_z), max(offset_xy, offset_z)
    thin, thick = _factors(d)
    thinnest = thin * min(d.junction_diameter, d.midspan_diameter)
    if thinnest + 2.0 * least <= 0.0:
        return "struts left when printed", f"leave no material of struts of {thinnest:.4g} mm"
    for part, thickness in {
        "walls": d.thinnest_wall,
        "end caps": min(d.base_cap, d.tip_cap),
        "the inlet's walls": d.inlet_wall,
        "the waveguide": d.waveguide_section - d.well_depth,
    }.items():
        if thickness + 2.0 * least <= 0.0:
            return "walls left when printed", f"leave no material of {part} of {thickness:.4g} mm"
    opening = d.kind.opening * d.cell
    if thick * d.midspan_diameter + 2.0 * most >= opening:
        return (
            "open cells when printed",
            f"fill the cell: struts of {thick * d.midspan_diameter:.4g} mm close openings of "
            f"{opening:.4g} mm",
        )
    if d.inlet_radius <= offset_xy:
        return "an open inlet when printed", f"close the inlet of {2.0 * d.inlet_radius:.4g} mm"
    if d.well_width <= 2.0 * offset_z:
        return "open wells when printed", f"close wells of {d.well_width:.4g} mm"
    p = as_printed(d, offset_xy, offset_z)
    if min(p.a, p.b) <= 0.0:
        return "bladder and neck when printed", "leave no necks between the bladders"
    if p.inlet_radius >= p.r - p.thickest_wall:
        return "a cavity when printed", f"close the necks, {2.0 * (d.r - d.thickest_wall):.4g} mm wide inside"
    if p.thickest_wall >= p.apex_curvature_radius:
        return "a cavity when printed", "fold the cavity at the apices"
    if max(p.base_cap, p.tip_cap) >= p.cell / 2.0:
        return "a cavity when printed", "fill an end chamber up to its apex"
    return None


def _refuse(rule: str, what: str, where: str, remedy: str) -> NoReturn:
    error = RuleError(f"{what} (rule: {rule})", where, remedy)
    error.rule = rule
    # Those of the printer's offsets come last.
    error.order = 99
    raise error


def _node_apex_alignment(d: Dimensions) -> None:
    if not math.isclose(d.R, d.cell, rel_tol=1e-9):
        s = d.scale
        _refuse(
            "node-apex alignment",
            f"the bladder diameter {2 * d.R / s:g} mm is not twice the cell, 2U = {2 * d.cell / s:g} mm, "
            "so the lattice nodes miss the bladder apices",
            "[chambers] bladder_diameter_mm",
            f"set bladder_diameter_mm = {2 * d.cell / s:g}, or cell_mm = {d.R / s:g}",
        )


def _profile(d: Dimensions) -> None:
    if d.r >= d.R:
        _refuse(
            "bladder and neck",
            f"the neck diameter {2 * d.r / d.scale:g} mm is not below the bladder's {2 * d.R / d.scale:g} mm",
            "[chambers] neck_diameter_mm",
            "a chamber narrows at its necks: choose a smaller neck",
        )


def _symmetry(d: Dimensions) -> None:
    if d.cells_x % 2 == 0:
        _refuse(
            "bending plane through cell centres",
            f"with {d.cells_x} cells across x the bending plane lies between two columns of nodes, "
            "and none of them meets the chambers",
            "[lattice] cells_x",
            f"choose an odd count: {d.cells_x - 1} or {d.cells_x + 1}",
        )
    if not d.kind.mirrors[0]:
        _refuse(
            "bending plane is a mirror plane of the lattice",
            f"a lattice of kind {d.kind.name!r} is not its own mirror image across x",
            "[lattice] kind",
            "choose a kind that is",
        )


def _asymmetry(d: Dimensions, allow_symmetric: bool) -> None:
    if d.cells_y_plus < d.cells_y_minus:
        _refuse(
            "lattice wider toward +y",
            f"{d.cells_y_minus} cells on -y and {d.cells_y_plus} on +y make the unit bend the other way",
            "[lattice] cells_y_plus",
            "+y is by definition the side with more lattice: exchange the two counts",
        )
    if d.cells_y_plus == d.cells_y_minus and not allow_symmetric:
        _refuse(
            "lattice wider toward +y",
            f"{d.cells_y_plus} cells on either side of the axis: such a unit extends and does not bend",
            "[lattice] cells_y_plus",
            f"set cells_y_plus = {d.cells_y_minus + 1}, or allow_symmetric = true if it is to extend",
        )


def _wall(d: Dimensions) -> None:
    s = d.scale
    limits = {
        "a cavity within every wall": (
            d.apex_curvature_radius,
            "the cavity closes at its widest places",
        ),
        "a bore through every neck": (d.r, "no bore is left through the necks"),
    }
    rule, (limit, why) = min(limits.items(), key=lambda item: item[1][0])
    if d.thickest_wall >= limit:
        fits = min(limit, d.r - d.inlet_radius) if d.inlet_radius < d.r else limit
        factor = d.thickest_wall / d.wall
        of = f", {factor:g} times wall_mm in its thickest chamber," if factor > 1.0 else ""
        _refuse(
            rule,
            f"a wall of {d.thickest_wall / s:g} mm{of} is too thick: {why}",
            "[chambers] wall_mm",
            f"the largest wall that fits is {_below(fits / s / factor):g} mm",
        )


def _ends(d: Dimensions) -> None:
    s, half = d.scale, d.cell / 2.0
    for cap, key in ((d.base_cap, "base_cap_mm"), (d.tip_cap, "tip_cap_mm")):
        if cap >= half:
            _refuse(
                "a cavity in every chamber",
                f"an end cap of {cap / s:g} mm fills its chamber up to the apex, at {half / s:g} mm",
                f"[chambers] {key}",
                f"the largest cap that fits is {_below(half / s):g} mm",
            )
    bore = d.r - float(d.wall_at(0.0)[0])
    if d.inlet_radius >= bore:
        _refuse(
            "inlet within the neck's bore",
            f"an inlet of {2 * d.inlet_radius / s:g} mm is wider than the cavity "
            f"there: its first neck is {2 * bore / s:.4g} mm wide inside",
            "[chambers] inlet_diameter_mm",
            f"the largest inlet that fits is {_below(2 * bore / s):g} mm",
        )
    if d.inlet_radius + d.inlet_wall > d.r * (1.0 + 1e-12):
        _refuse(
            "inlet boss on the base",
            f"the inlet boss is {2 * (d.inlet_radius + d.inlet_wall) / s:g} mm wide, "
            f"wider than the neck of {2 * d.r / s:g} mm it stands on",
            "[chambers] inlet_wall_mm",
            f"the largest inlet wall that fits is {_at_most((d.r - d.inlet_radius) / s):g} mm",
        )


def _struts(d: Dimensions) -> None:
    s = d.scale
    if d.junction_diameter > d.midspan_diameter:
        _refuse(
            "struts narrow at junctions",
            f"the struts are {d.junction_diameter / s:g} mm wide at the junctions "
            f"and {d.midspan_diameter / s:g} mm at mid-span",
            "[lattice] midspan_diameter_mm",
            f"choose at least {d.junction_diameter / s:g} mm at mid-span",
        )
    _grading(d)
    opening = d.kind.opening * d.cell
    if d.midspan_diameter >= opening:
        _refuse(
            "open cells",
            f"struts of {d.midspan_diameter / s:g} mm close the cell's openings, {opening / s:.4g} mm across",
            "[lattice] midspan_diameter_mm",
            f"the thickest strut that fits is {_below(opening / s):g} mm",
        )


def _grading(d: Dimensions) -> None:
    if d.grading is None:
        return
    if entry := d.grading.misplaced():
        _refuse(
            "graded cells within the lattice",
            f"the cells of {entry!r} lie outside the lattice",
            "[grading] cells",
            f"choose columns 0 to {d.grading.half_x}, rows {-d.grading.y_minus} to {d.grading.y_plus}, "
            f"chambers 1 to {d.grading.count}",
        )
    least, most = _factors(d)
    opening = d.kind.opening * d.cell
    if most * d.midspan_diameter >= opening:
        _refuse(
            "open cells",
            f"a factor of {most:.4g} makes struts {most * d.midspan_diameter / d.scale:.4g} mm wide, which "
            f"close the cell's openings, {opening / d.scale:.4g} mm across",
            "[grading] " + ", ".join(d.grading.grading.names),
            f"keep the product of the factors below {opening / d.midspan_diameter:.4g} everywhere",
        )
    if least * d.junction_diameter < LEAST_STRUT_MM * d.scale:
        _refuse(
            "struts of some thickness",
            f"a factor of {least:.4g} makes struts {least * d.junction_diameter / d.scale:.4g} mm wide",
            "[grading] " + ", ".join(d.grading.grading.names),
            "let the factors come to "
            f"{LEAST_STRUT_MM * d.scale / d.junction_diameter:.4g} at least everywhere",
        )


def _factors(d: Dimensions) -> tuple[float, float]:
    """Least and largest factor of the grading at the lattice's nodes; 1 and 1 without one."""
    if d.grading is None:
        return 1.0, 1.0
    found = d.grading.at(graph_of(d).nodes)
    return float(found.min()), float(found.max())


def _waveguide(d: Dimensions) -> None:
    half = d.waveguide_section / 2.0
    if d.row == 0 or not -d.cells_y_minus <= d.row <= d.cells_y_plus:
        rows = [j for j in range(-d.cells_y_minus, d.cells_y_plus + 1) if j]
        why = "runs through the cavity" if d.row == 0 else "lies outside the lattice"
        _refuse(
            "anchors are lattice nodes outside the cavity",
            f"anchor row {d.row} {why}",
            "[waveguide] row",
            f"choose one of {', '.join(map(str, rows))}",
        )
    if d.waveguide_section >= d.cell:
        _refuse(
            "waveguide inside the lattice",
            f"a waveguide section of {d.waveguide_section:g} mm fills the cell of {d.cell:g} mm",
            "[waveguide] section_mm",
            f"choose a section below {d.cell:g} mm",
        )
    if d.waveguide_end > d.cell / 2.0:
        _refuse(
            "waveguide inside the lattice",
            f"the waveguide ends {d.waveguide_end:g} mm beyond its last anchor, outside the lattice",
            "[waveguide] end_mm",
            f"the longest end that fits is {_at_most(d.cell / 2.0):g} mm at this scale",
        )
    if d.well_depth >= d.waveguide_section:
        _refuse(
            "wells within the waveguide",
            f"wells {d.well_depth:g} mm deep cut through a waveguide of {d.waveguide_section:g} mm",
            "[waveguide] well_depth_mm",
            f"choose a depth below {d.waveguide_section:g} mm",
        )
    if abs(d.row) * d.cell + half - d.well_depth < d.R:
        _refuse(
            "wells clear of the membrane",
            f"wells {d.well_depth:g} mm deep cut into the bladder apices beside row {d.row}",
            "[waveguide] well_depth_mm",
            f"choose a depth of at most {half:g} mm, or the next row outward",
        )
    if d.well_width >= d.well_pitch:
        _refuse(
            "separate wells",
            f"wells {d.well_width:g} mm wide at a pitch of {d.well_pitch:g} mm run into each other",
            "[waveguide] well_width_mm",
            f"choose a width below {d.well_pitch:g} mm",
        )
    if d.inclusion_radius >= d.cell / 2.0:
        _refuse(
            "inclusion within its cells",
            f"an inclusion of radius {d.inclusion_radius:g} mm is wider than the cell of {d.cell:g} mm",
            "[waveguide] inclusion_radius_mm",
            f"choose a radius below {d.cell / 2.0:g} mm",
        )


def _below(limit: float) -> float:
    """Largest length in whole micrometres strictly below the limit, in mm."""
    return (math.ceil(limit * 1000.0 - 1e-9) - 1) / 1000.0


def _at_most(limit: float) -> float:
    """Largest length in whole micrometres not above the limit, in mm."""
    return math.floor(limit * 1000.0 + 1e-9) / 1000.0
