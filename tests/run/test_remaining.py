"""What a run that goes on has left to do."""

import pytest

from mu_addon.errors import MuError
from mu_addon.run.progress import Progress, log_file
from mu_addon.run.progress_estimate import LOADED_S, remaining, shares_done

PLAN = (("mesh", 10.0), ("Model A", 100.0), ("report", 20.0))


def test_what_the_cache_has_counts_next_to_nothing(tmp_path):
    progress = Progress([log_file(tmp_path / "log.ndjson")])
    with progress.stage("mesh"):
        pass
    with pytest.raises(MuError), progress.stage("Model A"):  # noqa: PT012
        progress.update(0.6)
        raise MuError("stopped")
    with (tmp_path / "log.ndjson").open("a") as log:
        log.write('no message\n{"type": "progress", "stage": "Model A", "fraction": 0.')
    done = shares_done(tmp_path)
    assert done == {"mesh": 1.0, "Model A": 0.6}
    left = remaining(PLAN, done | {"report": 1.0}, ("mesh", "Model"))
    assert left == [("mesh", LOADED_S), ("Model A", pytest.approx(40.0)), ("report", 20.0)]


def test_nothing_is_left_out_where_nothing_ran(tmp_path):
    assert shares_done(tmp_path / "none") == {}
    assert remaining(PLAN, {}, ("mesh",)) == [*PLAN]
    assert remaining(PLAN, {"mesh": 1.0}, ()) == [*PLAN]
