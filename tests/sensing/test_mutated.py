"""Damaged streams: no bytes end a recording, every byte is counted, every whole sample is kept."""

from __future__ import annotations

import io
import json
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.sensing.decoder import Decoder
from mu_addon.sensing.framing import framed, info_frame, sample_frame
from mu_addon.sensing.recording import REJECTS, read_recording
from mu_addon.sensing.samples import Samples
from mu_addon.sensing.session import run_session
from mu_addon.sensing.stream import Display, console_summary, status_line

from .mutations import FORMATS, NASTY, decoded, sound
from .test_session import _Scripted

ROOT = Path(__file__).parents[2]


def test_first_labels_damaged_in_two_ways_do_not_hold_back_the_right_one():
    """Of three lines each has another name for the same channel; all that follow have the right one."""
    lines = [b"light:%d,dark:%d\n" % (k, k % 7) for k in range(200)]
    stream = [b"\n", lines[0], b"lght:1,dark:1\n", b"lighT:2,dark:2\n", *lines[3:]]
    for sizes in ([1] * 300, [40, 5000, 5000]):
        decoder, groups, data, at = Decoder(), [], b"".join(stream), 0.0
        for size in [*sizes, len(data)]:
            groups += decoder.feed(data[:size], at)
            data, at = data[size:], at + 0.002
        groups += decoder.finish(at)
        kept = [group for group in groups if group.layout.channels == ("light", "dark")]
        assert [light for group in kept for light in group.values[:, 0].tolist()] == [0, *range(3, 200)]
        assert decoder.counters.malformed == 2


def fed(data: bytes, size: int = 64) -> tuple[Decoder, list[Samples]]:
    decoder, groups = Decoder(), []
    for k in range(0, len(data), size):
        groups += decoder.feed(data[k : k + size], 1e-4 * k)
    groups += decoder.finish(1e-4 * len(data))
    counted = decoder.counters
    assert counted.bytes == len(data)
    assert counted.bytes == (
        counted.read_bytes + counted.rejected_bytes + counted.cut_bytes + counted.overlong
    )
    return decoder, groups


def test_a_damaged_label_among_three_first_lines_is_waited_upon():
    """One of the first three names other channels: with more lines it is seen to be the odd one."""
    lines = [
        b"seq:0,lght:1000,dqpk:0\n",
        *(b"seq:%d,light:%d,dark:%d\n" % (k, k, 7 * k) for k in range(1, 60)),
    ]
    decoder, groups = fed(b"\n" + b"".join(lines), 4)
    kept = [group for group in groups if {"light", "dark"} <= set(group.layout.channels)]
    assert [number for group in kept for number in group.sequence.tolist()] == list(range(1, 60))
    assert decoder.counters.malformed == 1


def test_first_rows_of_two_widths_do_not_hold_back_the_right_ones():
    """Two of the first four rows are joined with another: which width is right the next rows tell."""
    rows = [b"%d,%d\n" % (1000 + k, 7 * k) for k in range(60)]
    damaged = [b"\n", rows[0], b"1001,71002,14\n", b"1003,211004,28\n", *rows[5:]]
    decoder, groups = fed(b"".join(damaged), 4)
    kept = [light for group in groups for light in group.values[:, 0].tolist()]
    assert kept == [1000.0, *(1000.0 + k for k in range(5, 60))]
    assert decoder.counters.malformed == 2


def column(groups: list[Samples], name: str) -> np.ndarray:
    return np.concatenate([g.values[:, g.layout.channels.index(name)] for g in groups])


def numbers(groups: list[Samples]) -> np.ndarray:
    return np.concatenate([g.sequence for g in groups])


@given(st.sampled_from(sorted(FORMATS)), st.integers(0, 10**9), st.sampled_from([0.02, 0.1, 0.3]))
@settings(max_examples=200, deadline=None, derandomize=True)
def test_every_byte_is_counted_and_every_whole_sample_kept(name: str, seed: int, share: float) -> None:
    outcome = decoded(name, seed, samples=80, share=share)
    assert outcome.whole > 10
    assert sound(outcome), (outcome.missing, outcome.unaccounted, outcome.decoder.counters)


@pytest.mark.parametrize("nasty", NASTY)
def test_one_line_ends_no_recording(nasty: bytes, tmp_path: Path) -> None:
    lines = [f"seq:{k},light:{k / 2}\n".encode() for k in range(300)]
    status = run_session(
        _Scripted(b"".join(lines[:150]) + nasty + b"\n" + b"".join(lines[150:])), tmp_path / "r", about={}
    )
    # The very first line is not trusted.
    (recording,) = read_recording(tmp_path / "r")
    assert set(np.arange(1, 300) / 2) <= set(recording.columns["light"])
    rejects = [json.loads(line) for line in (tmp_path / "r" / REJECTS).read_text().splitlines()]
    kept = b"".join(r["raw"].encode("latin-1") for r in rejects if r["why"] not in ("repeated", "new name"))
    assert len(kept) == status["rejected_bytes"] + status["cut_bytes"] + status["overlong"]


