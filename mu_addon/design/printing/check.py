"""Printability check of a triangle surface, with value, limit, place and source."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import attrs
import numpy as np

from ...arrays import Array
from ..anchors import Window
from ..dimensions import Dimensions
from ..lattice import graph_of
from ..parameters import Unit
from ..profile import outer_radius
from ..surface import UNITS, Triangles, Vertices, genus, stl_bytes, stl_surface, volume
from ..waveguide import waveguide
from . import faces
from .building import build_findings
from .chambers import chambers, distance_field
from .crossing import MOST_CROSSINGS, crossings
from .drainage import drainage_findings
from .finding import NOWHERE, Finding, Severity, at_least, clustered, judged, none_of
from .orientation import Build, fits, orientations
from .printer import Limit, Printer
from .thickness import cast_rays, samples
from .voxels import frame_along, voxel_rows
from .walls import chamber_walls, narrowest, thinnest

VOLUME_TOLERANCE = 0.02
"""Share of the volume by which facets may differ; a print offset taken off the drawing changes more."""


def against_nominal(
    vertices: Vertices, triangles: Triangles, nominal: tuple[Vertices, Triangles]
) -> list[Finding]:
    """Findings on missing or additional parts relative to the nominal solid; both closed surfaces in mm.

    Every strut of a lattice closes a tunnel, so that a part without it has a genus smaller by one, for any
    facets. The genus must be the same, else `error`; a volume that differs by more than VOLUME_TOLERANCE is a
    `warning`.
    """
    found, wanted = genus(vertices, triangles), genus(*nominal)
    limit = Limit(float(wanted), "the unit's own solid", False)
    what = f"the part has {found} tunnels (genus), the unit's own solid {wanted}" + _difference(
        found - wanted
    )
    remedy = "export the unit again, or give the --path of the part's waveguide"
    tunnels = judged("tunnels", found != wanted, "error", what, float(found), limit, remedy=remedy, unit="")
    ml, expected = volume(vertices, triangles) / 1e3, volume(*nominal) / 1e3
    share = ml / expected - 1.0
    limit = Limit(expected, f"the unit's own solid, within {VOLUME_TOLERANCE:.0%}", False)
    what = f"{ml:.4g} ml, {share:+.1%} against {expected:.4g} ml of the unit's own solid"
    remedy = "check whether the print offset was subtracted, or export the unit again"
    off = abs(share) > VOLUME_TOLERANCE
    size = judged("volume", off, "warning", what, ml, limit, remedy=remedy, unit="ml")
    return [tunnels, size]


def _difference(more: int) -> str:
    """Meaning of a different genus, as text."""
    if not more:
        return ""
    if more < 0:
        return f": {-more} less, as if struts were missing or openings closed"
    return f": {more} more, as if there were a hole or a strut too many"


FACETS = 0.002
"""Share of a chamber's radius by which facets may make its wall thinner than drawn."""
SPACING = 0.5
"""Distance in mm between the samples at which thickness and gaps are measured."""
STEP = 0.25
"""Cell in mm of the grid in which chambers and drains are sought, and of the layers' pictures."""
COARSE = 0.75
"""Cell in mm of the grid on which build directions are compared; finer where walls are thinner."""
MOST_CELLS = 4e8
"""Cells of a grid beyond which it is made coarser: an array of units, or a part far too large."""
STAGES = ("thickness", "chambers", "layers", "directions")
INCH = 25.4
SMALL_MM = 5.0
"""Largest extent of a part that is taken to be in another unit."""

Stage = Callable[[str], AbstractContextManager[Any]]


@attrs.frozen(eq=False)
class PrintCheck:
    """Result of a printability check: findings, figures by name with unit, build directions, best first."""

    findings: list[Finding]
    figures: dict[str, float]
    builds: list[Build]

    @property
    def worst(self) -> Severity:
        """The worst severity among the findings: `error`, `warning` or `pass`."""
        found = {f.severity for f in self.findings}
        return "error" if "error" in found else "warning" if "warning" in found else "pass"


