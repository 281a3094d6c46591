"""A study's folder from a stranger: nothing in it is run, followed out of it, or believed about its size."""

import io
import os
import pickle
import time
import zipfile

import numpy as np
import pytest

from mu_addon.errors import InputError
from mu_addon.files import read_npz, write_npz
from mu_addon.run.cache import Cache, key
from mu_addon.run.context import run_to_end
from mu_addon.run.folder import FolderLayout, begin
from mu_addon.run.progress import Progress

HEADER = "# mine"


class Bomb:
    """What pickle would run on reading it."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (os.mkdir, (str(self.path),))


def npy(header, data=b""):
    """Bytes of an .npy file of format 1.0 with a header of one's own."""
    text = header.encode() + b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text + data


def archive(path, **members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as stream:
        for name, data in members.items():
            stream.writestr(name.replace("__", "/") + ".npy", data)
    return path


def test_an_array_of_objects_is_not_unpickled(tmp_path):
    trap = tmp_path / "sprung"
    stream = io.BytesIO()
    np.save(stream, np.array([Bomb(trap)], dtype=object), allow_pickle=True)
    assert read_npz(archive(tmp_path / "a.npz", u=stream.getvalue())) is None
    # A bare pickle in place of the archive.
    (tmp_path / "b.npz").write_bytes(pickle.dumps(Bomb(trap)))
    assert read_npz(tmp_path / "b.npz") is None
    assert not trap.exists()


@pytest.mark.parametrize(
    ("numbers", "bytes_there"),
    [(1_250_000_000, 800), (37_500_000, 300_000_000)],
    ids=["ten gigabytes in a header", "a zip bomb that a limit on what real entries need lets pass"],
)
def test_a_small_file_does_not_take_gigabytes(tmp_path, numbers, bytes_there):
    claim = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({numbers},), }}"
    path = archive(tmp_path / "a.npz", u=npy(claim, bytes(bytes_there)))
    assert path.stat().st_size < 300_000
    assert _peak_of(path) < 50e6


def _peak_of(path):
    """Bytes that a process sets aside to read a file that must come back as missing."""
    import tracemalloc

    tracemalloc.start()
    try:
        assert read_npz(path) is None
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def test_the_search_for_memory_can_find_it(tmp_path):
    """numpy itself believes such a header, and fails only after it has set the memory aside."""
    import tracemalloc

    claim = "{'descr': '<f8', 'fortran_order': False, 'shape': (12500000,), }"
    path = archive(tmp_path / "a.npz", u=npy(claim, b"\0" * 800))
    tracemalloc.start()
    with pytest.raises(ValueError, match="EOF"), np.load(path) as stored:
        stored["u"]
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak > 90e6


def test_an_archive_that_unpacks_to_more_than_it_may_is_missing(tmp_path):
    write_npz(tmp_path / "a.npz", {"u": np.zeros(3_000_000)})
    assert (tmp_path / "a.npz").stat().st_size < 100_000
    assert read_npz(tmp_path / "a.npz", most_bytes=20_000_000) is None
    assert read_npz(tmp_path / "a.npz")["u"].shape == (3_000_000,)


@pytest.mark.parametrize(
    "header",
    [
        "{'descr': '<f8', 'fortran_order': False, 'shape': (-1,), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2), }",
        "{'descr': 'O', 'fortran_order': False, 'shape': (1,), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': __import__('os').getcwd(), }",
        "{'descr': '<f8', 'fortran_order': False, 'shape': " + "(" * 400 + ")" * 400 + ", }",
        "",
    ],
)
def test_a_strange_header_makes_it_missing(tmp_path, header):
    assert read_npz(archive(tmp_path / "a.npz", u=npy(header, b"\0" * 8))) is None


def test_names_that_climb_out_are_only_names(tmp_path):
    good = npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1,), }", b"\0" * 8)
    folder = tmp_path / "a" / "b"
    folder.mkdir(parents=True)
    assert list(read_npz(archive(folder / "a.npz", **{"..__..__u": good}))) == ["../../u"]
    assert [p.name for p in tmp_path.rglob("*")] == ["a", "b", "a.npz"]


