"""Files are whole or not there, and a failure to write says what to do."""

import errno
import json
import os
import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mu_addon import files
from mu_addon.errors import OutputError


def test_writes_and_replaces(tmp_path):
    path = tmp_path / "new" / "a.txt"
    files.write_text(path, "first")
    files.write_text(path, "second µ\n")
    assert path.read_bytes() == "second µ\n".encode()
    assert os.listdir(path.parent) == ["a.txt"]


def test_a_reader_never_sees_half(tmp_path):
    path = tmp_path / "a.txt"
    files.write_text(path, "old and whole")
    with path.open() as reader:
        files.write_text(path, "new")
        assert reader.read() == "old and whole"


@pytest.mark.parametrize(
    ("number", "advice"),
    [
        (errno.ENOSPC, "free some space"),
        (errno.EDQUOT, "quota"),
        (errno.EACCES, "permissions"),
        (errno.EROFS, "read-only"),
        (errno.EIO, "fault"),
    ],
)
def test_failure_says_what_where_and_what_to_do(tmp_path, monkeypatch, number, advice):
    path = tmp_path / "a.csv"
    files.write_text(path, "old")

    def fail(_):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OutputError) as caught:
        files.write_csv(path, ["x"], [(1,)])
    assert "cannot write a.csv: " + os.strerror(number) == caught.value.what
    assert caught.value.where == str(path)
    assert advice in caught.value.remedy
    assert path.read_text() == "old"
    assert os.listdir(tmp_path) == ["a.csv"]


def test_a_file_in_the_way_of_a_folder(tmp_path):
    (tmp_path / "out").write_text("")
    for write in (lambda p: files.write_text(p / "a", "x"), files.make_folder):
        with pytest.raises(OutputError) as caught:
            write(tmp_path / "out")
        assert caught.value.remedy


def test_an_interrupt_leaves_the_old_file(tmp_path):
    path = tmp_path / "a.bin"
    files.write_bytes(path, b"old")
    with pytest.raises(KeyboardInterrupt), files.replacing(path) as beside:  # noqa: PT012
        beside.write_bytes(b"half")
        raise KeyboardInterrupt
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == ["a.bin"]


def test_csv_keeps_every_digit(tmp_path):
    values = np.random.default_rng(1).standard_normal(20)
    files.write_csv(tmp_path / "a.csv", ["name", "x_mm"], [("a,b", v) for v in values])
    lines = (tmp_path / "a.csv").read_text().splitlines()
    assert lines[0] == "name,x_mm"
    assert [float(line.rsplit(",", 1)[1]) for line in lines[1:]] == values.tolist()


def test_equal_arrays_make_equal_npz_bytes(tmp_path, monkeypatch):
    arrays = {"a": np.arange(5), "b": np.eye(3)}
    files.write_npz(tmp_path / "a.npz", arrays)
    monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(2e9))
    monkeypatch.setattr(time, "time", lambda: 2e9)
    files.write_npz(tmp_path / "b.npz", arrays)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()
    assert np.array_equal(np.load(tmp_path / "a.npz")["b"], np.eye(3))


trees = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner) | st.tuples(inner, inner),
    max_leaves=8,
)


@given(trees)
def test_plain_is_strict_json(tree):
    text = json.dumps(files.plain(tree), allow_nan=False)
    assert files.plain(json.loads(text)) == json.loads(text)


def test_plain_takes_numpy_and_refuses_the_unknown(tmp_path):
    tree = {"a": np.float64("nan"), "b": np.array([1, 2]), 3: (np.int64(4), tmp_path), "c": np.bool_(True)}
    assert files.plain(tree) == {"a": None, "b": [1, 2], "3": [4, str(tmp_path)], "c": True}
    with pytest.raises(TypeError):
        files.plain(object())