def test_before_a_format_is_known_lines_count() -> None:
    lines = b"".join(b"sensor says: %d apples\n" % k for k in range(377))
    decoder, groups = fed(lines)
    assert not groups
    assert decoder.counters.malformed == 377
    assert decoder.counters.rejected_bytes == len(lines)
    html = b"<html>\n" + b"<p class=x>some words</p>\n" * 1173
    decoder, _ = fed(html)
    assert decoder.counters.rejected_bytes == len(html)
    assert decoder.counters.overlong == 0
    assert decoder.complaint is None or "text" in decoder.complaint[0]


def test_noise_and_text_are_said_to_be_that(tmp_path: Path) -> None:
    noise = random.Random(3).randbytes(5000)
    events: list[tuple[str, Any]] = []
    status = run_session(
        _Scripted(noise),
        tmp_path / "noise",
        about={},
        on_event=lambda event, about: events.append((event, about)),
    )
    (words,) = [about for event, about in events if event == "unreadable"]
    assert "wrong baud rate" in words["detail"]
    assert "--baud" in words["what_to_do"]
    shown = console_summary(status)
    assert "nothing lost" not in " ".join(shown)
    assert any("wrong baud rate" in line for line in shown)
    status = run_session(_Scripted(b"hello, this is no sensor!\n" * 100), tmp_path / "text", about={})
    assert "text in an unknown format" in status["complaint"][0]


@pytest.mark.parametrize("turn", [100, 256, 1000, 65536])
def test_a_counter_that_wraps_loses_nothing(turn: int) -> None:
    n = 1000
    first = turn - 300 if turn > 1000 else 0
    decoder, groups = fed(b"\n" + b"".join(b"seq:%d,light:%d\n" % ((first + k) % turn, k) for k in range(n)))
    np.testing.assert_array_equal(column(groups, "light"), np.arange(n))
    np.testing.assert_array_equal(np.diff(numbers(groups)), 1)
    counted = decoder.counters
    assert counted.repeated == counted.lost == counted.restarts == counted.misnumbered == 0


def test_losses_across_a_wrap_are_counted() -> None:
    lines = [b"seq:%d,light:%d\n" % (k % 256, k) for k in range(1000)]
    decoder, groups = fed(b"\n" + b"".join(line for k, line in enumerate(lines) if k not in range(509, 514)))
    assert len(column(groups, "light")) == 995
    assert decoder.counters.lost == 5


def test_a_reset_loses_nothing() -> None:
    runs = [range(700), range(15), range(400)]
    data = b"\n" + b"".join(
        b"seq:%d,time_ms:%d,light:%d\n" % (k, 10 * k, 1000 * r + k) for r, run in enumerate(runs) for k in run
    )
    decoder, groups = fed(data)
    assert decoder.counters.restarts == 2
    assert decoder.counters.repeated == decoder.counters.lost == 0
    assert len(column(groups, "light")) == sum(map(len, runs))
    np.testing.assert_array_equal(np.diff(numbers(groups)), 1)
    assert (np.diff(np.concatenate([g.device_s for g in groups])) >= 0).all()


def test_a_glitched_number_or_clock_is_no_loss() -> None:
    lines = [b"seq:%d,time_ms:%d,light:%d\n" % (k, 10 * k, k) for k in range(300)]
    lines[50] = b"seq:5047,time_ms:500,light:50\n"
    lines[90] = b"seq:3,time_ms:900,light:90\n"
    lines[120] = b"seq:120,time_ms:991200,light:120\n"
    lines[150] = b"seq:150,time_ms:15,light:150\n"
    decoder, groups = fed(b"\n" + b"".join(lines))
    np.testing.assert_array_equal(column(groups, "light"), np.arange(300))
    np.testing.assert_array_equal(numbers(groups), np.arange(300))
    assert decoder.counters.lost == decoder.counters.repeated == decoder.counters.restarts == 0
    assert decoder.counters.misnumbered == 4
    device_s = np.concatenate([g.device_s for g in groups])
    assert np.isnan(device_s).nonzero()[0].tolist() == [120, 150]
    np.testing.assert_allclose(np.delete(device_s, [120, 150]), 0.01 * np.delete(np.arange(300), [120, 150]))


