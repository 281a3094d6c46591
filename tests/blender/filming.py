"""A bench video of known motion: four markers, two on a clamp and two on the tip of a bending arc."""

import numpy as np
from PIL import Image

from tests.measured.test_video import arc, picture

SIZE = 360, 340
MM_PER_PIXEL = 0.3
FINE = 6
"""Samples along each side of a pixel."""
REACH = 16
TURN = np.linspace(0.0, 2 * np.pi, 38)
# Three frames of rest, then a swing to either side, by up to 8 degrees a frame.
ANGLES = np.concatenate([[0.0, 0.0], 40.0 * np.sin(TURN) - 10.0 * (1.0 - np.cos(TURN))])


def film(folder, angles_deg, marks="crosses", noise=0.012, seed=1, hidden=()):
    """Write frame 1 .. n as PNG; returns pixels (4, n, 2) of the markers' true middles, right and down.

    hidden: pairs (marker, frame) at which something covers a marker.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    angles = np.asarray(angles_deg, float)
    truth = picture(arc(angles), mm_per_pixel=MM_PER_PIXEL, at=(180.0, 40.0))[:4]
    coarse = rng.normal(size=(SIZE[1] // 8, SIZE[0] // 8)).astype(np.float32)
    backdrop = 0.6 + 0.03 * np.array(Image.fromarray(coarse).resize(SIZE, Image.Resampling.BICUBIC))
    for frame, angle in enumerate(angles):
        shot = backdrop.copy()
        for marker, middle in enumerate(truth[:, frame]):
            if (marker, frame) not in hidden:
                # Toward +y is to the left here, where the unit hangs before a camera at +x.
                _stamp(shot, middle, np.radians(angle) * (marker > 1), marks)
        shot += noise * rng.normal(size=shot.shape)
        grey = (255 * np.clip(shot, 0, 1)).round().astype(np.uint8)
        Image.fromarray(grey).convert("RGB").save(folder / f"shot{frame + 1:04d}.png")
    return truth


def _stamp(shot, middle, turn, marks):
    """Draw one marker into the picture, averaged over each pixel's area."""
    left, top = (int(v) - REACH for v in middle)
    fine = (np.arange(2 * REACH * FINE) + 0.5) / FINE
    right, down = np.meshgrid(left + fine - middle[0], top + fine - middle[1])
    far = np.hypot(right, down)
    patch = shot[top : top + 2 * REACH, left : left + 2 * REACH]
    shown = np.repeat(np.repeat(patch, FINE, axis=0), FINE, axis=1)
    if marks == "dots":
        shown[far < 7.5] = 0.1
        shown[far < 3.0] = 0.9
    else:
        along = np.cos(turn) * right + np.sin(turn) * down
        across = -np.sin(turn) * right + np.cos(turn) * down
        shown[far < 9.0] = np.where(along * across > 0, 0.08, 0.95)[far < 9.0]
    patch[:] = shown.reshape(2 * REACH, FINE, 2 * REACH, FINE).mean(axis=(1, 3))


def described(folder, truth, marks="crosses", **extra):
    """bench.toml and pressure.csv beside the pictures: 10 frames a second, 2 degrees a kPa."""
    lines = ['camera = "+x"', 'base = ["base a", "base b"]', 'tip = ["tip a", "tip b"]', "fps = 10"]
    lines += [f'marks = "{marks}"', *(f"{key} = {value}" for key, value in extra.items())]
    lines += ["", "[experiment]", 'name = "filmed"', 'specimen = "A"']
    places = {"base a": (-15.0, 0.0), "base b": (15.0, 0.0)}
    for name, at in zip(("base a", "base b", "tip a", "tip b"), truth[:, 0], strict=True):
        # As a user reads it off the screen.
        lines += ["", "[[marker]]", f'name = "{name}"', f"pixel = [{at[0]:.0f}, {at[1]:.0f}]"]
        if name in places:
            lines.append(f"place_mm = [{places[name][0]}, {places[name][1]}]")
    (folder / "bench.toml").write_text("\n".join(lines) + "\n")


def pressures(folder, angles_deg):
    """The record of a pressure that bends the arc so, 2 degrees a kPa."""
    rows = [f"{k / 10},{angle / 2}" for k, angle in enumerate(angles_deg)]
    (folder / "pressure.csv").write_text("\n".join(["time_s,pressure_kPa", *rows]) + "\n")
