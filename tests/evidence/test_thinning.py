"""Long records: read as numbers alone, judged by means of their rows."""

from pathlib import Path

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.evidence.diagnosis import diagnose
from mu_addon.evidence.prediction.bench import bench_simulators
from mu_addon.evidence.simulator import Composite
from mu_addon.evidence.thinning import MOST, thinned
from mu_addon.measured import table
from mu_addon.measured.kinds import KINDS
from mu_addon.measured.table import read_table
from tests.evidence import bench

HOLD = KINDS["pressure_hold"]


def written(rows, comment="", middle=None):
    t = np.linspace(0.0, 100.0, rows)
    lines = [f"{a:.4f},{b:.3f}" for a, b in zip(t, 100.0 + np.cos(t), strict=True)]
    if middle is not None:
        lines[rows // 2] = middle
    return comment + "time_s,pressure_kPa\n" + "\n".join(lines) + "\n"


@pytest.mark.parametrize("comment", ["", "# read by hand\n\n# twice\n"])
def test_a_long_table_is_read_as_any_other(monkeypatch, comment):
    text = written(3000, comment)
    slow = read_table(text, HOLD, Path("a.csv"))
    monkeypatch.setattr(table, "LONG", 0)
    monkeypatch.setattr(table, "_lines", lambda *_: pytest.fail("read cell by cell"))
    fast = read_table(text, HOLD, Path("a.csv"))
    np.testing.assert_array_equal(fast.rows, slow.rows)
    for name, values in slow.columns.items():
        np.testing.assert_array_equal(fast.columns[name], values)


@pytest.mark.parametrize(
    "cell", ["1,x", "1,2,3", "1,1e400", "1,1e30", "1.2.3,5", "50.0,", "50.0,#", '"50",1']
)
def test_what_is_wrong_in_a_long_table_is_told_with_its_row(monkeypatch, cell):
    text = written(3000, middle=cell)
    expected = found = ""
    try:
        read_table(text, HOLD, Path("a.csv"))
    except InputError as error:
        expected = str(error)
    monkeypatch.setattr(table, "LONG", 0)
    try:
        read_table(text, HOLD, Path("a.csv"))
    except InputError as error:
        found = str(error)
    assert found == expected


def test_means_of_rows_are_exact_for_what_is_linear_and_skip_what_is_missing():
    n = 5 * MOST + 3
    t = np.arange(n) * 0.01
    read = 3.0 * t + 1.0
    read[1207] = np.nan
    e = bench.experiment("pressure_hold", {"time_s": t, "pressure_kPa": read})
    simulator = Composite({"pressure_hold": bench_simulators([e])["pressure_hold"]})
    (found,), (words,) = thinned([e], simulator)
    assert len(found) <= MOST
    assert "means of 6" in words
    whole = np.ones(len(found), bool)
    whole[201] = False
    np.testing.assert_allclose(found["pressure_kPa"][whole], 3.0 * found["time_s"][whole] + 1.0, rtol=1e-12)
    assert found["pressure_kPa"][201] == pytest.approx(
        3.0 * 0.01 * np.mean([1206, 1208, 1209, 1210, 1211]) + 1.0
    )
    # On the steps of a display nothing is averaged: a mean would lie where none reads.
    steps = bench.experiment("pressure_hold", {"time_s": t, "pressure_kPa": np.round(t / 50.0) * 0.5})
    (found,), (words,) = thinned([steps], simulator)
    assert set(np.unique(found["pressure_kPa"])) <= set(np.unique(steps["pressure_kPa"]))
    assert "every 6th" in words
    # What is short stays as it is.
    short = bench.experiment("pressure_hold", {"time_s": t[:100], "pressure_kPa": read[100:200]})
    assert thinned([short], simulator) == ([short], [])


@pytest.mark.nightly("test_means_of_rows_are_exact_for_what_is_linear_and_skip_what_is_missing")
def test_a_leak_in_long_records_has_an_interval_as_their_noise_allows():
    """Two holds of 60 000 readings, 0.3 kPa of white noise: the leak is known to 1 %, without a bias."""
    rng, t = np.random.default_rng(5), np.linspace(0.0, 4000.0, 60_000)
    experiments = [
        bench.experiment(
            "pressure_hold",
            {
                "time_s": t,
                "pressure_kPa": bench.held(t, p, loss_per_s=4e-5) + rng.normal(0, 0.3, len(t)),
            },
            name=f"hold {p:g}",
        )
        for p in (150.0, 80.0)
    ]
    verdict = diagnose(experiments, Composite(dict(bench_simulators(experiments))))
    assert verdict.kind == "named"
    assert verdict.names == ("leak",)
    low, high = verdict.intervals["leak.loss_per_s"]
    assert low < 4e-5 < high
    assert high - low < 0.01 * 4e-5
