"""Streams of several formats, damaged at random, and what a decoder must make of them.

A stream is lines or frames; sample k holds `light(k)`, told apart from every other's, and `dark(k)`.
Whatever is done to its bytes: nothing raises, each byte is counted once, and each sample whose line or frame
came whole, between the ends of others, is recorded.
"""

from __future__ import annotations

import json
import random
from collections import Counter
from collections.abc import Callable

import attrs
import numpy as np

from mu_addon.sensing.byte_accounts import Counters
from mu_addon.sensing.decoder import Decoder
from mu_addon.sensing.framing import END, info_frame, sample_frame
from mu_addon.sensing.samples import Samples

INFO = info_frame({"channels": ["light", "dark"], "unit_per_count": 1.0})


def light(k: int) -> int:
    return 1000 + k


def dark(k: int) -> int:
    return (7 * k) % 501


def _frames(k: int) -> bytes:
    return sample_frame(k, 200 * k, (light(k), dark(k)))


def _json(k: int) -> bytes:
    return json.dumps({"seq": k, "t_ms": 10 * k, "light": light(k), "dark": dark(k)}).encode() + b"\n"


def _csv(k: int) -> bytes:
    return f"{light(k)},{dark(k)}\n".encode()


def _csv_numbered(k: int) -> bytes:
    return f"{k % 256},{10 * k},{light(k)},{dark(k)}\n".encode()


def _labels(k: int) -> bytes:
    return f"light:{light(k)},dark:{dark(k)}\r\n".encode()


def _labels_numbered(k: int) -> bytes:
    return f"seq:{k},micros:{1000 * k},light:{light(k)},dark:{dark(k)}\n".encode()


# Name, what comes first, sample k, what ends a piece.
FORMATS: dict[str, tuple[bytes, Callable[[int], bytes], bytes]] = {
    "frames": (INFO, _frames, END),
    "json": (b"\n", _json, b"\n"),
    "csv": (b"\n", _csv, b"\n"),
    "csv_numbered": (b"seq,time_ms,light,dark\n", _csv_numbered, b"\n"),
    "labels": (b"\n", _labels, b"\n"),
    "labels_numbered": (b"\n", _labels_numbered, b"\n"),
}

NASTY = [
    b"seq:1e999,light:1\n",
    b'{"light":' + b"9" * 400 + b"}\n",
    b"[" * 1900 + b"\n",
    b'{"a":' * 700 + b"\n",
    b"\x1b]0;title\x07\x1b[2J\n",
    b"\x00\x00\x00",
    b"\xff\xfe\n",
    b'{"\\ud800":1,"light":2}\n',
    b"light:nan,dark:nan\n",
    b"nan,nan\n",
    b'{"light":1,"light":2}\n',
    b"seq:nan,light:3\n",
    b"light:1e400,dark:0\n",
    b"," * 300 + b"\n",
    b"\n\r\n\r",
    b"a,b\n",
    b"light,dark\n",
    b"=" * 50 + b"\n",
    b"light:" + b" " * 3000 + b"x\n",
    b"9" * 4000 + b"x\n",
]


def mutated(random_: random.Random, pieces: list[bytes], share: float) -> bytes:
    """The pieces with about that share of them damaged, and things put between them."""
    out = []
    for k, piece in enumerate(pieces):
        if random_.random() >= share:
            out.append(piece)
            continue
        changed = bytearray(piece)
        place = random_.randrange(len(changed))
        what = random_.randrange(11)
        if what == 0:
            changed[place] ^= 1 << random_.randrange(8)
        elif what == 1:
            del changed[place]
        elif what == 2:
            changed.insert(place, random_.randrange(256))
        elif what == 3:
            del changed[place : place + random_.randrange(1, 30)]
        elif what == 4:
            changed = bytearray(piece + piece)
        elif what == 5:
            changed = bytearray(pieces[random_.randrange(len(pieces))] + piece)
        elif what == 6:
            changed += random_.randbytes(random_.randrange(1, 300))
        elif what == 7:
            changed += random_.choice(NASTY)
        elif what == 8:
            changed = changed[:-1]
        elif what == 9:
            changed = bytearray(piece.replace(b"light", b"lght").replace(b"dark", b"dqrk"))
            changed[place % len(changed)] ^= 2
        elif k % 7 == 0:
            changed += random_.randbytes(1) * random_.randrange(3000, 9000)
        out.append(bytes(changed))
    return b"".join(out)


@attrs.frozen
class Outcome:
    """What a decoder made of a stream; `missing`: whole samples that were not recorded."""

    groups: list[Samples]
    decoder: Decoder
    whole: int
    missing: list[int]
    unaccounted: int


def accounted(counted: Counters) -> int:
    """How many bytes were counted by what became of them."""
    return counted.read_bytes + counted.rejected_bytes + counted.cut_bytes + counted.overlong


def decoded(name: str, seed: int, samples: int = 200, share: float = 0.1) -> Outcome:
    """Mutate a stream of that format, feed it in pieces of random sizes, and compare."""
    random_ = random.Random(f"{name} {seed}")
    head, sample, end = FORMATS[name]
    pieces = [sample(k) for k in range(samples)]
    data = head + mutated(random_, pieces, share)
    decoder, groups, place, at = Decoder(), [], 0, 0.0
    while place < len(data):
        size = random_.choice((1, 7, 64, 300, 4096))
        groups += decoder.feed(data[place : place + size], at)
        place, at = place + size, at + 0.002
    groups += decoder.finish(at)
    counted = decoder.counters
    of = {piece: k for k, piece in enumerate(pieces)}
    came = data.split(end)[1:-1]
    whole = {of[piece + end] for piece in came if piece + end in of}
    kept: Counter[tuple[float, float]] = Counter()
    for group in groups:
        names = group.layout.channels
        if len(names) >= 2:
            kept.update(map(tuple, group.values[:, :2].tolist()))
        for a, b in (("light", "dark"), ("dark", "light")):
            if a in names and b in names:
                pair = group.values[:, [names.index("light"), names.index("dark")]]
                kept.update(map(tuple, pair.tolist()))
    missing = sorted(k for k in whole if not kept[float(light(k)), float(dark(k))])
    return Outcome(groups, decoder, len(whole), missing, counted.bytes - accounted(counted))


def sound(outcome: Outcome) -> bool:
    """Whether every byte is counted, every whole sample recorded, and every rejected byte kept."""
    counted = outcome.decoder.counters
    refused = ("malformed", "crc", "cut", "no end")
    kept = sum(len(reject.raw) for reject in outcome.decoder.rejects if reject.why in refused)
    rows = sum(len(group) for group in outcome.groups)
    numbers = np.concatenate([g.sequence for g in outcome.groups]) if outcome.groups else np.empty(0)
    times = np.concatenate([g.host_s for g in outcome.groups]) if outcome.groups else np.empty(0)
    return bool(
        not outcome.missing
        and outcome.unaccounted == 0
        and kept == counted.rejected_bytes + counted.cut_bytes + counted.overlong
        and rows == counted.samples
        and (np.diff(numbers) > 0).all()
        and (np.diff(times) > 0).all()
    )
