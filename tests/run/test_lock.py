"""Two processes never work in one folder, and a holder that was killed leaves nothing behind."""

import os
import subprocess
import sys

import pytest

from mu_addon.errors import OutputError
from mu_addon.run.context import run_to_end
from mu_addon.run.folder import FolderLayout, begin
from mu_addon.run.lock import LOCK, FolderLock, InUseError
from mu_addon.run.progress import Progress

LAYOUT = FolderLayout("a.toml", "# mine", ())

HOLD = """
import sys
from pathlib import Path
from mu_addon.run.lock import FolderLock

lock = FolderLock(Path(sys.argv[1]))
print("held", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def holder(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", HOLD, str(tmp_path)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert process.stdout.readline() == "held\n"
    yield process
    process.kill()
    process.communicate()


def test_the_holder_is_named(tmp_path, holder):
    with pytest.raises(InUseError) as caught:
        FolderLock(tmp_path)
    assert f"process {holder.pid} on " in caught.value.what
    assert caught.value.where == str(tmp_path)
    assert "choose another folder" in caught.value.remedy


def test_a_killed_holder_leaves_the_folder_free(tmp_path, holder):
    holder.kill()
    holder.wait()
    FolderLock(tmp_path).release()


def test_whatever_the_file_says_only_the_system_decides(tmp_path, holder):
    """Neither a process number that lives again nor a clock set back can lock or unlock a folder."""
    (tmp_path / LOCK).write_text('{"process": 1, "machine": "elsewhere", "since": "2199-01-01 00:00:00"}')
    with pytest.raises(InUseError, match="process 1 on elsewhere, since 2199"):
        FolderLock(tmp_path)
    (tmp_path / LOCK).write_bytes(b"\xff{not ours")
    with pytest.raises(InUseError, match="it has just started"):
        FolderLock(tmp_path)
    holder.communicate("")
    (tmp_path / LOCK).write_text(f'{{"process": {os.getpid()}, "machine": "here", "since": "now"}}')
    FolderLock(tmp_path).release()


def test_one_process_cannot_take_a_folder_twice(tmp_path):
    lock = FolderLock(tmp_path)
    with pytest.raises(InUseError, match=f"process {os.getpid()} "):
        FolderLock(tmp_path)
    lock.release()
    lock.release()
    FolderLock(tmp_path).release()


def test_a_lock_that_is_a_link_is_not_followed(tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / LOCK).symlink_to(victim)
    with pytest.raises(OutputError, match="link"):
        FolderLock(folder)
    assert victim.read_text() == "precious"


def test_a_run_in_a_folder_in_use_ends_and_touches_nothing(tmp_path, holder):
    before = sorted(path.name for path in tmp_path.iterdir())
    messages = []
    with run_to_end(Progress([messages.append])) as context:
        begin(context, tmp_path, LAYOUT, {"a.toml": "# mine\n"})
    assert context.status == 2
    assert "another run uses this folder" in messages[-1]["what"]
    assert sorted(path.name for path in tmp_path.iterdir()) == before


def test_a_run_gives_its_folder_free_however_it_ends(tmp_path):
    for fault in (None, RuntimeError, KeyboardInterrupt):
        with run_to_end(Progress()) as context:
            begin(context, tmp_path, LAYOUT, {"a.toml": "# mine\n"})
            if fault is not None:
                raise fault
        FolderLock(tmp_path).release()


def test_a_disk_without_locks_is_warned_of(tmp_path, monkeypatch):
    fcntl = pytest.importorskip("fcntl")

    def none(*_):
        raise OSError(95, "Operation not supported")

    monkeypatch.setattr(fcntl, "flock", none)
    messages = []
    with run_to_end(Progress([messages.append])) as context:
        begin(context, tmp_path, LAYOUT, {"a.toml": "# mine\n"})
    assert context.status == 0
    assert any(m["type"] == "warning" and "does not support file locks" in m["what"] for m in messages)
