"""The decoder on every format, on noise, cut lines and wrapped clocks: nothing lost unseen, never a crash."""

from __future__ import annotations

import json
import random
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mu_addon.errors import MuError
from mu_addon.sensing.decoder import Decoder
from mu_addon.sensing.framing import info_frame, sample_frame
from mu_addon.sensing.recording import Recorder, read_recording
from mu_addon.sensing.samples import Samples
from mu_addon.sensing.stream import require_samples

INFO = info_frame({"channels": ["light", "dark"], "unit": "V", "unit_per_count": 0.001})


def fed(decoder: Decoder, data: bytes, sizes: list[int] | None = None, start_s: float = 0.0) -> list[Samples]:
    """Feed in pieces of given sizes, over and over, a millisecond apart."""
    result, place, turn = [], 0, 0
    sizes = sizes or [64]
    while place < len(data):
        size = max(1, sizes[turn % len(sizes)])
        result += decoder.feed(data[place : place + size], start_s + 1e-3 * turn)
        place, turn = place + size, turn + 1
    return [*result, *decoder.finish(start_s + 1e-3 * turn)]


def all_of(groups: list[Samples], what: str) -> np.ndarray:
    return np.concatenate([getattr(g, what) for g in groups]) if groups else np.empty(0)


def frames(n: int, first: int = 0, period_us: int = 200, start_us: int = 0) -> bytes:
    return b"".join(
        sample_frame(first + k, start_us + period_us * k, ((first + k) % 60000, 7)) for k in range(n)
    )


@given(st.lists(st.integers(1, 300), min_size=1, max_size=5))
@settings(max_examples=30)
def test_frames_come_through_however_they_are_cut(sizes: list[int]) -> None:
    decoder = Decoder()
    groups = fed(decoder, INFO + frames(400), sizes)
    assert decoder.format == "frames"
    assert {g.layout.channels for g in groups} == {("light", "dark")}
    # The very first frame was INFO; it was whole and passed its check, so nothing is lost.
    np.testing.assert_array_equal(all_of(groups, "sequence"), np.arange(400))
    np.testing.assert_allclose(all_of(groups, "values")[:, 0], 0.001 * np.arange(400))
    np.testing.assert_allclose(all_of(groups, "device_s"), 2e-4 * np.arange(400), atol=1e-12)
    assert decoder.counters.lost == decoder.counters.crc_errors == 0


def test_names_that_come_late_hold_for_what_came_before() -> None:
    groups = fed(Decoder(), frames(100) + INFO + frames(100, 100, start_us=20_000))
    assert {g.layout.channels for g in groups} == {("light", "dark")}
    assert len(all_of(groups, "sequence")) == 200


def test_a_device_that_never_says_its_names() -> None:
    decoder = Decoder()
    groups = fed(decoder, frames(4000))
    assert {g.layout.channels for g in groups} == {("channel1", "channel2")}
    assert len(all_of(groups, "sequence")) == 4000


def test_lost_and_damaged_frames_are_counted() -> None:
    parts = [sample_frame(k, 200 * k, (k, 7)) for k in range(300)]
    damaged = bytearray(parts[100])
    damaged[4] ^= 0x55
    if 0 in damaged[:-1]:
        damaged[4] ^= 0x57
    line = INFO + b"".join(parts[:100]) + bytes(damaged) + b"".join(parts[101:200] + parts[205:])
    decoder = Decoder()
    groups = fed(decoder, line)
    assert decoder.counters.crc_errors == 1
    assert decoder.counters.lost == 1 + 5
    assert decoder.counters.samples == len(all_of(groups, "sequence")) == 300 - 6
    assert (np.diff(all_of(groups, "sequence")) > 0).all()


def test_repeated_and_late_frames_are_left_out() -> None:
    parts = [sample_frame(k, 200 * k, (k, 7)) for k in range(50)]
    decoder = Decoder()
    order = [*range(20), 10, 19, *range(20, 50)]
    groups = fed(decoder, INFO + b"".join(parts[k] for k in order))
    np.testing.assert_array_equal(all_of(groups, "sequence"), np.arange(50))
    assert decoder.counters.repeated == 2


def test_clock_and_number_wrap() -> None:
    decoder = Decoder()
    start = 2**32 - 20_000
    line = b"".join(sample_frame(2**32 - 100 + k, start + 200 * k, (k, 7)) for k in range(200))
    groups = fed(decoder, INFO + line)
    np.testing.assert_array_equal(np.diff(all_of(groups, "sequence")), 1)
    np.testing.assert_allclose(np.diff(all_of(groups, "device_s")), 2e-4, atol=1e-9)
    assert decoder.counters.lost == decoder.counters.restarts == 0


