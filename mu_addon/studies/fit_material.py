"""`fit-material`: from coupon tests to a material; laws fitted, compared and written down."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from math import isfinite, nan
from pathlib import Path
from typing import Any

import attrs

from .. import materials, measured, report
from ..design.declared_laws import form_names
from ..errors import InputError
from ..materials.settings import WEIGHTS
from ..run.parts import Beside, Chart, Fact, File, Part, Sentence, Table, Warn, csv, echo, listed, recorded
from ..run.study import Members, Over, Study, derived, given, intermediate, section, setting, stage
from .inputs import MeasuredInput, WordsInput, asked

TITLES = {"uniaxial": "uniaxial", "equibiaxial": "equibiaxial", "pure_shear": "pure shear"}
Coupons = tuple["materials.Coupon", ...]


def _identity(found: measured.Measured) -> dict[str, list[str]]:
    """Role, mode and SHA-256 of each coupon test, by name."""
    return {e.name: [e.role, str(e.mode), e.sha256] for e in found.of("coupon")}


@attrs.frozen(eq=False)
class Fitting:
    """Coupons, fitted and held out, and the laws fitted to them.

    unseen: relative error of each law in a mode left out of its fit; apart: difference of the laws in
    untested modes (`materials.disagreement`).
    """

    fitted: Coupons
    held: Coupons
    fits: tuple[materials.Fit, ...]
    choice: materials.Choice
    unseen: dict[str, dict[str, float]]
    apart: dict[str, Any]

    @property
    def modes(self) -> list[str]:
        """Modes that were tested, in the order of the coupons."""
        return list(dict.fromkeys(c.mode for c in (*self.fitted, *self.held)))


@attrs.frozen(kw_only=True)
class FitMaterial(Study):
    """Fit hyperelastic laws to coupon tests and write the best one as a material for simulations."""

    name = "fit-material"
    example = "fit-material my-coupons --out out/resin"
    files = {
        "material.toml": "the chosen law as a material file for simulations",
        "fit.csv": "every measured value with the prediction of every law",
        "parameters.csv": "parameters with their intervals",
        "errors.csv": "error of each law on each coupon",
        "fit_*.svg": "one chart per mode",
    }

    data: measured.Measured = given(MeasuredInput(data=_identity))
    laws: tuple[str, ...] = asked(
        WordsInput, "laws", f"laws to fit: {', '.join(form_names())}; empty: all", empty=(), metavar="LAW"
    )
    hold_out: tuple[str, ...] = asked(
        WordsInput,
        "hold_out",
        "test modes held out of the fit for validation: uniaxial, equibiaxial, pure_shear; empty: none",
        empty=(),
        metavar="MODE",
    )
    weights: str = setting(WEIGHTS)

    def __attrs_post_init__(self) -> None:
        for law in self.laws:
            materials.form(law)
        self.coupons(self.data, self.hold_out)

    @property
    def law_names(self) -> tuple[str, ...]:
        """The laws to fit, each once."""
        return tuple(dict.fromkeys(self.laws)) or tuple(materials.FORMS)

    @derived
    def coupons(self, data: measured.Measured, hold_out: tuple[str, ...]) -> tuple[Coupons, Coupons]:
        """Coupons to fit, and those held out; raises InputError where there are none."""
        tests, where = data.of("coupon"), str(data.folder)
        if not tests:
            kinds = ", ".join(dict.fromkeys(e.kind for e in data.experiments))
            remedy = 'laws are fitted to experiments of kind = "coupon"'
            raise InputError(f"the folder contains no coupon test ({kinds})", where, remedy)
        modes = {str(e.mode) for e in tests}
        for mode in hold_out:
            if mode not in modes:
                what = f"there is no coupon of mode {mode!r} to hold out"
                raise InputError(what, "--hold-out", f"modes: {', '.join(sorted(modes))}")
        away = [e.role == "held_out" or e.mode in hold_out for e in tests]
        if all(away):
            raise InputError("every coupon is held out", where, 'leave some with role = "fit"')
        made = [materials.Coupon.of(e) for e in tests]
        fitted = tuple(c for c, out in zip(made, away, strict=True) if not out)
        return fitted, tuple(c for c, out in zip(made, away, strict=True) if out)

    @stage(
        "fit",
        lambda study: len(study.law_names),
        kept=False,
        over=Over(("law",), lambda study: study.law_names),
    )
    def fits(self, law: str, coupons: tuple[Coupons, Coupons], weights: str) -> materials.Fit:
        """A law fitted to the coupons."""
        return materials.fit_coupons(materials.form(law), *coupons, weights, profile=True)

    @stage("fit", 0.0, kept=False, over=Over(("law",), lambda study: study.law_names))
    def unseen(self, law: str, coupons: tuple[Coupons, Coupons], weights: str) -> dict[str, float]:
        """Relative error of a law in each mode, left out of its fit; none where too few values are left."""
        try:
            return materials.leave_one_mode_out(materials.form(law), coupons[0], weights)
        except InputError:
            return {}

    @intermediate()
    def fitting(self, coupons: tuple[Coupons, Coupons], fits: Members, unseen: Members) -> Fitting:
        """All of it, with the law that is chosen."""
        fitted, held = coupons
        every = tuple(fits.values())
        apart = materials.disagreement(every, fitted)
        known = {c.mode for c in held}
        apart = {mode: found for mode, found in apart.items() if mode not in known}
        return Fitting(fitted, held, every, materials.choose(every), dict(unseen), apart)

    # What it shows.

    def heading(self) -> tuple[str, str]:
        """Title of the report, and below it number and modes of the tests."""
        modes = dict.fromkeys(str(e.mode) for e in self.data.of("coupon"))
        count = len(self.data.of("coupon"))
        return (
            f"A law for {self._material_name()}",
            f"{count} coupon test{'s' if count > 1 else ''}: {', '.join(TITLES[m] for m in modes)}",
        )

    def _material_name(self) -> str:
        specimens = dict.fromkeys(e.specimen for e in self.data.of("coupon") if e.specimen)
        return ", ".join(specimens) or self.data.folder.resolve().name

    @section()
    def remarks(self, data: measured.Measured) -> Iterator[Part]:
        """Remarks on the data."""
        for r in data.remarks:
            yield Warn(f"{r.what[0].upper()}{r.what[1:]} ({Path(r.where.split(',')[0]).name}).")
        yield recorded("remarks", [attrs.asdict(r) for r in data.remarks])

    @section()
    def answer(self, data: measured.Measured, fitting: Fitting) -> Iterator[Part]:
        """The chosen law, its error and its limits."""
        choice, chosen = fitting.choice, fitting.choice.chosen
        yield from _warnings(fitting)
        kept = [e for e in chosen.errors if e.mode not in chosen.fails] or list(chosen.errors)
        worst = max(kept, key=lambda e: e.share)
        where = f" in {listed(_titles(e.mode for e in kept))}" if len(chosen.errors) > 1 else ""
        but = f", but it does not fit {listed(_titles(chosen.fails))}" if chosen.fails else ""
        yield Sentence(
            f"Recommended law: {chosen.form.title}. Its error is {worst.share:.1%} of the measured "
            f"stress{where}{but}.",
            answer=True,
            strong=chosen.form.title,
        )
        yield Sentence(f"{_reason(fitting)}.")
        mu, _ = chosen.form.law.small_strain(chosen.parameters[None])[0]
        yield Fact("initial Young's modulus", 3 * mu, f"{3 * mu:.3g} MPa")
        yield Fact("parameters", chosen.form.count, str(chosen.form.count))
        for e in chosen.errors[:4]:
            yield Fact(f"error, {TITLES[e.mode]}", e.share, f"{e.share:.1%}")
        values = ", ".join(f"{p.name} {p.value:.4g}" for p in chosen.intervals)
        errors = ", ".join(f"{e.share:.1%} in {e.coupon}" for e in chosen.errors)
        for line in (
            f"law: {chosen.form.name}, {values}",
            f"error {errors}",
            f"equivalent: {', '.join(f.form.name for f in choice.tied)}" if choice.tied else "",
            f"error on {', '.join(chosen.fails)} exceeds {materials.TOLERANCE:.0%}" if chosen.fails else "",
            f"not tested: {', '.join(fitting.apart)}" if fitting.apart else "",
        ):
            if line:
                yield from echo(line)
        head = "Fitted by fit-material; fit-material.toml names the data."
        yield File("material.toml", lambda path: materials.material_text(self._material(data, fitting), head))
        yield from _recorded(fitting, self.weights)

    def _material(self, data: measured.Measured, fitting: Fitting) -> materials.Material:
        chosen = fitting.choice.chosen
        sources = dict.fromkeys(e.source for e in data.of("coupon") if e.source)
        known = [p for p in chosen.intervals if p.low95 == p.low95]
        names = ", ".join(c.name for c in fitting.fitted)
        return materials.Material(
            name=self._material_name(),
            about="; ".join(sources),
            values={},
            points=(),
            law=chosen.form.law,
            parameters=chosen.parameters,
            law_confidence="fitted",
            law_source=f"{chosen.form.title}, fitted to {names} ({chosen.n} values, {chosen.weights} "
            "weights); "
            f"kappa is not measured but follows from Poisson's ratio {materials.POISSON:g}",
            ranges=materials.ranges(fitting.fitted),
            fails=chosen.fails,
            low95={p.name: p.low95 for p in known},
            high95={p.name: p.high95 for p in known},
        )

    @section("modes", "Tests and laws")
    def modes(self, fitting: Fitting) -> Iterator[Part]:
        """Tests and laws in each mode."""
        names = [f.form.name for f in fitting.fits]
        rows: list[list[Any]] = []
        for group, role in ((fitting.fitted, "fit"), (fitting.held, "held_out")):
            for c in group:
                laws = [f.stress(c.mode, c.stretch) for f in fitting.fits]
                for i, stretch in enumerate(c.stretch):
                    rows.append([c.name, c.mode, role, stretch, c.stress_MPa[i], *(s[i] for s in laws)])
        columns = ["coupon", "mode", "role", "stretch", "stress_MPa", *(f"{name}_MPa" for name in names)]
        yield csv("fit.csv", columns, rows)
        yield Sentence(
            "Filled marks were fitted, open ones held out. The thick orange line is the chosen law. A law "
            f"“does not fit” a test if its error exceeds {materials.TOLERANCE:.0%} (relative L2 norm). Below "
            "each chart, the residual; the grey band is ±5% of the largest stress."
        )
        chosen = fitting.choice.chosen.form.name
        shown = []
        for mode in fitting.modes:
            fitted = [c for c in fitting.fitted if c.mode == mode]
            held = [c for c in fitting.held if c.mode == mode]
            above = partial(report.mode_chart, mode, fitted, held, fitting.fits, chosen)
            below = partial(report.residual_chart, mode, [*fitted, *held], fitting.fits, chosen)
            yield File(f"fit_{mode}.svg", lambda path, draw=above: draw())  # type: ignore[misc]
            missed = [f.form.title for f in fitting.fits if mode in f.fails]
            does = f"{listed(missed)} {'does' if len(missed) == 1 else 'do'} not fit it." if missed else ""
            alt = f"Nominal stress against stretch, {TITLES[mode]}: tests and {len(fitting.fits)} laws."
            shown.append(
                [
                    Chart(above, does or "Every law fits it.", alt),
                    Chart(below, "", f"Difference between laws and tests, {TITLES[mode]}."),
                ]
            )
        yield Beside(shown)

    @section("errors", "Error of each law on each test")
    def errors(self, fitting: Fitting) -> Iterator[Part]:
        """Errors as a table."""
        rows = [
            [f.form.name, e.coupon, e.mode, "fit" if e.fitted else "held_out", e.rms_MPa, e.share, e.worst]
            for f in fitting.fits
            for e in f.errors
        ]
        yield csv("errors.csv", ["law", "coupon", "mode", "role", "rms_MPa", "share", "worst"], rows)
        tests = [*fitting.fitted, *fitting.held]
        unseen = [m for m in fitting.modes if any(m in u for u in fitting.unseen.values())]
        head = ["law", ("parameters", "n")]
        head += [(c.name + ("" if c in fitting.fitted else ", held out"), "n") for c in tests]
        head += [*Table.numbers(*(TITLES[m] for m in unseen)), ("score", "n"), "fails"]
        by = fitting.choice.by
        rows = []
        for f in fitting.fits:
            score = fitting.choice.scores.get(f.form.name)
            rows.append(
                [
                    f.form.title,
                    f.form.count,
                    *(percent(e.share) for e in f.errors),
                    *(percent(fitting.unseen[f.form.name].get(m, nan)) for m in unseen),
                    "unstable" if score is None else _score(score, by),
                    listed(_titles(f.fails)) if f.fails else "nothing",
                ]
            )
        groups = [("", 2), ("error, relative L2 norm", len(tests))]
        groups += [("leave-one-out error", len(unseen))] if unseen else []
        yield Table(
            f"Score: {'error of the held-out tests' if by == 'held out' else 'AICc'}; smaller is better. A "
            f"law does not fit where its error exceeds {materials.TOLERANCE:.0%}.",
            head,
            rows,
            _best(fitting),
            [*groups, ("", 2)],
        )

    @section("parameters", "Parameters")
    def parameters(self, fitting: Fitting) -> Iterator[Part]:
        """Parameters with their intervals."""
        table = [(f, p, i) for f in fitting.fits for i, p in enumerate(f.intervals)]
        yield csv(
            "parameters.csv",
            ["law", "parameter", "value", "low95", "high95", "note"],
            [[f.form.name, p.name, p.value, p.low95, p.high95, p.note] for f, p, _ in table],
        )
        chosen = fitting.choice.chosen
        yield Sentence(
            "Confidence intervals by Student's t: for Ogden parameters from the profile likelihood, for the "
            "other laws, which are linear in their parameters, exact. They are widened for autocorrelated "
            f"residuals: of the chosen law, {chosen.n} values count as {chosen.n_effective:.3g} independent "
            "ones. Where a law does not fit the test, its residual is not noise and the interval is not "
            "valid."
        )
        head = ["law", "parameter", *Table.numbers("value", "low 95 %", "high 95 %"), ("note", "text")]
        rows = [
            (
                f.form.title if i == 0 else "",
                p.name,
                f"{p.value:.4g}",
                f"{p.low95:.4g}" if isfinite(p.low95) else "–",
                f"{p.high95:.4g}" if isfinite(p.low95) else "–",
                p.note or ("its sign is not determined" if p.low95 <= 0 <= p.high95 else ""),
            )
            for f, p, i in table
        ]
        yield Table("", head, rows, [k for k, (f, _, _) in enumerate(table) if f is chosen])

    @section("stability", "Stability")
    def stability(self, fitting: Fitting) -> Iterator[Part]:
        """Where each law is stable."""
        yield Sentence(
            "Drucker's postulate in Hill's form: every further increment of logarithmic strain, at constant "
            "volume and in any direction, requires positive work, d(τ):d(e) > 0 with the Kirchhoff stress τ. "
            "Checked at 101 stretches of each mode over the tested range; untested modes are checked in "
            "tension to the same logarithmic strain."
        )
        rows: list[tuple[str, ...]] = []
        best = []
        for f in fitting.fits:
            if f.invalid:
                rows.append((f.form.title, "", "", "", "", f"FAILED: {f.invalid}"))
            for i, s in enumerate(f.stability):
                best += [len(rows)] if f is fitting.choice.chosen else []
                verdict = "stable" if s.stable else f"unstable {s.where()}"
                stretches, least = f"{s.low:.3g} to {s.high:.3g}", f"{s.least_MPa:.4g}"
                title = f.form.title if i == 0 else ""
                rows.append((title, TITLES[s.mode], stretches, least, f"{s.least_at:.3g}", verdict))
        head = [
            "law",
            "mode",
            ("stretches", "line"),
            *Table.numbers("least stiffness [MPa]", "at"),
            "verdict",
        ]
        yield Table("", head, rows, best)

    @section("method", "Method")
    def method(self, data: measured.Measured, weights: str) -> Iterator[Part]:
        """How laws were fitted."""
        means = {
            "absolute": "each residual counts as a share of its coupon's largest stress",
            "relative": "each residual counts as a share of its stress, at least "
            f"{materials.FLOOR:.0%} of the largest",
        }
        rows = {
            "weights": f"{weights}: {means[weights]}",
            "stress": "nominal, of incompressible laws",
            "Ogden terms": "each with mu alpha of 0 or more, which is sufficient for stability",
            "bulk modulus": f"not measured by these tests; from Poisson's ratio {materials.POISSON:g}",
            "measured data": data.folder.name,
        }
        yield Table("", ["what", ("how", "text")], list(rows.items()))


def _best(fitting: Fitting) -> list[int]:
    return [i for i, f in enumerate(fitting.fits) if f is fitting.choice.chosen]


def _warnings(fitting: Fitting) -> Iterator[Part]:
    chosen = fitting.choice.chosen
    if chosen.fails:
        yield Warn(
            f"{chosen.form.title} has an error on {listed(_titles(chosen.fails))} of more than "
            f"{materials.TOLERANCE:.0%}: do not use it in that mode."
        )
    for mode, (stretch, ratio) in fitting.apart.items():
        i = int((ratio > 1.1).argmax()) if (ratio > 1.1).any() else len(ratio) - 1
        yield Warn(
            f"{TITLES[mode].capitalize()} was not tested. There, laws that fit the other modes differ by a "
            f"factor of {ratio[i]:.3g} at a stretch of {stretch[i]:.3g}"
            + (f" and {_factor(ratio[-1])} at {stretch[-1]:.3g}." if i < len(ratio) - 1 else ".")
            + (" Test this mode before using any of them in it." if ratio[-1] > 1.1 else "")
        )
    apart = compressibility(chosen, fitting.fitted)
    yield recorded("compressibility", apart)
    if apart > 0.02:
        yield Warn(
            f"With Poisson's ratio {materials.POISSON:g}, stress at the end of the range differs by "
            f"{apart:.0%} from the incompressible law that was fitted: measure the bulk modulus, or stay "
            "well within the range."
        )


def compressibility(chosen: materials.Fit, coupons: Coupons) -> float:
    """Share by which kappa moves the stress at the end of the coupons' range."""
    import numpy as np

    moved = []
    for mode, (_, high) in materials.ranges(coupons).items():
        if high > 1:
            at = np.array([high])
            soft = materials.response(chosen.form.law, chosen.parameters, mode, at).stress_MPa[0]
            moved.append(abs(float(soft / chosen.stress(mode, at)[0]) - 1))
    return max(moved, default=0.0)