def check(
    vertices: Vertices,
    triangles: Triangles,
    printer: Printer,
    unit: Unit | None = None,
    window: Window | None = None,
    direction: tuple[float, float, float] = (0.0, 0.0, 1.0),
    stages: Collection[str] = STAGES,
    stage: Stage = nullcontext,
    nominal: tuple[Vertices, Triangles] | None = None,
    share: Callable[[float], None] | None = None,
    in_body: bool = False,
) -> PrintCheck:
    """Printability check of a surface of vertices (n, 3) in mm and triangles (m, 3), as its STL is read back.

    unit, window: of the design, whose inlet, size, struts and wells are then checked too; direction: away
    from the platform. A surface that is not closed, inside out or of the wrong size is examined no further.
    `stages` may leave some out: layers need chambers, directions need chambers and thickness. stage: context
    that is entered, with its name, for each stage. nominal: surface of the unit's solid, for comparison with
    a surface from elsewhere. share: called with the share of build directions that are done. in_body: a
    user-defined body replaces the lattice's box, so that only the height of the drawing is known. Raises
    InputError for a window that does not fit the unit.
    """
    vertices, triangles = stl_surface(stl_bytes(vertices, triangles))
    up = np.asarray(direction, float) / np.linalg.norm(direction)
    with stage("faces"):
        found, triangles, sound = _faces(vertices, triangles)
    sized = _size(vertices, printer, unit, up, in_body)
    found += sized
    figures = {"triangles": float(len(triangles)), "volume_ml": volume(vertices, triangles) / 1e3}
    for axis, extent in zip("xyz", np.ptp(vertices, axis=0).tolist(), strict=True):
        figures[f"{axis}_mm"] = extent
    if unit is not None:
        found += _drawing(unit, window, printer)

    if not sound or any(f.severity == "error" for f in sized):
        return PrintCheck([*found, _unexamined(sound)], figures, [])

    from manifold3d import Error, Manifold, Mesh64

    solid = Manifold(Mesh64(vertices, triangles.astype(np.uint64)))
    if solid.status() != Error.NoError:
        return PrintCheck([*found, _unexamined(False)], figures, [])
    if nominal is not None:
        found += against_nominal(vertices, triangles, nominal)
    figures["volume_ml"] = solid.volume() / 1e3
    figures["mass_g"] = figures["volume_ml"] * printer["density_g_per_ml"]
    # Grids resolve no more than their cells: details simplified here are smaller than that.
    simple = solid.simplify(0.01).to_mesh64()
    seen = np.asarray(simple.vert_properties)[:, :3], np.asarray(simple.tri_verts).astype(np.int64)

    if "thickness" in stages:
        with stage("thickness and gaps"):
            surface = samples(vertices, triangles, SPACING)
            inward = cast_rays(solid, surface, -1, max(3.0, 2.0 * printer["wall_mm"]))
            outward = cast_rays(solid, surface, 1, 2.0 * printer["gap_mm"])
            found += [thinnest(surface, inward, printer), narrowest(surface, outward, printer)]
    if "chambers" in stages:
        with stage("chambers and drains"):
            step = _step(STEP, vertices)
            pockets = chambers(distance_field(voxel_rows(*seen, step)))
            found += drainage_findings(solid, pockets, unit, printer)
            figures["chamber_ml"] = sum(p.volume for p in pockets.found) / 1e3
            if "thickness" in stages:
                lit = pockets.hold(surface.points + step * surface.normals)
                other = pockets.hold(inward.at - step * surface.normals)
                found += chamber_walls(surface, inward, lit & ~other, printer, _facets_mm(unit, printer))
    if "layers" in stages:
        with stage("layers"):
            built = voxel_rows(*seen, _step(STEP, vertices), printer["layer_mm"], frame_along(up))
            more, ml = build_findings(built, pockets, printer)
            found += more
            figures |= ml
    builds: list[Build] = []
    if "directions" in stages:
        with stage("build directions"):
            coarse = _step(max(min(COARSE, 0.9 * float(inward.distance.min())), STEP), vertices)
            builds = orientations(
                *seen, surface, lit, coarse, printer["overhang_deg"], printer.room, up, share
            )
    return PrintCheck(found, figures, builds)


