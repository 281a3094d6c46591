"""Charts of coupons and of the laws fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ..materials.coupon import Coupon, binned
from ..materials.fit import Fit
from .plots import BY_LENGTH, CHOSEN, INK, QUIET, WIDTH, canvas

# Told apart without colour by dashes, and drawn in this order.
STYLES: tuple[tuple[str, Any], ...] = (
    (BY_LENGTH[0], (0, (6, 2))),
    (BY_LENGTH[1], (0, (1, 1.2))),
    (BY_LENGTH[2], (0, (5, 1.5, 1, 1.5))),
    (BY_LENGTH[3], (0, (3, 1.2))),
    (QUIET, (0, (8, 2, 1, 2, 1, 2))),
    (INK, (0, (1, 3))),
)
TITLES = {"uniaxial": "uniaxial", "equibiaxial": "equibiaxial", "pure_shear": "pure shear"}
MARKERS = ("o", "s", "^", "D", "v")


def mode_chart(
    mode: str, fitted: Sequence[Coupon], held_out: Sequence[Coupon], fits: Sequence[Fit], chosen: str
) -> str:
    """Nominal stress against stretch: measured values, filled where fitted, and every law."""
    coupons = [*fitted, *held_out]
    rows = (len(fits) + len(coupons) + 1) // 2
    high = 3.3 + 0.19 * rows
    with canvas(WIDTH, high) as (figure, svg):
        below = (0.56 + 0.19 * rows) / high
        axes = figure.add_axes((0.16, below, 0.80, 1 - below - 0.27 / high))
        reach = np.concatenate([c.stretch for c in coupons] + [np.ones(1)])
        stress = np.concatenate([c.stress_MPa for c in coupons] + [np.zeros(1)])
        least, most = float(stress.min()), float(stress.max())
        pad = 0.06 * (most - least)
        stretch = np.linspace(reach.min(), reach.max(), 201)
        _laws(axes, mode, stretch, fits, chosen)
        for i, c in enumerate(coupons):
            mine = i < len(fitted)
            # A record of thousands of rows is drawn by some of them, or it hides the lines.
            every = max(1, len(c.stretch) // 60)
            axes.plot(
                c.stretch[::every],
                c.stress_MPa[::every],
                MARKERS[i % len(MARKERS)],
                markersize=4.2,
                color=INK,
                markerfacecolor=INK if mine else "white",
                markeredgewidth=0.9,
                zorder=4,
                label=c.name if mine else f"{c.name}, held out",
            )
        axes.set(
            xlim=(reach.min() - 0.02 * np.ptp(reach), reach.max() + 0.02 * np.ptp(reach)),
            # A law that runs away must not flatten the others.
            ylim=(least - pad if least < 0 else -0.2 * pad, most + 2 * pad),
            xlabel="stretch",
            ylabel="nominal stress [MPa]",
        )
        axes.set_title(TITLES[mode], loc="left", fontweight="bold")
        # Beneath, or it would hide the small stretches, where parts work.
        axes.legend(
            loc="upper left",
            bbox_to_anchor=(-0.15, -0.42 / (high * axes.get_position().height)),
            ncols=2,
            columnspacing=1.2,
            handlelength=2.4,
            labelspacing=0.4,
            fontsize=7.5,
        )
    return svg()


def residual_chart(mode: str, coupons: Sequence[Coupon], fits: Sequence[Fit], chosen: str) -> str:
    """Law less measurement over the largest stress, in percent; laws far off leave the frame."""
    with canvas(WIDTH, 2.2) as (figure, svg):
        axes = figure.add_axes((0.16, 0.20, 0.80, 0.74))
        axes.axhspan(-5, 5, color=QUIET, alpha=0.15, linewidth=0)
        axes.axhline(0, color=QUIET, linewidth=0.8)
        for whole in coupons:
            # Of a long record the mean along the stretch, not its noise.
            c, _ = binned(whole)
            order = np.argsort(c.stretch, kind="stable")
            top = np.abs(c.stress_MPa).max()
            for f, style in _styled(fits, chosen):
                off = (f.stress(mode, c.stretch) - c.stress_MPa)[order] / top * 100
                axes.plot(c.stretch[order], off, **{**style, "linewidth": 0.75 * style["linewidth"]})
        axes.set(xlabel="stretch", ylabel="law − test [% of max]", ylim=(-22, 22))
    return svg()


def _laws(axes: Any, mode: str, stretch: Any, fits: Sequence[Fit], chosen: str) -> None:
    for f, style in _styled(fits, chosen):
        axes.plot(stretch, f.stress(mode, stretch), **style, label=f.form.title + _mark(f, mode))


def _mark(fit: Fit, mode: str) -> str:
    if not fit.stable:
        return " (unstable)"
    return " (misses)" if mode in fit.fails else ""


def _styled(fits: Sequence[Fit], chosen: str) -> list[tuple[Fit, dict[str, Any]]]:
    """Every law with its line: the chosen one thick and solid."""
    styled = []
    for f, (color, dashes) in zip(fits, STYLES * (1 + len(fits) // len(STYLES)), strict=False):
        if f.form.name == chosen:
            style: dict[str, Any] = {"color": CHOSEN, "linewidth": 2.4, "linestyle": "-", "zorder": 3}
        else:
            style = {"color": color, "linewidth": 1.3, "linestyle": dashes, "zorder": 2}
        styled.append((f, style))
    return styled
