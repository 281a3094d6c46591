"""Four published ways to find what is wrong with a model, and ours, on the same sets of measured data.

python -m benchmarks.evidence.practitioners SETS [--only NAME,...]

SETS: a folder of folders of measured data, each with experiments.toml; those named in `TRUTHS` are judged.
The four are minimal implementations of our own after the papers, not the packages: CTSM-R needs R; EUCLID's
code is of full-field displacements, of which a coupon has none. All share our base models, so that only the
verdict differs:

- discrepancy: Kennedy and O'Hagan, J. R. Stat. Soc. B 63 (2001) 425: a Gaussian process over the drive and
  the time beside the fitted model; it tells that a model is wrong, and where, and names no cause.
- grey box: Bacher and Madsen, Energy Build. 43 (2011) 1511, as CTSM-R is used: first-order noise estimated
  from the base model's residual, effects added one by one while a likelihood ratio passes 5 %.
- residuals: structured residuals, Gertler, Fault Detection and Diagnosis in Engineering Systems (1998): an
  alarm where the residual exceeds white noise, and the effect whose signature it lies along.
- EUCLID: Flaschel, Kumar and De Lorenzis, CMAME 381 (2021) 113852: sparse regression of the strain energy,
  here of uniaxial stress; it knows hyperelastic laws only.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize, nnls
from scipy.stats import chi2

from mu_addon.errors import InputError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.fit import Fitter
from mu_addon.evidence.noise import Source, estimate
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.record import record
from mu_addon.evidence.simulator import Composite
from mu_addon.measured import Experiment, read_folder

Array = np.ndarray[Any, Any]

# What is hidden in each set: names that are right; empty for a clean one. ASKS: a mistake in the file.
CLEAN, ASKS = "clean", "asks"
TRUTHS = {
    "c05_clean_missing_irregular": CLEAN,
    "r_c04_one": CLEAN,
    "h02_clean_quant": CLEAN,
    "r_hq_2": CLEAN,
    "force_kN_as_N": ASKS,
    "hold_absolute": ASKS,
    "z_drift_log": "pressure_drift",
    "e03_mullins_tanh": "mullins_softening",
    "z_zero_per_test": CLEAN,
    "z_leak_one_specimen0": "leak",
}
NOTHING, WRONG_MODEL, UNABLE = "nothing", "model wrong, no cause", "refused"
ALPHA = 0.05
# Inducing places of a discrepancy, by drive and by time.
PLACES = 12


def whole(experiments: Sequence[Experiment]) -> tuple[Composite, Any]:
    """The simulators, and the record of what is fitted."""
    simulator = Composite(bench_simulators(experiments))
    return simulator, record([e for e in experiments if e.role == "fit"], simulator)


def white_of(measured: Any) -> dict[str, Source]:
    """White noise alone, by group of series, from differences of neighbours."""
    found = {}
    for group in measured.groups:
        sd = [
            np.median(np.abs(np.diff(measured.values[s.at]))) / (0.6745 * np.sqrt(2.0))
            for s in measured.series
            if s.group == group
        ]
        found[group] = Source(max(float(np.median(sd)), 1e-9), 0.0, 1.0)
    return found


def discrepancy(experiments: Sequence[Experiment]) -> str:
    """Whether a Gaussian process beside the base model takes a significant part of what it leaves."""
    simulator, measured = whole(experiments)
    fitter = Fitter(measured, simulator, white_of(measured))
    fit = fitter.fit()
    gained = 0.0
    for s in measured.series:
        r = fit.residual[s.at]
        r, x = r - r.mean(), np.linspace(0.0, 1.0, len(r))
        drive = measured.experiments[s.experiment].columns.get("strain")
        y = x if drive is None else s.mean(drive[None])[0]
        places = np.stack([x, (y - y.min()) / max(np.ptp(y), 1e-12)], axis=1)
        gained += process(places, r)
    # Two numbers, size and length, of every series.
    p = chi2.sf(gained, 2 * len(measured.series))
    return WRONG_MODEL if p < ALPHA else NOTHING


def process(places: Array, residual: Array) -> float:
    """Gain in -2 log L of a Gaussian process of squared exponentials over white noise of its own size."""
    every = max(1, len(residual) // 300)
    x, r = places[::every], residual[::every]
    off = ((x[:, None] - x[None]) ** 2).sum(axis=2)

    def deviance(v: Array) -> float:
        size, length, noise = np.exp(v)
        covariance = size**2 * np.exp(-off / (2.0 * length**2)) + noise**2 * np.eye(len(r))
        chol = np.linalg.cholesky(covariance)
        return float(2.0 * np.log(np.diag(chol)).sum() + (np.linalg.solve(chol, r) ** 2).sum())

    sd = float(np.std(r)) or 1e-9
    bounds = [
        (np.log(1e-4 * sd), np.log(1e2 * sd)),
        (np.log(0.05), np.log(3.0)),
        (np.log(1e-3 * sd), np.log(3 * sd)),
    ]
    found = minimize(deviance, np.log([sd, 0.3, 0.5 * sd]), bounds=bounds, method="L-BFGS-B")
    plain = len(r) * np.log(max(np.mean(r**2), 1e-300)) + len(r)
    return max(0.0, float(plain - found.fun))


def grey_box(experiments: Sequence[Experiment]) -> str:
    """Effects added one by one while a likelihood ratio at 5 % passes, under the residual's own noise."""
    simulator, measured = whole(experiments)
    fitter = Fitter(measured, simulator, white_of(measured))
    base = fitter.fit()
    left = measured.values - fitter.predict(base.values)
    constant = [np.ones((s.at.stop - s.at.start, 1)) for s in measured.series]
    fitter = Fitter(measured, simulator, estimate(measured, left, constant))
    chosen = fitter.fit()
    for _ in range(3):
        tried = [
            fitter.best([*chosen.effects, e], [{**chosen.values, **s} for s in e.starts()[:2]])
            for e in simulator.effects
            if e.name not in chosen.names
        ]
        best = min(tried, key=lambda f: f.chi2, default=None)
        if best is None or chi2.sf(chosen.chi2 - best.chi2, len(best.effects[-1].keys)) >= ALPHA:
            break
        chosen = best
    return "+".join(chosen.names) or NOTHING