def _faces(vertices: Vertices, triangles: Triangles) -> tuple[list[Finding], Triangles, bool]:
    """Findings of the surface itself, its triangles without doubles and turned right, and if it is sound."""
    middles = vertices[triangles].mean(axis=1)
    twice = faces.doubled(triangles)
    words = ("triangle lies on another", "triangles lie on others")
    places = clustered(middles[twice])
    found = [none_of("doubled faces", int(twice.sum()), places, words, "remove one of each pair")]
    triangles, middles = triangles[~twice], middles[~twice]
    places, count = faces.open_places(vertices, triangles)
    words = ("edge is not shared by two triangles", "edges are not shared by two triangles")
    found.append(none_of("open edges", count, places, words, "close the holes"))
    over = faces.turned(vertices, triangles)
    words = ("triangle is flipped", "triangles are flipped")
    found.append(none_of("flipped faces", int(over.sum()), clustered(middles[over]), words, "flip them"))
    triangles = np.where(over[:, None], triangles[:, ::-1], triangles)
    cut = crossings(vertices, triangles)
    more = " or more" if len(cut) == MOST_CROSSINGS else ""
    words = ("edge passes through another triangle", f"edges{more} pass through other triangles")
    remedy = "unite the parts before export"
    found.append(none_of("self-intersection", len(cut), clustered(cut), words, remedy))
    if count:
        return found, triangles, False
    shells = faces.pieces(vertices, triangles)
    for name, group, words, remedy in (
        (
            "inside out",
            shells.inside_out,
            ("shell is inside out", "shells are inside out"),
            "flip all their triangles",
        ),
        (
            "loose pieces",
            shells.bodies[1:],
            ("piece is not connected to the part", "pieces are not connected to the part"),
            "join them to the part, or remove them",
        ),
        (
            "sealed voids",
            shells.voids,
            ("void traps resin permanently", "voids trap resin permanently"),
            "open them, or fill them",
        ),
        (
            "nested solids",
            shells.nested,
            ("solid lies within the solid", "solids lie within the solid"),
            "unite the parts before export",
        ),
    ):
        places = np.array([shell.centroid for shell in group]).reshape(-1, 3)
        found.append(none_of(name, len(group), places, words, remedy))
    return found, triangles, not shells.inside_out


