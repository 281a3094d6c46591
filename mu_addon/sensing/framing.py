"""Binary frames on a serial line: a payload with its CRC-16, byte-stuffed by COBS, ended by a zero byte.

A payload's first byte is its kind. SAMPLE: sequence number and device time in microseconds, both modulo 2^32,
then one count for each channel. INFO: JSON in UTF-8, sent about once a second: {"channels": ["light", ...],
"unit_per_count": 0.0008, "unit": "V", "firmware": "..."}.

Sources: Cheshire and Baker, IEEE/ACM Trans. Networking 7 (1999) 159 (COBS); CRC-16/IBM-3740 (polynomial
0x1021, start 0xFFFF) of the catalogue of parametrised CRC algorithms.
"""

from __future__ import annotations

import binascii
import json
import struct
from collections.abc import Sequence
from typing import Any

SAMPLE, INFO = 1, 2
END = b"\x00"
# Longer ones are noise: 64 channels with their head and CRC, or a generous INFO.
LONGEST = 512

_HEAD = struct.Struct("<BIIB")
_CRC = struct.Struct("<H")
_COUNTS = [struct.Struct(f"<{n}H") for n in range(65)]


def crc16(data: bytes) -> int:
    """CRC-16/IBM-3740 of bytes, 0 to 65535.

    >>> hex(crc16(b"123456789"))
    '0x29b1'
    """
    return binascii.crc_hqx(data, 0xFFFF)


def cobs_encoded(data: bytes) -> bytes:
    r"""Bytes without a zero among them, by consistent overhead byte stuffing (COBS).

    Longer by one byte in 254, and one more at most. Source: Cheshire and Baker, IEEE/ACM Trans. Networking
    7 (1999) 159.

    >>> cobs_decoded(cobs_encoded(b"a\x00b"))
    b'a\x00b'
    """
    out = bytearray()
    parts = data.split(END)
    for number, part in enumerate(parts):
        full, rest = divmod(len(part), 254)
        for k in range(full):
            out += b"\xff" + part[254 * k : 254 * (k + 1)]
        # A full block at the very end stands for itself; elsewhere the zero after it needs its own block.
        if rest or not full or number < len(parts) - 1:
            out.append(rest + 1)
            out += part[len(part) - rest :]
    return bytes(out)


def cobs_decoded(data: bytes) -> bytes | None:
    """The bytes that `cobs_encoded` encodes as `data`, or None if `data` is not COBS-encoded."""
    out = bytearray()
    place, length = 0, len(data)
    while place < length:
        code = data[place]
        after = place + code
        if code == 0 or after > length:
            return None
        out += data[place + 1 : after]
        place = after
        if code < 255 and place < length:
            out.append(0)
    return bytes(out)


def framed(payload: bytes) -> bytes:
    """A payload as sent: with its CRC, COBS-encoded, ended by a zero byte."""
    return cobs_encoded(payload + _CRC.pack(crc16(payload))) + END


def sample_frame(sequence: int, time_us: int, counts: Sequence[int]) -> bytes:
    """The frame of a SAMPLE.

    sequence: running number, and time_us: device time in microseconds, both sent modulo 2^32; counts: 0 to
    65535, 64 channels at most.
    """
    head = _HEAD.pack(SAMPLE, sequence & 0xFFFFFFFF, time_us & 0xFFFFFFFF, len(counts))
    return framed(head + _COUNTS[len(counts)].pack(*counts))


def info_frame(info: dict[str, Any]) -> bytes:
    """The frame of an INFO: the device's description of itself, as JSON."""
    return framed(bytes([INFO]) + json.dumps(info, separators=(",", ":")).encode())


def payload_of(frame: bytes) -> bytes | None:
    """The payload of a frame without its final zero byte, or None if its CRC or COBS encoding is wrong."""
    data = cobs_decoded(frame)
    if data is None or len(data) < 3:
        return None
    payload, crc = data[:-2], data[-2:]
    return payload if _CRC.unpack(crc)[0] == crc16(payload) else None


def sample_of(payload: bytes) -> tuple[int, int, tuple[int, ...]] | None:
    """Running number, device time in microseconds and counts of a SAMPLE payload; None for any other."""
    if len(payload) < _HEAD.size:
        return None
    kind, sequence, time_us, n = _HEAD.unpack_from(payload)
    if kind != SAMPLE or not 0 < n < len(_COUNTS) or len(payload) != _HEAD.size + 2 * n:
        return None
    return sequence, time_us, _COUNTS[n].unpack_from(payload, _HEAD.size)


def info_of(payload: bytes) -> dict[str, Any] | None:
    """The JSON object of an INFO payload; None for any other."""
    if payload[:1] != bytes([INFO]):
        return None
    try:
        info = json.loads(payload[1:])
    except (ValueError, RecursionError):
        return None
    return info if isinstance(info, dict) else None
