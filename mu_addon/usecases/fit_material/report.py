"""The report of a fit: the recommended law, its error in each mode, the intervals of its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ...files import write_text
from ...materials.fit import FLOOR, POISSON, TOLERANCE
from ...report.html import cards, facts_table, figure, note, page, table
from ...report.plots import signed
from ...run.context import RunContext
from ...run.versions import package_versions
from .charts import TITLES, mode_chart, residual_chart

if TYPE_CHECKING:
    from .run import Fitting

FILES = {
    "fit.toml": "inputs of this run",
    "material.toml": "the chosen law as a material file for simulations",
    "fit.csv": "every measured value with the prediction of every law",
    "parameters.csv": "parameters with their intervals",
    "errors.csv": "error of each law on each coupon",
    "fit_*.svg": "one chart per mode",
    "summary.json": "all results of this run as numbers",
    "log.ndjson": "log of this run",
}
WEIGHTS_MEAN = {
    "absolute": "each residual counts as a share of its coupon's largest stress",
    "relative": f"each residual counts as a share of its stress, at least {FLOOR:.0%} of the largest",
}


def write_report(found: Fitting, out: Path, context: RunContext, stopped: str) -> None:
    """Write report.html; raises OutputError. stopped: why an incomplete run stopped."""
    with context.progress.stage("report"):
        versions = package_versions()
        context.summary["versions"] = versions
        write_text(out / "report.html", report(found, versions, stopped))


def report(found: Fitting, versions: dict[str, str], stopped: str = "") -> str:
    """The whole report as HTML text."""
    sections = [
        ("modes", "Tests and laws", _charts(found)),
        ("errors", "Error of each law on each test", _errors(found)),
        ("parameters", "Parameters", _parameters(found)),
        ("stability", "Stability", _stability(found)),
        ("method", "Method", _method(found)),
        ("files", "Files of this run", facts_table("file", "content", FILES)),
        ("versions", "Versions", facts_table("program", "version", versions)),
    ]
    count = len(found.fitted) + len(found.held_out)
    subtitle = f"{count} coupon test{'s' if count > 1 else ''}: " + ", ".join(TITLES[m] for m in found.modes)
    return page(
        f"A law for {found.material.name}",
        subtitle,
        note(_warnings(found), stopped),
        _headline(found),
        sections,
    )


def _warnings(found: Fitting) -> list[str]:
    chosen = found.choice.chosen
    warnings = []
    missed = [TITLES[m] for m in chosen.fails]
    if missed:
        warnings.append(
            f"{chosen.form.title} has an error on {_listed(missed)} of more than {TOLERANCE:.0%}: do "
            "not use it in that mode."
        )
    for mode, (stretch, ratio) in found.apart.items():
        i = int(np.argmax(ratio > 1.1)) if (ratio > 1.1).any() else len(ratio) - 1
        warnings.append(
            f"{TITLES[mode].capitalize()} was not tested. There, laws that fit the other modes "
            f"differ by a factor of {ratio[i]:.3g} at a stretch of {stretch[i]:.3g}"
            + (f" and {_factor(ratio[-1])} at {stretch[-1]:.3g}." if i < len(ratio) - 1 else ".")
            + (" Test this mode before using any of them in it." if ratio[-1] > 1.1 else "")
        )
    if found.compressibility > 0.02:
        warnings.append(
            f"With Poisson's ratio {POISSON:g}, stress at the end of the range differs by "
            f"{found.compressibility:.0%} from the incompressible law that was fitted: measure the "
            "bulk modulus, or stay well within the range."
        )
    warnings += [
        f"{r.what[0].upper()}{r.what[1:]} ({Path(r.where.split(',')[0]).name})."
        for r in found.measured.remarks
    ]
    return warnings


def _factor(ratio: float) -> str:
    return f"{ratio:.3g}" if ratio < 1e3 else f"10{str(int(np.log10(ratio))).translate(_SUPERSCRIPT)}"


_SUPERSCRIPT = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def _headline(found: Fitting) -> str:
    choice = found.choice
    chosen = choice.chosen
    kept = [e for e in chosen.errors if e.mode not in chosen.fails] or list(chosen.errors)
    worst = max(kept, key=lambda e: e.share)
    html = (
        f'<p class="answer">Recommended law: <strong>{escape(chosen.form.title)}</strong>. Its error '
        "is "
        f"{worst.share:.1%} of the measured stress"
        + (
            f" in {_listed(list(dict.fromkeys(TITLES[e.mode] for e in kept)))}"
            if len(chosen.errors) > 1
            else ""
        )
        + (f", but it does not fit {_listed([TITLES[m] for m in chosen.fails])}" if chosen.fails else "")
        + ".</p>"
    )
    by = (
        "has the smallest error on the held-out tests" if choice.by == "held out" else "has the smallest AICc"
    )
    whose = "the stable laws that fit their tests"
    words = f"Of {whose} it {by}"
    if not chosen.follows:
        words = f"No stable law fits its tests; of all laws, this one {by}"
    if choice.tied:
        tied = [f.form.title for f in choice.tied]
        score = "held-out error" if choice.by == "held out" else "AICc"
        words = (
            f"{_listed(tied)} {'is' if len(tied) == 1 else 'are'} equally good ({score}); of these it "
            "has the fewest parameters"
        )
    unstable = [f.form.title for f in found.fits if not f.stable]
    if unstable:
        was = "was" if len(unstable) == 1 else "were"
        words += (
            f". {_listed(unstable)} {'is' if len(unstable) == 1 else 'are'} unstable and {was} not considered"
        )
    mu, _ = chosen.form.law.small_strain(chosen.parameters[None])[0]
    facts = [
        ("initial Young's modulus", f"{3 * mu:.3g} MPa"),
        ("parameters", str(chosen.form.count)),
        *((f"error, {TITLES[e.mode]}", f"{e.share:.1%}") for e in chosen.errors[:4]),
    ]
    return f"{html}<p>{escape(words)}.</p>{cards(facts)}"


def _charts(found: Fitting) -> str:
    html = (
        "<p>Filled marks were fitted, open ones held out. The thick orange line is the chosen law. A "
        f"law “does not fit” a test if its error exceeds {TOLERANCE:.0%} (relative L2 norm). Below "
        "each chart, the residual; the grey band is ±5% of the largest stress.</p>"
        '<div class="pair">'
    )
    chosen = found.choice.chosen.form.name
    for mode in found.modes:
        fitted, held = found.tested(mode)
        missed = [f.form.title for f in found.fits if mode in f.fails]
        html += (
            "<div>"
            + figure(
                mode_chart(mode, fitted, held, found.fits, chosen),
                escape(
                    f"{_listed(missed)} {'does' if len(missed) == 1 else 'do'} not fit it."
                    if missed
                    else "Every law fits it."
                ),
                f"Nominal stress against stretch, {TITLES[mode]}: tests and {len(found.fits)} laws.",
            )
            + figure(
                residual_chart(mode, [*fitted, *held], found.fits, chosen),
                "",
                f"Difference between laws and tests, {TITLES[mode]}.",
            )
            + "</div>"
        )
    return html + "</div>"


def _errors(found: Fitting) -> str:
    tests = [*found.fitted, *found.held_out]
    head = [("law", ""), ("parameters", "n")]
    head += [(c.name + ("" if c in found.fitted else ", held out"), "n") for c in tests]
    unseen = [m for m in found.modes if any(m in u for u in found.unseen.values())]
    head += [(TITLES[m], "n") for m in unseen]
    head += [("score", "n"), ("fails", "")]
    rows = []
    for f in found.fits:
        cells: list[Any] = [f.form.title, f.form.count]
        cells += [percent(e.share) for e in f.errors]
        cells += [percent(found.unseen[f.form.name].get(m, np.nan)) for m in unseen]
        score = found.choice.scores.get(f.form.name)
        cells.append("unstable" if score is None else _score(score, found.choice.by))
        cells.append(_listed([TITLES[m] for m in f.fails]) if f.fails else "nothing")
        rows.append((cells, f is found.choice.chosen))
    groups = [("", 2), ("error, relative L2 norm", len(tests))]
    if unseen:
        groups.append(("leave-one-out error", len(unseen)))
    groups.append(("", 2))
    by = "error of the held-out tests" if found.choice.by == "held out" else "AICc"
    return table(
        f"Score: {by}; smaller is better. A law does not fit where its error exceeds {TOLERANCE:.0%}.",
        head,
        rows,
        groups,
    )


def _score(score: float, by: str) -> str:
    if by == "held out":
        return percent(score)
    return signed(f"{score:.1f}") if np.isfinite(score) else "too few values"


def percent(share: float) -> str:
    """A share as percent; beyond 1000 % as a power of ten."""
    if not np.isfinite(share):
        return "–"
    return f"{share:.1%}" if share < 10 else f"× {_factor(share)}"


def _parameters(found: Fitting) -> str:
    rows = []
    for f in found.fits:
        for i, p in enumerate(f.intervals):
            known = np.isfinite(p.low95)
            rows.append(
                (
                    [
                        f.form.title if i == 0 else "",
                        p.name,
                        _figures(p.value),
                        _figures(p.low95) if known else "–",
                        _figures(p.high95) if known else "–",
                        p.note or ("its sign is not determined" if p.low95 <= 0 <= p.high95 else ""),
                    ],
                    f is found.choice.chosen,
                )
            )
    chosen = found.choice.chosen
    head = [
        ("law", ""),
        ("parameter", ""),
        ("value", "n"),
        ("low 95 %", "n"),
        ("high 95 %", "n"),
        ("note", "text"),
    ]
    words = (
        "<p>Confidence intervals by Student's t: for Ogden parameters from the profile likelihood, "
        "for the other laws, which are linear in their parameters, exact. They are widened for "
        f"autocorrelated residuals: of the chosen law, {chosen.n} values count as "
        f"{chosen.n_effective:.3g} independent ones. Where a law does not fit the test, its residual "
        "is not noise and the interval is not valid.</p>"
    )
    return words + table("", head, rows)


def _figures(value: float) -> str:
    return signed(f"{value:.4g}")


def _stability(found: Fitting) -> str:
    rows = []
    for f in found.fits:
        if f.invalid:
            rows.append(([f.form.title, "", "", "", "", f"FAILED: {f.invalid}"], False))
        for i, s in enumerate(f.stability):
            verdict = "stable" if s.stable else f"unstable {s.where()}"
            cells = [f.form.title if i == 0 else "", TITLES[s.mode], f"{s.low:.3g} to {s.high:.3g}"]
            cells += [_figures(s.least_MPa), f"{s.least_at:.3g}", verdict]
            rows.append((cells, f is found.choice.chosen))
    head = [
        ("law", ""),
        ("mode", ""),
        ("stretches", "line"),
        ("least stiffness [MPa]", "n"),
        ("at", "n"),
        ("verdict", ""),
    ]
    return (
        "<p>Drucker's postulate in Hill's form: every further increment of logarithmic strain, at "
        "constant volume and in any direction, requires positive work, d(τ):d(e) &gt; 0 with the "
        "Kirchhoff stress τ. Checked at 101 stretches of each mode over the tested range; untested "
        "modes are checked in tension to the same logarithmic strain.</p>" + table("", head, rows)
    )


def _method(found: Fitting) -> str:
    facts = {
        "weights": f"{found.weights}: {WEIGHTS_MEAN[found.weights]}",
        "stress": "nominal, of incompressible laws",
        "Ogden terms": "each with mu alpha of 0 or more, which is sufficient for stability",
        "bulk modulus": f"not measured by these tests; from Poisson's ratio {POISSON:g}",
        "measured data": str(found.measured.folder.name),
    }
    return facts_table("what", "how", facts)


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
