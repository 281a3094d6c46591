"""`fit-material`: from coupon tests to a material; laws fitted, compared and written down."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import attrs
import numpy as np

from ...errors import InputError
from ...files import write_csv, write_text
from ...materials.coupon import Array, Coupon, response
from ...materials.fit import POISSON, TOLERANCE, Fit, fit_coupons, leave_one_mode_out, ranges
from ...materials.law_choice import Choice, choose, disagreement
from ...materials.library import Material, write_material
from ...measured import Measured
from ...run.context import RunContext
from ...run.progress_estimate import Plan
from ...run.usecase import UseCase
from .charts import mode_chart
from .job import LAYOUT, Job, read_job
from .report import write_report

FIT_S = 1.0
"""Approximate seconds to fit a law."""


@attrs.frozen(eq=False)
class Fitting:
    """Coupons and the laws fitted to them.

    unseen: relative error of each law in a mode left out of its fit; apart: difference of the laws in
    untested modes, see `disagreement`; compressibility: relative change of the chosen law's stress by kappa
    at the end of its range.
    """

    measured: Measured
    fitted: tuple[Coupon, ...]
    held_out: tuple[Coupon, ...]
    weights: str
    fits: tuple[Fit, ...]
    choice: Choice
    unseen: dict[str, dict[str, float]]
    apart: dict[str, tuple[Array, Array]]
    compressibility: float
    material: Material

    @property
    def modes(self) -> list[str]:
        """Modes that were tested, in the order of the coupons."""
        return list(dict.fromkeys(c.mode for c in (*self.fitted, *self.held_out)))

    def tested(self, mode: str) -> tuple[list[Coupon], list[Coupon]]:
        """Coupons of a mode, fitted and held out."""
        return [c for c in self.fitted if c.mode == mode], [c for c in self.held_out if c.mode == mode]


def fit_material(job: Job, folder: Path, context: RunContext) -> Fitting:
    """Fit laws to coupons; writes material.toml, fit.csv, parameters.csv, errors.csv and a chart a mode.

    Raises OutputError.
    """
    measured, progress, forms, weights = job.measured, context.progress, job.forms, job.weights
    fitted, held = job.coupons
    for remark in measured.remarks:
        progress.warning(remark.what, remark.where, remark.remedy)
    with progress.stage("fit", expected_s=FIT_S * len(forms)):
        fits, unseen = [], {}
        for i, one in enumerate(forms):
            fits.append(fit_coupons(one, fitted, held, weights, profile=True))
            unseen[one.name] = _unseen(one, fitted, weights)
            progress.update((i + 1) / len(forms))
        choice = choose(fits)
    material = _material(measured, fitted, choice)
    found = Fitting(
        measured=measured,
        fitted=fitted,
        held_out=held,
        weights=weights,
        fits=tuple(fits),
        choice=choice,
        unseen=unseen,
        apart={m: d for m, d in disagreement(fits, fitted).items() if m not in {c.mode for c in held}},
        compressibility=_compressibility(choice.chosen, fitted),
        material=material,
    )
    _write(found, folder)
    context.summary |= summary(found)
    context.report = lambda stopped: write_report(found, folder, context, stopped)
    return found


def _unseen(one: Any, fitted: Sequence[Coupon], weights: str) -> dict[str, float]:
    try:
        return leave_one_mode_out(one, fitted, weights)
    except InputError:
        # Too few values are left for this law without one of the modes.
        return {}


def _compressibility(chosen: Fit, coupons: Sequence[Coupon]) -> float:
    """Share by which kappa moves the stress at the end of the coupons' range."""
    moved = []
    for mode, (_, high) in ranges(coupons).items():
        if high > 1:
            at = np.array([high])
            stiff = chosen.stress(mode, at)
            moved.append(
                abs(
                    float(response(chosen.form.law, chosen.parameters, mode, at).stress_MPa[0] / stiff[0]) - 1
                )
            )
    return max(moved, default=0.0)


