"""Experiments come in the order they were made, wherever they stand in the file."""

import pytest

from mu_addon.errors import InputError
from mu_addon.evidence.prediction.unit_pressure import pressure_histories
from mu_addon.measured import read_folder

CSV = "time_s,pressure_kPa,angle_deg\n0,0,0\n1,10,3\n2,20,7\n3,{peak},8\n"


def folder(place, orders):
    """A folder whose k-th experiment has the k-th order (None: not given), and a peak of 30 + k kPa."""
    lines = []
    for k, order in enumerate(orders):
        (place / f"run{k}.csv").write_text(CSV.format(peak=30 + k))
        lines += ["[[experiment]]", f'name = "run {k}"', 'kind = "unit_pressure"', f'file = "run{k}.csv"']
        lines += ['role = "fit"', *([f"run_order = {order}"] if order is not None else []), ""]
    (place / "experiments.toml").write_text("\n".join(lines))
    return place


def test_without_run_order_the_file_s_order_is_taken(tmp_path):
    found = read_folder(folder(tmp_path, [None, None, None])).experiments
    assert [e.name for e in found] == ["run 0", "run 1", "run 2"]


def test_run_order_decides_what_a_specimen_remembers(tmp_path):
    found = read_folder(folder(tmp_path, [30, 10.5, -2])).experiments
    assert [e.name for e in found] == ["run 2", "run 1", "run 0"]
    past = pressure_histories(found)
    assert [past[f"run {k}"].peak_kPa for k in (2, 1, 0)] == [0.0, 32.0, 32.0]


def test_equal_orders_stay_as_they_stand(tmp_path):
    found = read_folder(folder(tmp_path, [1, 0, 1])).experiments
    assert [e.name for e in found] == ["run 1", "run 0", "run 2"]


@pytest.mark.parametrize("orders", [[1, None], ["'first'", "'second'"], ["nan", 1]])
def test_a_run_order_for_some_or_that_is_no_number_is_refused(tmp_path, orders):
    with pytest.raises(InputError, match="run_order") as raised:
        read_folder(folder(tmp_path, orders))
    assert "experiments.toml" in str(raised.value)
