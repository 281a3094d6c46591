"""Pictures and charts of a grasp: the printed part, frames of the phases, forces, light, shapes."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ..arrays import Array
from ..design.gripper import ROOT, Gripper, GripperSolid
from ..grasp import Grasp
from ..meshing.mesh import Mesh
from . import plots
from .render import Cut, Part, framed, png, render
from .results import Picture
from .shapes import box
from .unit_pictures import COLORS, WHITE, skins_of, unit_parts

PLATE_COLOR = (0.50, 0.55, 0.60)
CUBE_COLOR = (0.0, 0.45, 0.70)  # plots.BY_LENGTH[0]
# The gripper hangs: its tips, along +z, are down.
HANGING = (0.0, 0.0, -1.0)
OF_CUBE = (plots.BY_LENGTH[0], plots.CHOSEN, *plots.BY_LENGTH[1:])


def part_picture(gripper: Gripper, solid: GripperSolid, width: int = 1000) -> Picture:
    """The printable part, hanging, its near half cut away along the fingers' bending plane."""
    vertices, triangles = solid.vertices, solid.triangles
    # Each vertex in the frame of the finger on its side of the middle plane.
    (_, shift), (turned, turned_shift) = gripper.placements
    right = (vertices[:, 1] > 0)[:, None]
    local = np.where(right, (vertices - turned_shift) @ turned, vertices - shift)
    plate = (vertices[triangles][:, :, 2] <= ROOT + 1e-6).all(axis=1)
    fingers = unit_parts(gripper.unit.dimensions, local, triangles[~plate])
    parts = [Part(vertices, part.faces, part.color) for part in fingers]
    parts.append(Part(vertices, triangles[plate], PLATE_COLOR))
    cut = Cut((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), color=(0.95, 0.86, 0.72))
    camera, aspect = framed(parts, (1.0, 0.28, -0.35), HANGING, margin=0.02)
    image = render(parts, camera, width, round(width / aspect), cut=cut, background=WHITE)
    caption = "The printable part cut open, as it hangs: two units on their plate, tips down."
    return Picture(png(image), caption, "Two units hanging from a base plate, their lattice sides inward")


def frames(gripper: Gripper, mesh: Mesh, found: Grasp, width: int = 420) -> list[Picture]:
    """One picture a phase, all to one scale, of fingers cut open along their bending plane and the cube."""
    moments = {
        "i": (found.end("i"), "i, open"),
        "ii": (_first_touch(found), "ii, first touch"),
        "iii": (found.end("iii"), "iii, hold"),
        "iv": (found.end("iv"), "iv, lifted" if found.lift.held else "iv, not lifted"),
        "v": (_opened(found), "v, released"),
    }
    skins, colors = skins_of(mesh), COLORS
    x, y = (extent / 2.0 for extent in gripper.size_mm)
    half = found.cube.side_mm / 2.0
    scenes = []
    for number, _ in moments.values():
        # A half mesh lies at x >= 0; its mirror image shows the same section to a viewer at +x.
        left = (mesh.nodes + found.u[number]) * [-1.0, 1.0, 1.0] + gripper.placements[0][1]
        right = left * [1.0, -1.0, 1.0]
        parts = [Part(left, faces[:, ::-1], colors[region]) for region, faces in skins.items()]
        parts += [Part(right, faces, colors[region]) for region, faces in skins.items()]
        parts.append(Part(*box([-x, -y, -gripper.plate.thickness_mm], [0.0, y, 0.0]), PLATE_COLOR))
        middle = found.cube_mm[number] + gripper.placements[0][1]
        parts.append(Part(*box(middle - half, middle + half), CUBE_COLOR))
        scenes.append(parts)
    camera, aspect = framed(
        [part for scene in scenes for part in scene], (1.0, 0.16, -0.12), HANGING, margin=0.02
    )
    pictures = []
    for scene, (number, words) in zip(scenes, moments.values(), strict=True):
        image = render(scene, camera, width, round(width / aspect), background=WHITE)
        caption = f"{words}: {found.pressure_kPa[number]:g} kPa, {found.angle_deg[number]:.1f}°"
        alt = f"Two fingers and a cube of {found.cube.side_mm:g} mm, phase {words}"
        pictures.append(Picture(png(image), caption, alt))
    return pictures