def residuals(experiments: Sequence[Experiment]) -> str:
    """The effect along whose signature the residual lies, where it exceeds white noise."""
    simulator, measured = whole(experiments)
    fitter = Fitter(measured, simulator, white_of(measured))
    fit = fitter.fit()
    if chi2.sf(fit.chi2, len(measured) - len(fit.keys)) >= ALPHA:
        return NOTHING
    q = np.linalg.qr(fit.jacobian)[0] if len(fit.keys) else np.zeros((len(measured), 0))
    along: dict[str, float] = {}
    for e in simulator.effects:
        for shape in e.shapes():
            key, p = e.keys[0], e.parameters[0]
            moved = {**fit.values, **shape, key: p.null + p.step}
            signature = fitter.project(fitter.predict(moved) - fitter.predict(fit.values))
            signature -= q @ (q.T @ signature)
            length = float(np.linalg.norm(signature))
            if length > 1e-9:
                along[e.name] = max(along.get(e.name, 0.0), abs(float(signature @ fit.residual)) / length)
    return max(along, key=lambda n: along[n]) if along else WRONG_MODEL


def euclid(experiments: Sequence[Experiment]) -> str:
    """Whether a sparse strain energy asks for more than the neo-Hookean term; of uniaxial coupons alone."""
    pulled = [e for e in experiments if e.kind == "coupon" and e.mode == "uniaxial"]
    if not pulled:
        return UNABLE
    strain = np.concatenate([e["strain"] for e in pulled])
    stress = np.concatenate([e["stress_kPa"] for e in pulled])
    seen = np.isfinite(strain) & np.isfinite(stress)
    stretch, stress = 1.0 + strain[seen], stress[seen]
    i1, i2 = stretch**2 + 2.0 / stretch - 3.0, 2.0 * stretch + stretch**-2.0 - 3.0
    d1, d2 = 2.0 * (stretch - stretch**-2.0), 2.0 * (1.0 - stretch**-3.0)
    terms = {"I1": d1, "I2": d2, "I1^2": 2.0 * i1 * d1, "I2^2": 2.0 * i2 * d2, "I1^3": 3.0 * i1**2 * d1}
    columns = np.stack(list(terms.values()), axis=1)
    columns /= np.linalg.norm(columns, axis=0)
    kept = list(range(len(terms)))
    # The sparsest set within one per cent of the best.
    best = float(nnls(columns, stress)[1])
    while len(kept) > 1:
        without = [(float(nnls(columns[:, [k for k in kept if k != j]], stress)[1]), j) for j in kept]
        cost, least = min(without)
        if cost > 1.01 * best:
            break
        kept.remove(least)
    names = [list(terms)[k] for k in kept]
    return NOTHING if names == ["I1"] else "strain_stiffening"