def _reason(fitting: Fitting) -> str:
    """Why the law was chosen."""
    choice, chosen = fitting.choice, fitting.choice.chosen
    held = choice.by == "held out"
    by = "has the smallest error on the held-out tests" if held else "has the smallest AICc"
    words = f"Of the stable laws that fit their tests it {by}"
    if not chosen.follows:
        words = f"No stable law fits its tests; of all laws, this one {by}"
    if choice.tied:
        tied = [f.form.title for f in choice.tied]
        words = (
            f"{listed(tied)} {'is' if len(tied) == 1 else 'are'} equally good "
            f"({'held-out error' if held else 'AICc'}); of these it has the fewest parameters"
        )
    unstable = [f.form.title for f in fitting.fits if not f.stable]
    if unstable:
        one = len(unstable) == 1
        words += f". {listed(unstable)} {'is' if one else 'are'} unstable and {'was' if one else 'were'} "
        "not considered"
    return words


def _recorded(fitting: Fitting, weights: str) -> Iterator[Part]:
    """Every figure of a fit."""
    choice = fitting.choice
    yield recorded("chosen", choice.chosen.form.name)
    yield recorded("tied", [f.form.name for f in choice.tied])
    yield recorded("chosen_by", choice.by)
    yield recorded("scores", dict(choice.scores))
    yield recorded("weights", weights)
    yield recorded("tolerance", materials.TOLERANCE)
    laws = {
        f.form.name: {
            "parameters": {p.name: attrs.asdict(p) for p in f.intervals},
            "stable": f.stable,
            "unstable": f.instability(),
            "fails": list(f.fails),
            "errors": [attrs.asdict(e) for e in f.errors],
            "unseen": fitting.unseen[f.form.name],
            "memory": f.memory,
            "n": f.n,
            "n_effective": f.n_effective,
        }
        for f in fitting.fits
    }
    yield recorded("laws", laws)
    yield recorded(
        "untested",
        {mode: {"stretch": s, "largest_over_smallest": ratio} for mode, (s, ratio) in fitting.apart.items()},
    )


def _score(score: float, by: str) -> str:
    if by == "held out":
        return percent(score)
    return f"{score:.1f}" if isfinite(score) else "too few values"


def percent(share: float) -> str:
    """A share as percent; beyond 1000 % as a power of ten."""
    if not isfinite(share):
        return "–"
    return f"{share:.1%}" if share < 10 else f"× {_factor(share)}"


def _factor(ratio: float) -> str:
    if ratio < 1e3:
        return f"{ratio:.3g}"
    exponent = f"{ratio:e}".partition("e")[2]
    return f"10{str(int(exponent)).translate(_SUPERSCRIPT)}"


_SUPERSCRIPT = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def _titles(modes: Any) -> list[str]:
    return list(dict.fromkeys(TITLES[mode] for mode in modes))
