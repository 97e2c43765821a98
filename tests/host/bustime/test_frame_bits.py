# SPDX-License-Identifier: MIT
"""Lengths of frames against an encoder and a receiver that work bit by bit, as a CAN controller does. Run by pytest;
starts and writes nothing.
"""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.bus.capture.recorder import FRAME_DTYPE, Frames
from hodograph.bustime import exact_bits, generic_worst_bits, plain_bits, worst_bits
from hodograph.bustime.frame_bits import ERROR, EXTENDED, REMOTE, crc15, fd_bits

CRC_OF_123456789 = 0x059E  # CRC-15/CAN, check value of the catalogue of parametrised CRCs


def number(value: int, width: int) -> str:
    return format(value, f"0{width}b")


def crc(bits: str) -> int:
    """Long division of polynomials over GF(2)."""
    dividend = int(bits + "0" * 15, 2)
    while dividend.bit_length() > 15:
        dividend ^= (0x8000 | 0x4599) << dividend.bit_length() - 16
    return dividend


def body(identifier: int, size: int, data: bytes) -> str:
    remote = str(int(bool(identifier & REMOTE)))
    if identifier & EXTENDED:
        number29 = number(identifier & 0x1FFFFFFF, 29)
        bits = "0" + number29[:11] + "11" + number29[11:] + remote + "00"
    else:
        bits = "0" + number(identifier & 0x7FF, 11) + remote + "00"
    bits += number(size, 4)
    if remote == "0":
        bits += "".join(number(byte, 8) for byte in data[:size])
    return bits + number(crc(bits), 15)


def on_the_wire(identifier: int, size: int, data: bytes) -> str:
    sent = ""
    for bit in body(identifier, size, data):
        sent += bit
        if sent[-5:] in ("00000", "11111"):
            sent += "10"[int(bit)]
    return sent + "1" + "0" + "1" + "1" * 7 + "1" * 3


def unstuffed(sent: str) -> str:
    """What a receiver has after taking out the bit after each five equal ones."""
    out, run, last, skip = "", 0, "", False
    for bit in sent:
        run = run + 1 if bit == last else 1
        last = bit
        if skip:
            assert run == 1, "stuff error"
            skip = False
        else:
            out += bit
        skip = skip or run == 5
    return out


def one(identifier: int, size: int, data: bytes) -> Frames:
    frames = np.zeros(1, dtype=FRAME_DTYPE)
    frames["id"], frames["length"] = identifier, size
    frames["data"][0, : len(data)] = list(data)
    return frames


identifiers = st.one_of(
    st.integers(0, 0x7FF),
    st.integers(0, 0x7FF).map(lambda i: i | REMOTE),
    st.integers(0, 0x1FFFFFFF).map(lambda i: i | EXTENDED),
    st.integers(0, 0x1FFFFFFF).map(lambda i: i | EXTENDED | REMOTE),
)
byte = st.sampled_from([0, 255, 0x0F, 0xF0, 0x3C, 0xC3, 0x1E]) | st.integers(0, 255)
payload = st.lists(byte, min_size=8, max_size=8).map(bytes)


def test_crc_of_the_catalogue() -> None:
    bits = np.unpackbits(np.frombuffer(b"123456789", dtype=np.uint8))[None]
    found = int("".join(map(str, crc15(bits)[0])), 2)
    assert found == CRC_OF_123456789
    assert crc("".join(map(str, bits[0]))) == CRC_OF_123456789


@pytest.mark.long_examples(1000)
@settings(max_examples=150, deadline=None)
@given(st.lists(st.tuples(identifiers, st.integers(0, 8), payload), min_size=1, max_size=8))
def test_exact_length_is_that_of_the_encoder(frames: list[tuple[int, int, bytes]]) -> None:
    recorded = np.concatenate([one(*frame) for frame in frames])
    assert exact_bits(recorded).tolist() == [len(on_the_wire(*frame)) for frame in frames]


@given(identifiers, st.integers(0, 8), payload)
def test_the_encoder_is_understood_by_a_receiver(identifier: int, size: int, data: bytes) -> None:
    sent = on_the_wire(identifier, size, data)
    received = unstuffed(sent[:-13])
    assert received == body(identifier, size, data)
    assert crc(received[:-15]) == int(received[-15:], 2)


@pytest.mark.long_examples(3000)
@settings(max_examples=300, deadline=None)
@given(st.integers(0, 0x7FF), st.integers(0, 8), payload)
def test_bounds_hold(identifier: int, size: int, data: bytes) -> None:
    exact = int(exact_bits(one(identifier, size, data))[0])
    assert plain_bits(size) <= exact <= worst_bits(identifier, size) <= generic_worst_bits(size)


def test_bounds_are_those_of_the_literature() -> None:
    """Davis et al. 2007, equation 1 with g = 34: 55 to 135 bits."""
    assert [generic_worst_bits(size) for size in range(9)] == [55 + 10 * s for s in range(9)]


@pytest.mark.parametrize("identifier", [0x000, 0x080, 0x182, 0x555, 0x7FF])
def test_bound_for_an_identifier_is_nearly_reached(identifier: int) -> None:
    """All data of one byte: the bound is exact but for what the CRC makes impossible."""
    frames = np.concatenate([one(identifier, 1, bytes([b])) for b in range(256)])
    greatest = int(exact_bits(frames).max())
    assert worst_bits(identifier, 1) - 3 <= greatest <= worst_bits(identifier, 1)


def test_error_frames_take_no_bits_and_none_is_fine() -> None:
    assert exact_bits(one(ERROR | 4, 8, bytes(8))).tolist() == [0]
    assert exact_bits(np.zeros(0, dtype=FRAME_DTYPE)).tolist() == []


def test_fd_frames_by_hand() -> None:
    """ISO 11898-1: 17 bits up to BRS, ESI and DLC, data, stuff count, CRC-17, fixed stuff bits; 13 at the end."""
    assert fd_bits(0, stuffed=False) == (30, 5 + 27)
    assert fd_bits(6, stuffed=False) == (30, 5 + 48 + 27)
    nominal, data = fd_bits(6, stuffed=True)
    assert (nominal, data) == (34, 80 + 13), "17 stuff bits in 70: 4 before BRS, 13 after"
    assert nominal + data / 5 == pytest.approx(52.6)
