# SPDX-License-Identifier: MIT
"""Files that are broken somewhere: bytes, words, numbers and lines of a sound file changed, by a seed. Used by the
tests of toolpaths. No I/O.
"""

from __future__ import annotations

import random
import re

_WORD = re.compile(rb"[A-Za-z0-9_.+\-#$]+")
_NUMBER = re.compile(rb"[-+]?[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?")
_NUMBERS = (
    *(
        b"0",
        b"-0",
        b"1",
        b"-1",
        b"2",
        b"7",
        b"0.5",
        b"1e-12",
        b"-1e-300",
        b"1e9",
        b"1e308",
        b"1e999",
        b"-1e30",
    ),
    *(
        b"nan",
        b"inf",
        b"99999999999999999999",
        b"4294967296",
        b"360",
        b"1_0",
        b"",
        b".",
        b"--1",
        b"0x10",
        b"1,5",
    ),
)


def mutated(sound: bytes, seed: int) -> bytes:
    """A file with one to five changes."""
    draw = random.Random(seed)
    data = sound
    for _ in range(draw.choice((1, 1, 1, 2, 3, 5))):
        change = draw.choice((_bytes, _word, _number, _number, _lines, _lines, _cut))
        data = change(data, draw)
    return data


def _bytes(data: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(data) + 1)
    new = bytes(
        draw.choice((draw.randrange(256), draw.choice(b' <>&"\n\r\t,;0')))
        for _ in range(draw.choice((0, 1, 1, 3)))
    )
    return data[:at] + new + data[at + draw.choice((0, 1, 1, 4)) :]


def _replaced(data: bytes, pattern: re.Pattern[bytes], new: bytes, draw: random.Random) -> bytes:
    start = draw.randrange(len(data) + 1)
    found = pattern.search(data, start) or pattern.search(data)
    return data if found is None else data[: found.start()] + new + data[found.end() :]


def _word(data: bytes, draw: random.Random) -> bytes:
    words = _WORD.findall(data)
    return _replaced(data, _WORD, draw.choice(words) if words else b"x", draw)


def _number(data: bytes, draw: random.Random) -> bytes:
    small = f"{draw.uniform(-50, 50):.3g}".encode()
    return _replaced(data, _NUMBER, draw.choice((*_NUMBERS, small, small, small, small)), draw)


def _lines(data: bytes, draw: random.Random) -> bytes:
    """Drop, double or exchange lines; half of the time an even count of them, which a tag of DXF is."""
    lines = data.splitlines(keepends=True)
    if not lines:
        return data
    at, count = draw.randrange(len(lines)), draw.choice((1, 2, 2, 4))
    kind = draw.randrange(3)
    if kind == 0:
        del lines[at : at + count]
    elif kind == 1:
        lines[at:at] = lines[at : at + count]
    else:
        other = draw.randrange(len(lines))
        lines[at : at + count], lines[other : other + count] = (
            lines[other : other + count],
            lines[at : at + count],
        )
    return b"".join(lines)


def _cut(data: bytes, draw: random.Random) -> bytes:
    at = draw.randrange(len(data) + 1)
    return draw.choice((data[:at], data[at:], data[:at] + data[draw.randrange(len(data) + 1) :]))
