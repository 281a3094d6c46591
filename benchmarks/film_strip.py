"""The picture at the top of the README: a unit cut open at five pressures, with its bending angles.

    python -m benchmarks.film_strip out/mu-1.0x docs/pictures/film-strip.png --path alpha4

Takes the folder of a finished `simulate` or `place`. The printable solid is carried by the simulated motion
of Model A; a sensor path, by default the one that `place` chose, is drawn in orange.
"""

from __future__ import annotations

import json
import shutil
import tempfile
from itertools import pairwise
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.table import options_of
from mu_addon.design.anchors import anchor_points, window
from mu_addon.design.parameters import read_unit
from mu_addon.design.surface import stl_surface
from mu_addon.fem.bending_angle import bending_angle_deg
from mu_addon.report.motion_files import FOLDER, MODEL_A, read_motion
from mu_addon.report.render import Cut, Part, fit, render
from mu_addon.report.shapes import tube
from mu_addon.report.unit_pictures import MIRROR_PLANE, PATH_COLOR, unit_parts

PRESSURES_kPa = (-20, -10, 0, 20, 40)
FRAME = (340, 480)  # pixels
TEXT = 84
INK, FAINT, ACCENT = (28, 33, 43), (120, 128, 140), tuple(round(255 * c) for c in PATH_COLOR)


def main() -> None:
    parser = options_of(__doc__)
    parser.add_argument("run", type=Path, help="Folder of a finished `simulate` or `place`.")
    parser.add_argument("out", type=Path, help="PNG file to write.")
    parser.add_argument("--path", help="Name of the sensor path; by default the one that `place` chose.")
    options = parser.parse_args()
    frames, angles = pictures(options.run, options.path)
    strip(frames, angles).save(options.out, optimize=True)


def pictures(run: Path, name: str | None = None) -> tuple[list[np.ndarray], list[float]]:
    """A picture (h, w, 4) and the bending angle in degrees at each of the pressures."""
    unit = read_unit(run / "unit.toml")
    chosen = name or json.loads((run / "summary.json").read_text())["chosen"]
    line = anchor_points(unit)[list(window(unit, chosen).indices)]
    # A joint belongs to two of its pieces: it comes once.
    path = np.vstack([line[:1], *(np.linspace(a, b, 12)[1:] for a, b in pairwise(line))])
    vertices, triangles = stl_surface((run / "unit.stl").read_bytes())
    parts = unit_parts(unit.dimensions, vertices, triangles)
    with tempfile.TemporaryDirectory() as copy:  # an embedding is kept beside the motion it is of
        shutil.copytree(run / FOLDER, Path(copy) / FOLDER)
        motion = read_motion(Path(copy))
        states = [int(np.argmin(np.abs(motion.state_kPa - p))) for p in PRESSURES_kPa]
        body = motion.carried(MODEL_A, motion.embedding(vertices))
        bar = motion.carried(MODEL_A, motion.embedding(path))
    scenes = []
    for s in states:
        moved = [Part(vertices + body[s], part.faces, part.color) for part in parts]
        scenes.append([*moved, Part(*tube(path + bar[s], 1.1), PATH_COLOR, whole=True)])
    seen = [
        Part(np.minimum(part.vertices, [0.0, np.inf, np.inf]), part.faces)
        for scene in scenes
        for part in scene
    ]
    width, height = FRAME
    camera = fit(seen, (1.0, 0.22, 0.10), aspect=width / height, margin=0.02)
    cut = Cut(MIRROR_PLANE.point, MIRROR_PLANE.normal, MIRROR_PLANE.color)
    frames = [render(scene, camera, width, height, cut=cut, background=(1.0, 1.0, 1.0)) for scene in scenes]
    return frames, [bending_angle_deg(motion.mesh, motion.model_a[s]) for s in states]


def strip(frames: list[np.ndarray], angles: list[float]) -> Image.Image:
    """The frames side by side, each above its pressure and angle."""
    import matplotlib

    fonts = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    large = ImageFont.truetype(str(fonts / "DejaVuSans-Bold.ttf"), 27)
    small = ImageFont.truetype(str(fonts / "DejaVuSans.ttf"), 22)
    width, height = FRAME
    whole = Image.new("RGB", (width * len(frames), height + TEXT), "white")
    draw = ImageDraw.Draw(whole)
    for i, (frame, angle, pressure) in enumerate(zip(frames, angles, PRESSURES_kPa, strict=True)):
        whole.paste(Image.fromarray(frame[..., :3]), (i * width, 0))
        x = (i + 0.5) * width
        draw.text(
            (x, height + 8),
            f"{angle + 0.0:+.1f}°".replace("-", "−").replace("+0.0", "0"),
            ACCENT,
            large,
            "ma",
        )
        draw.text((x, height + 46), f"{pressure} kPa".replace("-", "−"), FAINT, small, "ma")
    return whole.quantize(144, dither=Image.Dither.NONE)


if __name__ == "__main__":
    main()