def _first_touch(found: Grasp) -> int:
    touching = np.flatnonzero(found.area_mm2 > 0)
    return int(touching[0]) if len(touching) else found.end("ii")


def _opened(found: Grasp) -> int:
    """Instant of least pressure in the last phase."""
    own = [i for i, name in enumerate(found.phase) if name == "v"]
    return min(own, key=lambda i: found.pressure_kPa[i])


def over_time(grasps: Mapping[float, Grasp], values: Mapping[float, Array], label: str) -> str:
    """A line a cube against time, phases marked above, as SVG text."""
    with plots.canvas(plots.WIDTH, 2.7) as (figure, svg):
        axes = figure.add_axes((0.15, 0.17, 0.81, 0.70))
        first = next(iter(grasps.values()))
        axes.axhline(0, color=plots.QUIET, linewidth=0.8)
        for name in dict.fromkeys(first.phase):
            own = [i for i, phase in enumerate(first.phase) if phase == name]
            start, end = first.time_s[max(0, own[0] - 1)], first.time_s[own[-1]]
            axes.axvline(end, color=plots.GRID, linewidth=1.2)
            axes.text(
                (start + end) / 2, 1.02, name, transform=axes.get_xaxis_transform(), ha="center", fontsize=8
            )
        for color, style, (side, found) in zip(OF_CUBE, ("-", "--", ":"), grasps.items(), strict=False):
            axes.plot(found.time_s, values[side], style, color=color, linewidth=1.8, label=f"{side:g} mm")
        axes.set(xlabel="time [s]", ylabel=label, xlim=(first.time_s[0], first.time_s[-1]))
        axes.legend(loc="best")
    return svg()


def pulling(grasps: Mapping[float, Grasp]) -> str:
    """Force by friction against the gripper's rise, with each cube's weight, as SVG text."""
    with plots.canvas(plots.WIDTH, 2.7) as (figure, svg):
        axes = figure.add_axes((0.15, 0.17, 0.81, 0.78))
        axes.axhline(0, color=plots.QUIET, linewidth=0.8)
        for color, style, (side, found) in zip(OF_CUBE, ("-", "--", ":"), grasps.items(), strict=False):
            lift = found.lift
            axes.plot(lift.pull_mm, lift.pull_N, style, color=color, linewidth=1.8, label=f"{side:g} mm")
            if lift.held:
                axes.plot([lift.sag_mm], [lift.weight_N], "o", color=color, markersize=6)
            axes.axhline(lift.weight_N, color=color, linewidth=0.7, linestyle=style)
        axes.set(xlabel="rise of the gripper with the cube at rest [mm]", ylabel="carried by friction [N]")
        axes.legend(loc="lower right")
    return svg()


def shapes(gripper: Gripper, grasps: Mapping[float, Grasp]) -> str:
    """Backbones of both fingers at rest, opened and at the plateau, with the cubes' outlines, as SVG text."""
    with plots.canvas(plots.WIDTH, 3.6) as (figure, svg):
        axes = figure.add_axes((0.13, 0.13, 0.84, 0.83))
        shift = gripper.placements[0][1]
        first = next(iter(grasps.values()))
        lines = [(first.backbone[0], plots.QUIET, "-", "at rest")]
        lines.append((first.backbone[first.end("i")], plots.QUIET, ":", "opened"))
        for color, style, (side, found) in zip(OF_CUBE, ("-", "--", ":"), grasps.items(), strict=False):
            lines.append((found.backbone[found.end("iii")], color, style, f"holds {side:g} mm"))
            middle, half = found.cube_mm[found.end("iii")] + shift, side / 2.0
            y, z = (
                middle[1] + half * np.array([-1, 1, 1, -1, -1]),
                middle[2] + half * np.array([-1, -1, 1, 1, -1]),
            )
            axes.plot(y, z, style, color=color, linewidth=0.9)
        for points, color, style, words in lines:
            at = points + shift
            axes.plot(
                at[:, 1], at[:, 2], style, color=color, linewidth=1.8, marker="o", markersize=3, label=words
            )
            axes.plot(-at[:, 1], at[:, 2], style, color=color, linewidth=1.8, marker="o", markersize=3)
        axes.set_aspect("equal", adjustable="datalim")
        axes.invert_yaxis()
        axes.set(xlabel="y [mm]", ylabel="z, down [mm]")
        axes.legend(loc="upper center", fontsize=7)
    return svg()
