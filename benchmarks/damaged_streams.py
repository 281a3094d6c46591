"""A serial line that is damaged in every way, and ten minutes of one with a bad line in ten.

    python -m benchmarks.damaged_streams [--seed 1] [--streams 3000] [--minutes 10] [--rate 5000]

Simulated time: bytes come as fast as they are taken. Of each stream every byte has to be counted once, every
whole sample recorded and every rejected byte kept; see tests/sensing/mutations.py.
"""

from __future__ import annotations

import random
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.table import circumstances, options_of
from mu_addon.sensing.recording import read_recording
from mu_addon.sensing.session import run_session
from mu_addon.sensing.sources import EndOfStream
from tests.sensing.mutations import FORMATS, decoded, sound

CHANNELS = ("light", "dark", "warm", "blue")
# What is done to a bad line: nothing of it may pass for a sample.
BAD = (
    lambda line, random_: b"#" + line,
    lambda line, random_: line[: len(line) // 2] + b"?\n",
    lambda line, random_: line.replace(b",", b"\xff", 1),
    lambda line, random_: random_.randbytes(20).replace(b"\n", b"~") + b"\n",
)


def streams(seed, count):
    """How many of so many damaged streams are not sound, and of how many bytes and samples they were."""
    random_, wrong, samples, size = random.Random(seed), [], 0, 0
    for number in range(count):
        name, share = sorted(FORMATS)[number % len(FORMATS)], random_.choice((0.05, 0.1, 0.3))
        outcome = decoded(name, f"{seed} {number}", share=share)
        samples, size = samples + outcome.whole, size + outcome.decoder.counters.bytes
        if not sound(outcome):
            wrong.append(f"{name} {seed} {number}, share {share}: {outcome.missing} {outcome.unaccounted}")
    return wrong, samples, size


class Line:
    """A source of so many lines, one in ten of them bad."""

    def __init__(self, seed, lines, a_piece):
        self.random_, self.lines, self.a_piece = random.Random(seed), lines, a_piece
        self.next, self.bad, self.bad_bytes, self.bytes = 0, 0, 0, 0

    def open(self):
        return "made up"

    def close(self):
        pass

    def read(self):
        if self.next >= self.lines:
            raise EndOfStream
        piece, last = [], min(self.next + self.a_piece, self.lines)
        for k in range(self.next, last):
            line = f"{k},{200 * k},{k % 1000},{k % 7},{k % 11}.5,{k % 13}\n".encode()
            # The first lines, in doubt anyhow, are left alone.
            if k > 10 and self.random_.random() < 0.1:
                line = self.random_.choice(BAD)(line, self.random_)
                self.bad, self.bad_bytes = self.bad + 1, self.bad_bytes + len(line)
            piece.append(line)
        self.next = last
        data = b"".join(piece)
        if self.bytes == 0:
            data = f"seq,micros,{','.join(CHANNELS)}\n".encode() + data
        self.bytes += len(data)
        return data


def long_recording(seed, lines, a_piece):
    """What a session made of a line with one bad line in ten, in words."""
    line = Line(seed, lines, a_piece)
    begun, used = time.monotonic(), time.process_time()
    with tempfile.TemporaryDirectory() as work:
        status = run_session(line, Path(work) / "r", about={})
        seconds, busy = time.monotonic() - begun, time.process_time() - used
        (recording,) = read_recording(Path(work) / "r")
    numbers = recording.columns["sequence"]
    k = numbers.astype(np.int64)
    right = all(
        np.array_equal(recording.columns[name], wanted)
        for name, wanted in zip(recording.channels, (k % 1000, k % 7, k % 11 + 0.5, k % 13), strict=True)
    )
    counted = {name: status[name] for name in ("read_bytes", "rejected_bytes", "cut_bytes", "overlong")}
    good = lines - line.bad
    return (
        f"{lines} lines, {line.bad} bad: {len(k)} of {good} good samples kept, values "
        f"{'right' if right else 'WRONG'}; {status['rejected_bytes'] + status['cut_bytes']} of "
        f"{line.bad_bytes} bad bytes counted, {sum(counted.values())} of {status['bytes']} bytes in all; "
        f"{seconds:.0f} s, {busy:.0f} s of the processor"
    )


def main():
    parser = options_of(__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--streams", type=int, default=3000)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--rate", type=float, default=5000.0)
    given = parser.parse_args()
    print(circumstances())
    lines = int(given.minutes * 60 * given.rate)
    if lines:
        print(long_recording(given.seed, lines, int(given.rate / 10)), flush=True)
    if given.streams:
        wrong, samples, size = streams(given.seed, given.streams)
        print(f"{given.streams} streams of {size} bytes, {samples} whole samples: {len(wrong)} not sound")
        print("\n".join(wrong))


if __name__ == "__main__":
    main()