@pytest.mark.parametrize(
    ("name", "tick_s"), [("time_us", 1e-6), ("micros", 1e-6), ("t_ms", 1e-3), ("millis", 1e-3)]
)
def test_a_clock_in_text_begins_again_after_32_bits(name: str, tick_s: float) -> None:
    ticks = [(2**32 - 300 + 10 * k) % 2**32 for k in range(60)]
    groups = fed(Decoder(), "".join(f"light:{k},{name}:{t}\n" for k, t in enumerate(ticks)).encode())
    np.testing.assert_allclose(np.diff(all_of(groups, "device_s")), 10 * tick_s, rtol=1e-6)


def test_turns_missed_while_unplugged_are_counted_by_the_host() -> None:
    decoder = Decoder()
    before = fed(decoder, INFO + frames(50))
    decoder.interrupted()
    away_s = 3 * 2**32 * 1e-6 + 100.0
    after = fed(decoder, frames(50, 5000, start_us=round(away_s * 1e6) % 2**32), start_s=away_s)
    gap = all_of(after, "device_s")[0] - all_of(before, "device_s")[-1]
    assert gap == pytest.approx(away_s, abs=0.1)


def test_a_device_that_starts_anew() -> None:
    decoder = Decoder()
    fed(decoder, INFO + frames(5000, 10_000, start_us=2_000_000))
    decoder.interrupted()
    groups = fed(decoder, INFO + frames(300), start_s=5.0)
    assert decoder.counters.restarts == 1
    assert len(all_of(groups, "sequence")) == 300
    assert (np.diff(all_of(groups, "sequence")) == 1).all()


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("labels", "light:{0},dark:7.5\n"),
        ("labels", "light:{0}\ndark:7.5\n"),
        ("labels", "light: {0}\tdark: 7.5\r\n"),
        ("json", '{{"light": {0}, "dark": 7.5, "note": "x"}}\n'),
        ("csv", "{0},7.5\n"),
        ("csv", "{0} 7.5\r\n"),
        ("csv", "{0};7.5\n"),
        ("csv", "{0},7.5,\n"),
        ("csv", "({0}, 7.5)\r\n"),
        ("csv", "[{0}, 7.5]\r\n"),
        ("csv", "{0} | 7.5\n"),
        ("labels", "light:\t{0}\t| dark:\t7.5\r\n"),
    ],
)
def test_text_is_told_apart(name: str, line: str) -> None:
    decoder = Decoder()
    groups = fed(decoder, "".join(line.format(k) for k in range(60)).encode(), [13])
    assert decoder.format == name
    values = np.vstack([g.values for g in groups])
    expected = ("channel1", "channel2") if name == "csv" else ("light", "dark")
    # A label a line begins with whichever comes whole.
    assert set(groups[0].layout.channels) == set(expected)
    light = values[:, groups[0].layout.channels.index(expected[0])]
    assert len(light) >= 58
    # The last label may be missing from the last sample.
    np.testing.assert_array_equal(np.diff(light[:-1]), 1)
    assert decoder.counters.malformed == 0


def test_two_rows_run_into_one_are_no_new_columns() -> None:
    rows = [f"{10 * k},{k},7.5" for k in range(60)]
    rows[30:32] = [rows[30] + rows[31]]
    groups = fed(Decoder(), ("time_ms,light,dark\n" + "\n".join(rows) + "\n").encode())
    assert {group.layout.channels for group in groups} == {("light", "dark")}
    assert sum(len(group.values) for group in groups) == 58


def test_csv_with_header_number_and_clock() -> None:
    rows = "".join(f"{k},{(2**32 - 30_000 + 1000 * k) % 2**32},{k / 10}\n" for k in range(100))
    decoder = Decoder()
    groups = fed(decoder, ("seq,time_us,light\n" + rows).encode())
    assert groups[0].layout.channels == ("light",)
    np.testing.assert_array_equal(all_of(groups, "sequence"), np.arange(100))
    np.testing.assert_allclose(np.diff(all_of(groups, "device_s")), 1e-3, atol=1e-9)


def test_the_first_line_is_not_trusted() -> None:
    # "2,300" is the rest of "512,300".
    decoder = Decoder()
    groups = fed(decoder, b"2,300\n512,300\n513,300\n514,300\n515,300\n")
    np.testing.assert_array_equal(all_of(groups, "values")[:, 0], [512, 513, 514, 515])