def ours(experiments: Sequence[Experiment]) -> str:
    """The verdict of `mu_addon.evidence`."""
    found = diagnose(experiments, Composite(bench_simulators(experiments)))
    if found.kind == "none":
        return NOTHING
    if found.names:
        causes = found.selection.causes
        return "+".join(
            " or ".join([c.effect.name, *(r.partition(" of ")[0] for r in c.rivals)]) for c in causes
        )
    return WRONG_MODEL


METHODS: dict[str, Callable[[Sequence[Experiment]], str]] = {
    "discrepancy": discrepancy,
    "grey box": grey_box,
    "residuals": residuals,
    "EUCLID": euclid,
    "ours": ours,
}


def judged(truth: str, verdict: str) -> str:
    """right, wrong, or refused: a verdict that names nothing where something is, and says so."""
    if verdict.startswith("asks"):
        return "right" if truth == ASKS else "wrong"
    if verdict in (UNABLE, WRONG_MODEL):
        return "wrong" if truth == CLEAN and verdict == WRONG_MODEL else "refused"
    if verdict == NOTHING:
        return "right" if truth == CLEAN else "wrong"
    named = {n for part in verdict.split("+") for n in part.split(" or ")}
    return "right" if truth in named and "+" not in verdict else "wrong"


def unguarded(folder: Path, kept: Path) -> Sequence[Experiment]:
    """The experiments without our reader's doubt about absolute pressures, which the others do not have."""
    shutil.copytree(folder, kept)
    described = kept / "experiments.toml"
    text = described.read_text()
    if "pressure_hold" in text:
        blocks = [block.rstrip() + '\npressure = "gauge"\n' for block in text.split("[[experiment]]")[1:]]
        described.write_text("".join(f"[[experiment]]{block}" for block in blocks))
    return read_folder(kept).experiments


def main() -> None:
    """Judge every set by every method and print the table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("sets", type=Path)
    parser.add_argument("--only", default="", help="methods, separated by commas")
    parser.add_argument("--folders", default="", help="names of sets, separated by commas")
    options = parser.parse_args()
    chosen = {n: m for n, m in METHODS.items() if not options.only or n in options.only.split(",")}
    totals: dict[str, dict[str, float]] = {n: {} for n in chosen}
    for folder, truth in TRUTHS.items():
        if options.folders and folder not in options.folders.split(","):
            continue
        for name, method in chosen.items():
            began = time.process_time()
            try:
                if name == "ours":
                    verdict = method(read_folder(options.sets / folder).experiments)
                else:
                    with tempfile.TemporaryDirectory() as kept:
                        verdict = method(unguarded(options.sets / folder, Path(kept) / folder))
            except InputError as error:
                verdict = f"asks: {error.what[:60]}"
            except (ArithmeticError, ValueError, np.linalg.LinAlgError) as error:
                verdict = f"ends with {type(error).__name__}"
            seconds = time.process_time() - began
            mark = judged(truth, verdict)
            print(f"| {folder} | {truth} | {name} | {verdict} | {mark} | {seconds:.1f} |", flush=True)
            total = totals[name]
            total[mark] = total.get(mark, 0) + 1
            total["seconds"] = total.get("seconds", 0.0) + seconds
    for name, total in totals.items():
        counts = " | ".join(str(int(total.get(k, 0))) for k in ("right", "wrong", "refused"))
        print(f"| {name} | {counts} | {total.get('seconds', 0.0) / 60.0:.2f} |")


if __name__ == "__main__":
    main()