def _size(vertices: Vertices, printer: Printer, unit: Unit | None, up: Array, in_body: bool) -> list[Finding]:
    """True if the part has its drawing's size and fits the printer."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    found = []
    if unit is not None:
        drawn = np.array(unit.dimensions.bounds)
        drawn[2, 0] -= unit.dimensions.inlet_length
        axes = slice(2, 3) if in_body else slice(None)
        ratio = float(np.linalg.norm((high - low)[axes]) / np.linalg.norm((drawn[:, 1] - drawn[:, 0])[axes]))
        # A waveguide's seats may reach a little beyond the drawing's box.
        same = abs(ratio - 1.0) < 0.02
        off = np.abs(np.stack([low - drawn[:, 0], high - drawn[:, 1]])).max(axis=1)
        known = {
            INCH: " (inches for mm)",
            1.0 / INCH: " (mm for inches)",
            10.0: " (cm for mm)",
            0.1: " (mm for cm)",
        }
        why = "".join(words for factor, words in known.items() if abs(ratio / factor - 1.0) < 0.02)
        sizes = " x ".join(f"{b - a:g}" for a, b in drawn[axes])
        limit = Limit(1.0, f"nominal {'height' if in_body else 'size'} of the unit, {sizes} mm", False)
        what = f"the part is {ratio:.4g} times its nominal size{why}"
        worst = np.stack([low, high])[np.argsort(-off)][:1]
        found.append(judged("scale", not same, "error", what, ratio, limit, worst, "export in mm", ""))
    return [*found, _room(vertices, printer, up)]


def _room(vertices: Vertices, printer: Printer, up: Array) -> Finding:
    """True if the part fits the build volume on its supports, as oriented or rotated about the direction."""
    extent = np.ptp(vertices @ frame_along(up).T, axis=0)
    room, limit = printer.room, printer.limits["build_x_mm"]
    straight, turned = _flat(extent, room), _flat(extent[[1, 0, 2]], room)
    share = max(extent[2] / room[2], min(straight, turned))
    tiny = float(extent.max()) < SMALL_MM
    bad = not fits(extent, room) or tiny
    what = (
        f"{extent[0]:.4g} x {extent[1]:.4g} x {extent[2]:.4g} mm as it stands, on "
        f"{printer['support_mm']:g} mm of supports and raft"
    )
    remedy = "turn the part, divide it, or check its scale" if bad else ""
    if not bad and straight > 1.0:
        what += f"; it fits {room[0]:g} x {room[1]:g} mm only if it is turned by 90 degrees on the platform"
        remedy = "turn the part by 90 degrees about the build direction"
    if tiny:
        units = {f: u for f, u in UNITS.items() if f * extent.max() >= SMALL_MM and fits(f * extent, room)}
        what += f"; the whole part is smaller than {SMALL_MM:g} mm"
        if units:
            what += f": the file may be in {' or '.join(units.values())}"
            remedy = f"scale it by {' or '.join(f'{factor:g}' for factor in units)}"
    elif bad and 3.0 < share < INCH:
        what += "; it would fit at 1/25.4 of its size: it may have been in mm and scaled as if in inches"
    return Finding(
        "build volume",
        "error" if bad else "pass",
        what,
        float(share),
        1.0,
        "of the room",
        0.5 * (vertices.min(axis=0) + vertices.max(axis=0))[None] if bad else NOWHERE,
        int(bad),
        f"{limit.source}; supports: {printer.limits['support_mm'].source}",
        limit.assumed or printer.limits["support_mm"].assumed,
        remedy,
    )


def _flat(extent: Array, room_mm: tuple[float, float, float]) -> float:
    return float(max(extent[0] / room_mm[0], extent[1] / room_mm[1]))


def _drawing(unit: Unit, window: Window | None, printer: Printer) -> list[Finding]:
    """Findings from the drawing's figures, with the print offsets of the unit."""
    d, printed = unit.dimensions, unit.printed
    strut, where, place = d.junction_diameter, "junctions", NOWHERE
    if d.grading is not None:
        strut, place = _thinnest_junctions(d)
        where = "thinnest junctions of the grading"
    found = [
        at_least(
            "thinnest strut",
            strut,
            printer,
            "strut_mm",
            f"struts of {strut:.3g} mm at the {where}; they scale with the unit down to "
            f"{unit.scale * printer['strut_mm'] / strut:.2f}x",
            "warning",
            place,
            remedy="keep the strut diameter constant below that scale, or print at a larger scale",
        )
    ]
    if window is not None:
        wells = np.array([well.corners.mean(axis=0) for well in waveguide(unit, window).wells])
        wells = wells.reshape(-1, 3)
        # `printed` thins wells by the offsets; depth stays, since face and ground move alike.
        found += [
            at_least(
                "well width",
                printed.well_width,
                printer,
                "well_width_mm",
                f"wells {printed.well_width:.3g} mm wide once printed ({d.well_width:.3g} mm drawn)",
                "error",
                wells,
                "widen the wells, or lower the offset",
            ),
            at_least(
                "well depth",
                printed.well_depth,
                printer,
                "well_depth_mm",
                f"wells {printed.well_depth:.3g} mm deep once printed ({d.well_depth:.3g} mm drawn)",
                "error",
                wells,
                "deepen the wells",
            ),
        ]
    return found


def _facets_mm(unit: Unit | None, printer: Printer) -> float:
    """Length in mm by which facets may make a unit's wall thinner than drawn; 0 where it is drawn too thin.

    Of 64 facets around, the least that a solid has, the middle of one is 0.0012 of the radius inside its
    edges; facets along the profile add to it.
    """
    if unit is None or unit.dimensions.thinnest_wall < printer["wall_mm"] * (1.0 - 1e-9):
        return 0.0
    return FACETS * unit.dimensions.R


def _thinnest_junctions(d: Dimensions) -> tuple[float, Array]:
    """Least diameter in mm of struts at nodes outside the actuator, and those nodes (n, 3) in mm."""
    nodes = graph_of(d).nodes
    nodes = nodes[np.hypot(nodes[:, 0], nodes[:, 1]) > outer_radius(d, nodes[:, 2])]
    diameters = d.junction_diameters(nodes)
    return float(diameters.min()), nodes[diameters <= diameters.min() * (1.0 + 1e-9)]


def _step(wanted: float, vertices: Vertices) -> float:
    """The wanted cell, or the least that keeps the grid's size in bounds."""
    return max(wanted, float((np.prod(np.ptp(vertices, axis=0)) / MOST_CELLS) ** (1.0 / 3.0)))


def _unexamined(sound: bool) -> Finding:
    what = "of the right size" if sound else "closed"
    return Finding(
        "not examined",
        "info",
        f"thickness, gaps, chambers and layers are measured once the surface is {what}",
        np.nan,
        remedy="correct the errors above and check again",
    )