def test_a_number_that_stands_still_loses_nothing() -> None:
    decoder, groups = fed(b"\n" + b"".join(b"seq:7,light:%d\n" % k for k in range(100)))
    assert len(column(groups, "light")) == 100
    assert decoder.counters.lost == decoder.counters.repeated == 0


def test_garbled_labels_are_counted_not_rows_of_nan() -> None:
    lines = [b"light:%d,dark:1\n" % k for k in range(100)]
    lines[20], lines[60] = b"lght:20,dark:1\n", b"lihgt:60,drak:1\n"
    lines[70] = b"light:70\n"
    decoder, groups = fed(b"\n" + b"".join(lines))
    assert decoder.counters.malformed == 2
    assert decoder.counters.incomplete == 1
    rows = np.vstack([g.values for g in groups])
    assert len(rows) == 98
    assert np.isnan(rows).sum() == 1


def test_a_channel_that_comes_to_stay_is_recorded() -> None:
    lines = [b"light:%d,dark:1\n" % k for k in range(50)] + [b"light:1,dark:2,warm:3\n"] * 50
    decoder, groups = fed(b"\n" + b"".join(lines))
    assert groups[-1].layout.channels == ("light", "dark", "warm")
    # Twice it was not believed yet, and said so.
    assert decoder.counters.incomplete == 2
    assert [r.why for r in decoder.rejects] == ["new name"] * 2


def test_an_info_of_any_content() -> None:
    for content in (
        b'{"channels":["a"],"unit_per_count":1' + b"0" * 400 + b"}",
        b"[" * 480,
        b'"\\ud800"',
        b"1",
    ):
        fed(framed(b"\x02" + content) + b"".join(sample_frame(k, k, (k,)) for k in range(20)))


def test_names_that_no_csv_and_no_terminal_should_see(tmp_path: Path) -> None:
    names = ["a,b", "\x1b[2Jx", "line\nbreak", "time_s", "a b", "\ud800", 'quo"te', "x" * 150]
    info = info_frame({"channels": names, "unit": "\x1b]0;mV\x07", "unit_per_count": 1})
    data = info + b"".join(sample_frame(k, 1000 * k, range(len(names))) for k in range(20))
    status = run_session(_Scripted(data), tmp_path / "r", about={})
    (recording,) = read_recording(tmp_path / "r")
    assert len(recording.channels) == len(names)
    assert all(name.isprintable() and "," not in name for name in recording.columns)
    assert status_line(status).isprintable()


def test_what_a_port_calls_itself_moves_no_cursor() -> None:
    out = io.StringIO()
    Display(out)({"event": "connected", "detail": "/dev/ttyACM0 (\x1b]0;owned\x07\x9b2J\u202eboard)"})
    assert out.getvalue() == "connected: /dev/ttyACM0 (\\x1b]0;owned\\x07\\x9b2J\\u202eboard)\n"


COLOURED = {
    "around a label": b"\x1b[32mlight\x1b[0m: %d\t\x1b[1;38;5;208mdark\x1b[m: 1\r\n",
    "around a line": b"\x1b[0;32mlight:%d dark:1\x1b[0m\r\n",
    "after a line": b"light:%d,dark:1\n\x1b[0m",
    "in JSON": b'{"\x1b[36mlight\x1b[39m": \x1b[33m%d\x1b[39m, "dark": 1}\n',
    "in CSV": b"\x1b[38:2::255:0:0m%d\x1b[0m,1\n",
}


@pytest.mark.parametrize("line", COLOURED.values(), ids=list(COLOURED))
def test_colours_are_left_out(line: bytes, tmp_path: Path) -> None:
    data = b"".join(line % k for k in range(100))
    decoder, groups = fed(data, 7)
    # The very first line is not trusted.
    assert set(range(1, 100)) <= set(column(groups, groups[0].layout.channels[0]))
    assert decoder.counters.coloured >= 98
    assert decoder.counters.rejected_bytes == 0
    # Other sequences may move a cursor: what they part need not belong together.
    decoder, _ = fed(data + b"light:1\x1b[5C2,dark:1\n")
    assert decoder.counters.rejected_bytes + decoder.counters.cut_bytes >= 24
    shown = console_summary(run_session(_Scripted(data), tmp_path / "r", about={}))
    assert any("colour codes" in words and words.isprintable() for words in shown)


def test_coloured_text_of_no_format_is_not_noise() -> None:
    decoder, _ = fed(b"\x1b[32mhello\x1b[0m \x1b[31mthere\x1b[0m\n" * 60)
    assert decoder.counters.rejected_bytes > 1500
    decoder = Decoder()
    decoder.feed(b"\x1b[32mhello\x1b[0m \x1b[31mthere\x1b[0m\n" * 60, 0.0)
    assert decoder.complaint is not None
    assert "text" in decoder.complaint[0]