def test_garbage_between_lines_is_counted_and_passed() -> None:
    generator = random.Random(1)
    lines = [f"light:{k},dark:1\n".encode() for k in range(200)]
    lines.insert(50, bytes(generator.randrange(256) for _ in range(40)).replace(b"\n", b"x") + b"\n")
    lines.insert(90, b"light:,dark:\n")
    lines.insert(120, b"ligh\xffht:3,dark:1\n")
    decoder = Decoder()
    groups = fed(decoder, b"".join(lines))
    assert decoder.counters.malformed == 3
    assert len(all_of(groups, "values")) == 199


def test_a_device_that_changes_its_language() -> None:
    decoder = Decoder()
    text = "".join(f"light:{k},dark:1\n" for k in range(100)).encode()
    groups = fed(decoder, text + INFO + frames(2000))
    assert decoder.format == "frames"
    assert len(groups[-1].values) > 0
    assert len(all_of(groups, "sequence")) > 1800


def test_a_megabyte_without_an_end_is_thrown_away() -> None:
    for start in (b"", INFO + frames(20), b"light:1,dark:2\n" * 20):
        decoder = Decoder()
        fed(decoder, start + b"\x41" * 2**20, [4096])
        assert len(decoder._buffer) < 20_000
        assert decoder.counters.overlong > 2**20 - 40_000
        groups = fed(decoder, b"\n\x00" + INFO + frames(3000), start_s=10.0)
        assert sum(len(g) for g in groups) > 2000


def test_a_line_longer_than_any_sensor_s_is_refused_unread() -> None:
    decoder = Decoder()
    fed(decoder, b"light:1\n" * 60 + b"light:" + b" " * 5000 + b"2\n", [64, 20_000])
    assert (decoder.counters.malformed, decoder.counters.samples) == (1, 59)


def test_host_time_follows_the_least_delayed() -> None:
    generator = np.random.default_rng(4)
    decoder = Decoder()
    decoder.feed(INFO, 0.0)
    drift, offset = 80e-6, 12.5
    error, host_s = [], []
    for k in range(4000):
        device_s = 0.01 * k
        true_host = offset + device_s * (1 + drift)
        at = true_host + 0.001 + generator.exponential(0.02)
        for samples in decoder.feed(sample_frame(k, round(device_s * 1e6), (k, 1)), at):
            error.append(samples.host_s[-1] - true_host)
            host_s += samples.host_s.tolist()
    assert np.diff(host_s).min() > 0
    # The least delay remains, as no clock can tell it from the offset.
    assert np.median(error[1000:]) == pytest.approx(0.001, abs=0.001)
    assert np.ptp(error[1000:]) < 0.004


@given(st.floats(0.0, 1e6), st.integers(0, 10**9))
@settings(max_examples=30)
def test_samples_of_one_instant_have_rising_times_in_the_file(start_s: float, later: int) -> None:
    # Half of the last digit after the start: rounding errors decide which way each time is rounded.
    groups = fed(Decoder(), b"1.0 2.0\n" * 2000, [16_000], start_s + 1e-6 * (later + 0.5))
    with tempfile.TemporaryDirectory() as folder:
        recorder = Recorder(Path(folder), {})
        for samples in groups:
            recorder.write(samples, start_s)
        recorder.close()
        (recording,) = read_recording(Path(folder))
    assert np.diff(recording.columns["time_s"]).min() > 0


def test_json_values_of_all_kinds() -> None:
    lines = [json.dumps({"a": k, "on": True, "list": [1], "t_ms": 10 * k}) for k in range(30)]
    groups = fed(Decoder(), ("\n".join(lines) + "\n").encode())
    assert groups[0].layout.channels == ("a", "on")


LINES_AS_SENT = {
    "Voltage: 1.23 V": {"Voltage": 1.23},
    "light:1.23V,dark:0.020V": {"light": 1.23, "dark": 0.02},
    "light=1.23 V dark=20 mV": {"light": 1.23, "dark": 0.02},
    "Humidity: 40.00%  Temperature: 24.00°C": {"Humidity": 40.0, "Temperature": 24.0},
    "R: 4.7 kΩ; force: 1.5 N": {"R": 4.7, "force": 1.5},
    "light:512\tstate:OPEN": {"light": 512.0},
    "state=OPEN light=512": {"light": 512.0},
    ">light:1.23": {"light": 1.23},
    "light: 1,23; dark: 0,02": {"light": 1.23, "dark": 0.02},
    "a:1 g=2": {"a": 1.0, "g": 2.0},
    "1.23V,0.020V": {"channel1": 1.23, "channel2": 0.02},
    "1,230;0,020": {"channel1": 1.23, "channel2": 0.02},
    "light: 850 µV, dark: 20 uV, high: 1.5 kV": {"light": 8.5e-4, "dark": 2e-5, "high": 1500.0},
    "850 mV\t1.5 V": {"channel1": 0.85, "channel2": 1.5},
}