def _material(measured: Measured, fitted: Sequence[Coupon], choice: Choice) -> Material:
    chosen = choice.chosen
    specimens = dict.fromkeys(e.specimen for e in measured.of("coupon") if e.specimen)
    sources = dict.fromkeys(e.source for e in measured.of("coupon") if e.source)
    known = [p for p in chosen.intervals if p.low95 == p.low95]
    names = ", ".join(c.name for c in fitted)
    return Material(
        name=", ".join(specimens) or measured.folder.resolve().name,
        about="; ".join(sources),
        values={},
        points=(),
        law=chosen.form.law,
        parameters=chosen.parameters,
        law_confidence="fitted",
        law_source=f"{chosen.form.title}, fitted to {names} ({chosen.n} values, {chosen.weights} "
        f"weights); kappa is not measured but follows from Poisson's ratio {POISSON:g}",
        ranges=ranges(fitted),
        fails=chosen.fails,
        low95={p.name: p.low95 for p in known},
        high95={p.name: p.high95 for p in known},
    )


def _write(found: Fitting, out: Path) -> None:
    write_material(found.material, out / "material.toml", "Fitted by fit-material; fit.toml names the data.")
    names = [f.form.name for f in found.fits]
    rows: list[list[Any]] = []
    for group, role in ((found.fitted, "fit"), (found.held_out, "held_out")):
        for c in group:
            laws = [f.stress(c.mode, c.stretch) for f in found.fits]
            for i, stretch in enumerate(c.stretch):
                rows.append([c.name, c.mode, role, stretch, c.stress_MPa[i], *(s[i] for s in laws)])
    columns = ["coupon", "mode", "role", "stretch", "stress_MPa", *(f"{name}_MPa" for name in names)]
    write_csv(out / "fit.csv", columns, rows)
    write_csv(
        out / "parameters.csv",
        ["law", "parameter", "value", "low95", "high95", "note"],
        [[f.form.name, p.name, p.value, p.low95, p.high95, p.note] for f in found.fits for p in f.intervals],
    )
    write_csv(
        out / "errors.csv",
        ["law", "coupon", "mode", "role", "rms_MPa", "share", "worst"],
        [
            [f.form.name, e.coupon, e.mode, "fit" if e.fitted else "held_out", e.rms_MPa, e.share, e.worst]
            for f in found.fits
            for e in f.errors
        ],
    )
    for mode in found.modes:
        chart = mode_chart(mode, *found.tested(mode), found.fits, found.choice.chosen.form.name)
        write_text(out / f"fit_{mode}.svg", chart)


def summary(found: Fitting) -> dict[str, Any]:
    """Every figure of a fit in plain data."""
    choice = found.choice
    return {
        "chosen": choice.chosen.form.name,
        "tied": [f.form.name for f in choice.tied],
        "chosen_by": choice.by,
        "scores": dict(choice.scores),
        "weights": found.weights,
        "tolerance": TOLERANCE,
        "compressibility": found.compressibility,
        "laws": {
            f.form.name: {
                "parameters": {p.name: attrs.asdict(p) for p in f.intervals},
                "stable": f.stable,
                "unstable": f.instability(),
                "fails": list(f.fails),
                "errors": [attrs.asdict(e) for e in f.errors],
                "unseen": found.unseen[f.form.name],
                "memory": f.memory,
                "n": f.n,
                "n_effective": f.n_effective,
            }
            for f in found.fits
        },
        "untested": {
            mode: {"stretch": stretch, "largest_over_smallest": ratio}
            for mode, (stretch, ratio) in found.apart.items()
        },
        "remarks": [attrs.asdict(r) for r in found.measured.remarks],
    }


def console_summary(summary: dict[str, Any]) -> list[str]:
    """Lines of text on a fit's `summary`."""
    chosen = summary["chosen"]
    law = summary["laws"][chosen]
    values = ", ".join(f"{name} {p['value']:.4g}" for name, p in law["parameters"].items())
    errors = ", ".join(f"{e['share']:.1%} in {e['coupon']}" for e in law["errors"])
    lines = [f"law: {chosen}, {values}", f"error {errors}"]
    if summary["tied"]:
        lines.append(f"equivalent: {', '.join(summary['tied'])}")
    if law["fails"]:
        lines.append(f"error on {', '.join(law['fails'])} exceeds {summary['tolerance']:.0%}")
    if summary["untested"]:
        lines.append(f"not tested: {', '.join(summary['untested'])}")
    return lines


def plan_of(job: Job) -> Plan:
    """Stages of a fit with the expected seconds of each on two cores."""
    return [("fit", FIT_S * len(job.forms)), ("report", 1.0)]


USE_CASE = UseCase("fit-material", LAYOUT, read_job, fit_material, console_summary, plan=plan_of)