def test_every_flipped_bit_and_every_cut_is_found_out_or_harmless(tmp_path):
    """Every bit of a whole file of the cache, one by one, and every length: a sum over each array tells."""
    cache = Cache(tmp_path)
    expected = {"u": np.random.default_rng(0).standard_normal(6), "pressure_MPa": np.array(0.02)}
    cache.put("state", "a", expected)
    path = cache.path("state", "a")
    whole, missing = path.read_bytes(), 0

    def read(damaged):
        path.write_bytes(damaged)
        found = cache.get("state", "a")
        for name, values in (found or {}).items():
            np.testing.assert_array_equal(values, expected[name])
        return found

    for place in range(len(whole)):
        assert read(whole[:place]) is None
        for bit in range(8):
            damaged = bytearray(whole)
            damaged[place] ^= 1 << bit
            missing += read(damaged) is None
    assert missing > 0.6 * 8 * len(whole)


def started(folder, results=("a.csv", "model_a")):
    messages = []
    with run_to_end(Progress([messages.append])) as context:
        begin(context, folder, FolderLayout("mine.toml", HEADER, results), {"mine.toml": HEADER + "\n"})
    return context, messages


@pytest.mark.parametrize(
    "name", ["log.ndjson", "summary.json", "mine.toml", "a.csv", "model_a", "cache", "stale"]
)
def test_a_link_under_a_name_of_ours_is_refused(tmp_path, name):
    victim = tmp_path / "victim"
    victim.write_text("precious")
    folder = tmp_path / "out"
    folder.mkdir()
    (folder / name).symlink_to(victim)
    context, messages = started(folder)
    assert context.status == 2
    assert f"{name} in the folder is a link to another location" in messages[-1]["what"]
    assert victim.read_text() == "precious"


def test_a_link_that_leads_nowhere_yet_is_refused(tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "log.ndjson").symlink_to(tmp_path / "new")
    assert started(tmp_path / "out")[0].status == 2
    assert not (tmp_path / "new").exists()


def test_a_folder_that_is_a_link_itself_is_the_users_own_choice(tmp_path):
    (tmp_path / "disk").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "disk")
    assert started(tmp_path / "out")[0].status == 0
    assert (tmp_path / "disk" / "mine.toml").is_file()


def test_measured_data_of_elsewhere_are_not_read(tmp_path):
    from mu_addon.measured.folder import read_folder

    (tmp_path / "secret.csv").write_text("time_s,pressure_kPa\n0,0\n")
    folder = tmp_path / "data"
    folder.mkdir()
    for file in ("../secret.csv", str(tmp_path / "secret.csv")):
        (folder / "experiments.toml").write_text(
            f'[[experiment]]\nname = "a"\nkind = "pressure_hold"\nfile = "{file}"\nrole = "fit"\n'
        )
        with pytest.raises(InputError, match="folder"):
            read_folder(folder)


def test_reading_takes_no_time_worth_an_attack(tmp_path):
    """A thousand members of a kilobyte, each claiming a gigabyte."""
    claim = npy("{'descr': '<f8', 'fortran_order': False, 'shape': (125000000,), }", b"\0" * 64)
    path = archive(tmp_path / "a.npz", **{f"u{i}": claim for i in range(1000)})
    start = time.process_time()
    assert read_npz(path) is None
    assert time.process_time() - start < 5


def test_what_shrinks_as_far_is_written_so_that_it_can_be_read(tmp_path):
    write_npz(tmp_path / "a.npz", {"u": np.zeros(12_000_000)})
    assert read_npz(tmp_path / "a.npz")["u"].shape == (12_000_000,)
    cache = Cache(tmp_path)
    cache.put("state", "a", {"u": np.zeros((4_000_000, 3))})
    assert cache.get("state", "a")["u"].shape == (4_000_000, 3)


def test_an_entry_is_sealed_without_a_copy(tmp_path):
    import tracemalloc

    values = np.random.default_rng(0).random(2_000_000)
    tracemalloc.start()
    key(values)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e6
