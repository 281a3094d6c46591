"""The charts of a report as SVG text: narrow enough for a phone, distinguishable without colour."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from .results import Floats, Path, RankingResult, SideView

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# Okabe and Ito's palette: distinguishable with any kind of colour vision.
CHOSEN = "#D55E00"
BY_LENGTH = ("#0072B2", "#009E73", "#CC79A7", "#56B4E9")
BY_START = ("-", "--", ":", "-.")
INK, QUIET, GRID = "#222222", "#8A8F98", "#E3E6EA"
WIDTH = 4.0  # inches: at a phone's width the text is still 10 pixels high

_STYLE: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": QUIET,
    "axes.grid": True,
    "axes.labelcolor": INK,
    "axes.labelsize": 9,
    "axes.linewidth": 0.8,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "axes.titlesize": 9,
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "grid.color": GRID,
    "grid.linewidth": 0.8,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "svg.fonttype": "path",
    "svg.hashsalt": "mu_addon",  # equal data make equal bytes
    "xtick.color": QUIET,
    "xtick.labelcolor": INK,
    "xtick.labelsize": 8,
    "ytick.color": QUIET,
    "ytick.labelcolor": INK,
    "ytick.labelsize": 8,
}


def label(name: str) -> str:
    """A path's name as text: alpha10 as "α10" with a lowered number; other names unchanged."""
    match = re.fullmatch(r"alpha(\d+)", name)
    if match is None:
        return name
    return "α" + match[1].translate(str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉"))


def signed(text: str) -> str:
    """The text with true minus signs in front of numbers, and none in front of zero."""
    text = re.sub(r"(?<![\w-])-(?=0(?:\.0+)?(?![\d.]))", "", text)
    return re.sub(r"(?<![\w-])-(?=[\d.])", "−", text)


def line_style(path: Path) -> dict[str, Any]:
    """matplotlib's colour by a path's length and dashes by its start.

    Every window of six anchors has another combination.
    """
    return {
        "color": BY_LENGTH[(path.length - 3) % len(BY_LENGTH)],
        "linestyle": BY_START[(path.start - 1) % len(BY_START)],
    }


def unit_with_paths(view: SideView, paths: Sequence[Path], chosen: str, means: Sequence[str] = ()) -> str:
    """SVG of the unit's section and, next to it, each path as a line between the heights of its anchors.

    chosen: name of the path drawn in colour; means: mean deviations in mm as text, written below the lines.
    """
    left, right, bottom, top = view.extent
    width, wide = 4.2, 1.85  # inches, of which the section's
    high = wide * (top - bottom) / (right - left)
    whole = high + 0.35  # a line below for the scale bar
    with canvas(width, whole) as (figure, svg):
        below, height = 0.30 / whole, high / whole
        picture = figure.add_axes((0.0, below, wide / width, height))
        picture.imshow(view.image, extent=view.extent, interpolation="lanczos", aspect="auto")
        picture.axis("off")
        middle = 0.5 * (left + right)
        _scale_bar(picture, middle, bottom - 0.06 * (top - bottom), 10.0 * round((right - left) / 30.0))
        lanes = figure.add_axes((wide / width, below, 1.0 - wide / width, height))
        lanes.set(xlim=(-1.7, len(paths) - 0.4), ylim=(bottom, top))
        lanes.axis("off")
        for number, z in enumerate(view.anchors[:, 1], 1):
            lanes.plot([-0.75, len(paths) - 0.4], [z, z], color=GRID, linewidth=0.8, zorder=0)
            lanes.text(-0.85, z, f"P{number}", ha="right", va="center", fontsize=8, fontweight="bold")
        for x, path in enumerate(paths):
            z = view.anchors[path.start - 1 : path.start - 1 + path.length, 1]
            best = path.name == chosen
            lanes.plot(
                [x] * len(z),
                z,
                color=CHOSEN if best else QUIET,
                linewidth=5 if best else 2.5,
                marker="o",
                markersize=8 if best else 4.5,
                solid_capstyle="round",
            )
            words: Any = {
                "color": CHOSEN if best else INK,
                "fontweight": "bold" if best else "normal",
                "textcoords": "offset points",
                "ha": "center",
            }
            lanes.annotate(label(path.name), (x, z[-1]), (0, 7), fontsize=8, **words)
            if means:
                lanes.annotate(means[x], (x, z[0]), (0, -8), va="top", rotation=90, fontsize=7.5, **words)
    return svg()


def _scale_bar(axes: Any, middle: float, z: float, length: float) -> None:
    """A bar of `length` mm below the section."""
    ends = [middle - 0.5 * length, middle + 0.5 * length]
    axes.plot(ends, [z, z], color=INK, linewidth=1.6, solid_capstyle="butt", clip_on=False)
    axes.annotate(
        f"{length:g} mm",
        (middle, z),
        (0, -3),
        textcoords="offset points",
        ha="center",
        va="top",
        fontsize=7.5,
    )


def angle_against_pressure(pressure_kPa: Floats, angle_deg: Floats) -> str:
    """SVG of the bending angle (k,) in degrees against pressure (k,) in kPa, in the order of computation.

    The angles at the lowest and at the highest pressure are labelled.
    """
    with canvas(WIDTH, 3.1) as (figure, svg):
        axes = figure.add_axes((0.14, 0.16, 0.82, 0.78))
        axes.axhline(0, color=QUIET, linewidth=0.8)
        axes.axvline(0, color=QUIET, linewidth=0.8)
        axes.plot(pressure_kPa, angle_deg, "-o", color=BY_LENGTH[0], markersize=3.5, linewidth=1.6)
        for i, aside in ((int(np.argmin(pressure_kPa)), 8), (int(np.argmax(pressure_kPa)), -8)):
            axes.annotate(
                signed(f"{angle_deg[i]:.1f}° at {pressure_kPa[i]:g} kPa"),
                (pressure_kPa[i], angle_deg[i]),
                (aside, 0),
                textcoords="offset points",
                ha="left" if aside > 0 else "right",
                va="center",
                fontsize=8,
            )
        axes.set(xlabel="pressure [kPa]", ylabel="bending angle [deg]")
    return svg()


def contact_force(time_s: Floats, normal_N: Floats, friction_N: Floats) -> str:
    """SVG of the sizes of a contact's normal (k,) and friction force (k,) in N over time (k,) in s."""
    with canvas(WIDTH, 2.6) as (figure, svg):
        axes = figure.add_axes((0.14, 0.19, 0.82, 0.74))
        for values, color, style, name in (
            (normal_N, BY_LENGTH[0], "-o", "normal"),
            (friction_N, INK, "--", "friction"),
        ):
            axes.plot(time_s, values, style, color=color, markersize=3.5, linewidth=1.6, label=name)
        axes.legend(frameon=False, fontsize=8, loc="upper left")
        axes.set(xlabel="time [s]", ylabel="force [N]")
        axes.set_ylim(bottom=0)
    return svg()


def protocol(time_s: Floats, pressure_kPa: Floats) -> str:
    """SVG of pressure (k,) in kPa against time (k,) in s."""
    with canvas(WIDTH, 2.3) as (figure, svg):
        axes = figure.add_axes((0.14, 0.21, 0.82, 0.72))
        axes.axhline(0, color=QUIET, linewidth=0.8)
        axes.plot(time_s, pressure_kPa, "-", color=INK, linewidth=1.6)
        axes.plot(time_s, pressure_kPa, "o", color=BY_LENGTH[0], markersize=3)
        axes.set(xlabel="time [s]", ylabel="pressure [kPa]")
    return svg()


def marginal(values: Floats, paths: Sequence[Path], chosen: str, along: str) -> str:
    """SVG of one line for each path of mean deviations (paths, n) in mm, over 0 to 100 % of length or time.

    chosen: name of the path drawn bold; along: "length" or "time", for the axis.
    """
    with canvas(WIDTH, 3.3) as (figure, svg):
        axes = figure.add_axes((0.14, 0.14, 0.66, 0.82))
        percent = np.linspace(0.0, 100.0, values.shape[1])
        for path, row in zip(paths, values, strict=True):
            best = path.name == chosen
            style = {"color": CHOSEN, "linewidth": 3.0, "zorder": 3} if best else line_style(path)
            axes.plot(percent, row, **{"linewidth": 1.4, **style}, label=label(path.name))
        axes.set(xlim=(0, 100), ylim=(0, None), xticks=(0, 25, 50, 75, 100))
        axes.set(xlabel=f"{along} [%]", ylabel="mean deviation [mm]")
        # The legend in the order of the lines, highest first.
        handles, labels = axes.get_legend_handles_labels()
        order = np.argsort(-values.mean(axis=1), kind="stable")
        axes.legend(
            [handles[i] for i in order],
            [labels[i] for i in order],
            loc="upper left",
            bbox_to_anchor=(1.01, 1.02),
            handlelength=2.2,
            labelspacing=0.7,
        )
    return svg()


def ranking(result: RankingResult, paths: Sequence[Path]) -> str:
    """SVG of J_hat in mm of every path as a bar, best first.

    The chosen path is coloured, paths tied with it are hatched; error bars give the mesh uncertainty. Paths
    that were not solved have a pale bar of their lower bound.
    """
    order = np.argsort(np.asarray(result.rank), kind="stable")
    bounds = sorted(result.at_least_mm.items(), key=lambda one: one[1])
    names = [*(paths[i].name for i in order), *(name for name, _ in bounds)]
    solved = np.asarray(result.j_hat)[order]
    values = np.append(solved, [bound for _, bound in bounds])
    with canvas(WIDTH, 0.6 + 0.27 * len(names)) as (figure, svg):
        high = 0.6 + 0.27 * len(names)
        axes = figure.add_axes((0.11, 0.45 / high, 0.85, 1.0 - 0.5 / high))
        rows = np.arange(len(names))
        bars = axes.barh(rows, values, height=0.68, color="#B9C3CF")
        for bar, name in zip(bars, names, strict=True):
            if name == result.chosen:
                bar.set_color(CHOSEN)
            elif name in result.tied:
                bar.set(facecolor="#F3C9A8", edgecolor=CHOSEN, hatch="///", linewidth=0.0)
            elif name in result.at_least_mm:
                bar.set(facecolor="#E9EDF1")
        if result.uncertainty_mm is not None:
            style: Any = {"fmt": "none", "ecolor": INK, "elinewidth": 1, "capsize": 2}
            axes.errorbar(solved, rows[: len(solved)], xerr=result.uncertainty_mm, **style)
        clear = (result.uncertainty_mm or 0.0) + 0.015 * values.max()
        for row, value in zip(rows, values, strict=True):
            text = f"{value:.3f}" if row < len(solved) else f"≥ {value:.3f}"
            axes.text(value + clear, row, text, va="center", fontsize=8, color=INK)
        axes.set_yticks(rows, [label(name) for name in names], fontsize=9)
        axes.tick_params(axis="y", length=0)
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set(xlim=(0, values.max() + clear + 0.13 * values.max()), xlabel="mean deviation Ĵ [mm]")
    return svg()


def seconds(stages: Mapping[str, float]) -> str:
    """SVG of the duration of each stage in s, in the order in which they ran."""
    names, values = list(stages), np.array(list(stages.values()))
    high = 0.55 + 0.24 * len(names)
    with canvas(WIDTH, high) as (figure, svg):
        left = (0.15 + 0.075 * max(map(len, names))) / WIDTH
        axes = figure.add_axes((left, 0.42 / high, 0.92 - left, 1.0 - 0.47 / high))
        rows = np.arange(len(names))
        axes.barh(rows, values, height=0.66, color="#B9C3CF")
        for row, value in zip(rows, values, strict=True):
            axes.text(value + 0.02 * values.max(), row, f"{value:.1f}", va="center", fontsize=8)
        axes.set_yticks(rows, names)
        axes.tick_params(axis="y", length=0)
        axes.invert_yaxis()
        axes.grid(False, axis="y")
        axes.set(xlim=(0, 1.15 * values.max()), xlabel="seconds")
    return svg()


@contextmanager
def canvas(width: float, height: float) -> Iterator[tuple[Figure, Callable[[], str]]]:
    """Context with a figure, sizes in inches, and a function that returns its SVG text after the context."""
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    stream = io.StringIO()

    def svg() -> str:
        # Without the prolog, which names a DTD on the network.
        text = stream.getvalue()
        return text[text.index("<svg") :]

    with styled(width, height) as figure:
        FigureCanvasSVG(figure)
        yield figure, svg
        figure.savefig(stream, format="svg", metadata={"Date": None, "Creator": None}, transparent=True)


@contextmanager
def styled(width: float, height: float) -> Iterator[Figure]:
    """Context with a figure, sizes in inches, in the style of all charts; it must be saved within."""
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(_STYLE):
        yield Figure(figsize=(width, height))