@pytest.mark.parametrize("line", LINES_AS_SENT)
def test_values_with_units_words_and_decimal_commas_are_read(line):
    wanted, decoder = LINES_AS_SENT[line], Decoder()
    groups = decoder.feed(f"{line}\r\n".encode() * 60, 0.0) + decoder.finish(1.0)
    assert sum(len(group.values) for group in groups) == 59, "all but the first, which may be cut"
    assert dict(zip(groups[0].layout.channels, groups[0].values[-1].tolist(), strict=True)) == pytest.approx(
        wanted
    )
    assert decoder.why_no_sample is None


@pytest.mark.parametrize("sent", ["light: 1.5 V\r", "T: 24.0\u00b0C, light: 1.5 V\n"])
def test_lines_that_end_in_cr_and_signs_in_latin_1_are_read(sent):
    decoder = Decoder()
    groups = [group for k in range(60) for group in decoder.feed(sent.encode("latin-1"), 0.02 * k)]
    groups += decoder.finish(2.0)
    assert sum(len(group.values) for group in groups) == 59
    assert groups[-1].values[-1][-1] == 1.5


def test_a_line_in_no_known_format_is_complained_about_once():
    decoder, told = Decoder(), set()
    for k in range(2000):
        decoder.feed(f"I ({k}) adc: light is 1.{k:03d}\r\n".encode(), 0.02 * k)
        told.add(decoder.complaint)
    assert len(told - {None}) == 1


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("Sensor ready", "it holds no number"),
        ("light:5a2,dark:1", "'light:5a2,dark:1' is not a `label:value` pair"),
        ("light 512 of 1023", "'light' is not a number"),
        ('{"light": 512', "not a whole JSON object"),
    ],
)
def test_the_first_line_that_is_not_understood_is_shown(line, why):
    decoder = Decoder()
    decoder.feed(f"{line}\r\n".encode() * 5, 0.0)
    decoder.finish(1.0)
    what, remedy = decoder.why_no_sample
    assert repr(line) in what
    assert why in what
    assert "label:value" in remedy


def test_a_session_without_a_sample_fails_with_what_to_do(tmp_path):
    silent = {"rows": 0, "bytes": 0, "complaint": [], "duration_s": 4.0, "port": "COM3"}
    with pytest.raises(MuError, match=r"nothing came in 4\.0 s") as caught:
        require_samples(silent, tmp_path)
    assert caught.value.status == 1
    assert all(word in caught.value.remedy for word in ("--baud", "reset", "DTR", "another port", "waits"))
    unread = silent | {"bytes": 50, "complaint": ["text in no format", "send CSV"]}
    with pytest.raises(MuError, match="text in no format"):
        require_samples(unread, tmp_path)
    require_samples(silent | {"rows": 1}, tmp_path)


@pytest.mark.parametrize(
    ("lines", "expected"),
    [
        # The first line may lack its beginning.
        ([f"{500 + k}\n" for k in range(5)], [1, 2, 3, 4]),
        (["note\n", "light,dark\n", *(f"{k},7\n" for k in range(5))], [2, 3, 4, 5, 6]),
        ([f"{'ab'[k % 2]}:{k}\n" for k in range(10)], [2, 4, 6, 8, 9]),
        ([f'{{"a": {k}}}\n' for k in range(2)], [1]),
    ],
    ids=["values", "header", "a label a line", "format known at the end"],
)
def test_samples_have_the_time_at_which_they_came_not_that_at_which_the_format_was_known(
    lines: list[str], expected: list[float]
) -> None:
    decoder, groups = Decoder(), []
    for k, line in enumerate(lines):
        # The end of a line comes a little after its beginning.
        groups += decoder.feed(line[:-1].encode(), k - 0.25) + decoder.feed(line[-1:].encode(), float(k))
    groups += decoder.finish(60.0)
    assert all_of(groups, "host_s") == pytest.approx(expected, abs=1e-4)
