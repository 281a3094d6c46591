"""A run's folder: what is known of it, whenever its beginning was stopped."""

import pytest

from mu_addon.errors import OutputError
from mu_addon.run import folder as run_folder
from mu_addon.run.folder import FolderLayout, claim, same_inputs

HEADER = "# inputs of a test"
LAYOUT = FolderLayout("run.toml", HEADER, ("result.csv",))
INPUTS = {"run.toml": f"{HEADER}\n", "unit.toml": "scale = 1\n", "protocol.csv": "time_s\n0\n"}


@pytest.mark.parametrize("writes", range(len(INPUTS)))
def test_a_beginning_that_was_stopped_is_none_and_can_be_made_again(tmp_path, monkeypatch, writes):
    """After any number of files, but not all, the folder is no run's; the same inputs then make it one."""
    left = iter(range(writes))
    write = run_folder.write_text

    def stops(path, text):
        if next(left, None) is None:
            raise OutputError("stopped", str(path), "begin again")
        write(path, text)

    monkeypatch.setattr(run_folder, "write_text", stops)
    with pytest.raises(OutputError):
        claim(tmp_path, LAYOUT, INPUTS)
    assert len(list(tmp_path.iterdir())) == writes
    assert not LAYOUT.is_of(tmp_path)
    monkeypatch.undo()
    claim(tmp_path, LAYOUT, INPUTS)
    assert LAYOUT.is_of(tmp_path)
    assert same_inputs(tmp_path, INPUTS)
    assert not (tmp_path / "stale").exists()
