# SPDX-License-Identifier: MIT
"""Length of CAN frames in bits (ISO 11898-1), stuff bits included; docs/reference/bus-time.md sections 1 and 2.1. Used
by bus/capture/ and bustime/. No I/O.

From the start bit to the last bit of the CRC a complementary bit follows every five equal bits; delimiters,
acknowledgement, end of frame and the three bits of intermission are never stuffed. A length here counts them all,
so it is the time from one start bit to the earliest next one.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

EXTENDED, REMOTE, ERROR = 0x8000_0000, 0x4000_0000, 0x2000_0000
"""Flags in the identifier of linux/can.h. Error frames come from the controller, not from the bus."""

CRC_POLYNOMIAL = 0x4599
CRC_BITS = 15
UNSTUFFED_BITS = 13
"""CRC delimiter, ACK slot and delimiter, 7 bits end of frame, 3 bits intermission."""

_CHUNK = 1 << 16

Bits = NDArray[np.uint8]


def plain_bits(size: int) -> int:
    """Bits of a base frame with `size` (0 … 8) data bytes when nothing has to be stuffed."""
    return 19 + 8 * size + CRC_BITS + UNSTUFFED_BITS


def generic_worst_bits(size: int) -> int:
    """The usual bound for any base identifier: every fourth bit after the first is a stuff bit."""
    return plain_bits(size) + (19 + 8 * size + CRC_BITS - 1) // 4


@cache
def worst_bits(identifier: int, size: int) -> int:
    """Bound for this base identifier with any data: the header is known, data and CRC are taken as free."""
    header = _header(np.array([identifier], dtype=np.uint32), size, remote=False)
    stuffed, run = _stuff_count(header)
    free = 8 * size + CRC_BITS - (5 - int(run[0]))
    return plain_bits(size) + int(stuffed[0]) + (1 + free // 4 if free >= 0 else 0)


_FD_HEADER_BITS = 17
"""At the nominal bit rate: start bit, identifier, RRS, IDE, FDF, a reserved bit, BRS."""
_FD_CONTROL_BITS = 5
"""At the data bit rate: ESI, DLC."""
_FD_CRC_BITS = 4 + 17 + 6
"""At the data bit rate: stuff count, CRC-17, and the fixed stuff bits of both; frames of up to 16 bytes."""


def fd_bits(size: int, *, stuffed: bool) -> tuple[int, int]:
    """Bits of a CAN FD base frame with `size` (0 … 8) data bytes, at the nominal and at the data bit rate.

    stuffed  with as many stuff bits as can be, most of them at the nominal bit rate; else without one
    """
    inside = _FD_HEADER_BITS + _FD_CONTROL_BITS + 8 * size
    every, slow = ((inside - 1) // 4, (_FD_HEADER_BITS - 1) // 4) if stuffed else (0, 0)
    fast = _FD_CONTROL_BITS + 8 * size + _FD_CRC_BITS
    return _FD_HEADER_BITS + slow + UNSTUFFED_BITS, fast + every - slow


def exact_bits(frames: NDArray[Any]) -> NDArray[np.int64]:
    """The length of each recorded frame, its CRC and its stuff bits computed; 0 for error frames.

    `frames` has the fields `id` (with the flags above), `length` and `data` (8 bytes), as struct can_frame.
    """
    lengths = np.zeros(frames.size, dtype=np.int64)
    flags = frames["id"] & np.uint32(EXTENDED | REMOTE | ERROR)
    kinds = flags.astype(np.uint64) | np.minimum(frames["length"], 8)
    for kind in np.unique(kinds).tolist():
        if kind & ERROR:
            continue
        members = np.flatnonzero(kinds == kind)
        for start in range(0, members.size, _CHUNK):
            at = members[start : start + _CHUNK]
            lengths[at] = _lengths(
                frames[at], kind & 15, bool(kind & EXTENDED), bool(kind & REMOTE)
            )
    return lengths


def crc15(bits: Bits) -> Bits:
    """CRC-15 of each row of bits (n, m), as bits (n, 15), most significant first."""
    register = np.zeros(bits.shape[0], dtype=np.uint16)
    for column in bits.T:
        out = (register >> 14 ^ column) & 1
        register = (register << 1 & 0x7FFF) ^ out * np.uint16(CRC_POLYNOMIAL)
    return _bits_of(register, CRC_BITS)


def _lengths(frames: NDArray[Any], size: int, extended: bool, remote: bool) -> NDArray[np.int64]:
    make = _extended_header if extended else _header
    parts = [make(frames["id"], size, remote)]
    if not remote:
        parts.append(np.unpackbits(frames["data"][:, :size], axis=1))
    body = np.concatenate(parts, axis=1)
    stuffed_part = np.concatenate([body, crc15(body)], axis=1)
    count, _ = _stuff_count(stuffed_part)
    return np.asarray(count + (stuffed_part.shape[1] + UNSTUFFED_BITS))


def _header(identifiers: NDArray[np.uint32], size: int, remote: bool) -> Bits:
    """Start bit, identifier, RTR, IDE, reserved bit, DLC."""
    value = (identifiers.astype(np.uint64) & np.uint64(0x7FF)) << np.uint64(7)
    return _bits_of(value | np.uint64(remote << 6 | size), 19)


def _extended_header(identifiers: NDArray[np.uint32], size: int, remote: bool) -> Bits:
    """Start bit, 11 bits, SRR, IDE, 18 bits, RTR, two reserved bits, DLC."""
    number = identifiers.astype(np.uint64) & np.uint64(0x1FFF_FFFF)
    base, rest = number >> np.uint64(18), number & np.uint64(0x3FFFF)
    value = base << np.uint64(27) | np.uint64(3 << 25) | rest << np.uint64(7)
    return _bits_of(value | np.uint64(remote << 6 | size), 39)


def _bits_of(values: NDArray[Any], count: int) -> Bits:
    shifts = np.arange(count - 1, -1, -1, dtype=values.dtype)
    return np.asarray(values[:, None] >> shifts & values.dtype.type(1), dtype=np.uint8)


def _stuff_count(bits: Bits) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Stuff bits in each row, and the length of the run of equal bits that it ends with (a stuff bit counts)."""
    last = np.full(bits.shape[0], 2, dtype=np.uint8)
    run = np.zeros(bits.shape[0], dtype=np.int64)
    count = np.zeros(bits.shape[0], dtype=np.int64)
    for column in bits.T:
        run = np.where(column == last, run + 1, 1)
        full = run == 5
        count += full
        run = np.where(full, 1, run)
        last = np.where(full, 1 - column, column)
    return count, run
