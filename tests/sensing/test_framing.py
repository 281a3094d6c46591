"""Frames: stuffing and CRC against the published examples, and any bytes there and back."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from mu_addon.sensing.framing import (
    cobs_decoded,
    cobs_encoded,
    crc16,
    framed,
    info_frame,
    info_of,
    payload_of,
    sample_frame,
    sample_of,
)


def test_crc_is_the_catalogues() -> None:
    # Check value of CRC-16/IBM-3740 in the catalogue of parametrised CRC algorithms.
    assert crc16(b"123456789") == 0x29B1


def test_stuffing_by_the_papers_rules() -> None:
    ramp = bytes(range(1, 255))
    assert cobs_encoded(b"") == b"\x01"
    assert cobs_encoded(b"\x00") == b"\x01\x01"
    assert cobs_encoded(b"\x11\x22\x00\x33") == b"\x03\x11\x22\x02\x33"
    assert cobs_encoded(ramp) == b"\xff" + ramp
    assert cobs_encoded(ramp + b"\x00") == b"\xff" + ramp + b"\x01\x01"
    assert cobs_encoded(ramp + b"\xff") == b"\xff" + ramp + b"\x02\xff"


@given(st.binary(max_size=1100))
def test_any_bytes_come_back(data: bytes) -> None:
    line = cobs_encoded(data)
    assert 0 not in line
    assert len(line) <= len(data) + 1 + len(data) // 254
    assert cobs_decoded(line) == data


@given(st.binary(max_size=300))
def test_no_noise_raises(data: bytes) -> None:
    payload_of(data)
    cobs_decoded(data)
    sample_of(data)
    info_of(data)


@given(st.binary(min_size=1, max_size=60), st.integers(0, 10_000), st.integers(1, 255))
def test_a_changed_byte_is_noticed(payload: bytes, place: int, change: int) -> None:
    frame = bytearray(framed(payload)[:-1])
    frame[place % len(frame)] ^= change
    if 0 not in frame:
        assert payload_of(bytes(frame)) is None


def test_samples_and_infos() -> None:
    frame = sample_frame(2**32 + 5, 70, (0, 65535, 300))
    assert frame.count(b"\x00") == 1
    payload = payload_of(frame[:-1])
    assert payload is not None
    assert sample_of(payload) == (5, 70, (0, 65535, 300))
    assert info_of(payload) is None
    info = {"channels": ["light"], "unit": "V", "unit_per_count": 0.001}
    payload = payload_of(info_frame(info)[:-1])
    assert payload is not None
    assert info_of(payload) == info
    assert sample_of(payload) is None
