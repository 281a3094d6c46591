"""Square pictures of a study's results for a panel: few elements, large letters."""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...files import write_bytes
from ...report.charts import BY_LENGTH, MAP, QUIET, label, signed, styled
from ...report.results import Floats
from .motion_files import FOLDER

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ANGLE = "angle.png"
INCHES, DPI = 2.6, 200


def delta_name(path: str) -> str:
    """Name of the picture of a path's deviation."""
    return f"delta-{path}.png"


def write_angle(folder: Path, pressure_kPa: Floats, angle_deg: Floats) -> None:
    """Write the bending angle over the pressure, (s,) each, to `folder`/motion. Raises OutputError."""
    with _square(folder / FOLDER / ANGLE) as (_, axes):
        axes.axhline(0, color=QUIET, linewidth=0.8)
        axes.axvline(0, color=QUIET, linewidth=0.8)
        axes.plot(pressure_kPa, angle_deg, "-o", color=BY_LENGTH[0], markersize=4, linewidth=2)
        axes.set(xlabel="pressure [kPa]", title="bending angle [deg]")
        for i, aside in ((angle_deg.argmin(), 10), (angle_deg.argmax(), -10)):
            axes.annotate(
                signed(f"{angle_deg[i]:.1f}°"),
                (pressure_kPa[i], angle_deg[i]),
                (aside, 0),
                textcoords="offset points",
                ha="left" if aside > 0 else "right",
                va="center",
                fontsize=10,
            )


def write_delta(folder: Path, path: str, delta_mm: Floats, time_s: Floats, top_mm: float) -> None:
    """Write a path's deviation (k, j), colours from 0 to `top_mm`, to `folder`/motion. Raises OutputError."""
    from matplotlib.colors import PowerNorm

    with _square(folder / FOLDER / delta_name(path)) as (figure, axes):
        image = axes.imshow(
            delta_mm,
            origin="lower",
            extent=(0, 100, float(time_s[0]), float(time_s[-1])),
            aspect="auto",
            cmap=MAP,
            norm=PowerNorm(0.5, 0.0, top_mm),
            interpolation="nearest",
        )
        axes.grid(False)
        axes.set(xlabel="length [%]", ylabel="time [s]", title=f"{label(path)}: deviation [mm]")
        axes.set_xticks((0, 50, 100))
        bar = figure.colorbar(image, ax=axes, fraction=0.07, pad=0.04)
        bar.ax.tick_params(labelsize=8, length=2)
        bar.outline.set_linewidth(0.6)


@contextmanager
def _square(path: Path) -> Iterator[tuple[Figure, Axes]]:
    """A figure and its axes, written as PNG once the body has drawn it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with styled(INCHES, INCHES) as figure:
        FigureCanvasAgg(figure)
        figure.set_layout_engine("constrained")
        axes: Any = figure.subplots()
        yield figure, axes
        stream = io.BytesIO()
        figure.savefig(stream, format="png", dpi=DPI, facecolor="white", metadata={"Software": None})
    write_bytes(path, stream.getvalue())
