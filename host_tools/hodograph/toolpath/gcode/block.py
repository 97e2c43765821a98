# SPDX-License-Identifier: MIT
"""A block: one line of G-code as its words, with all checks that need this line only. Used by toolpath/gcode. No I/O.

    N10 G1 X[#1 + 2] F100 #2=5 (comment)

has a line number, which has no effect, words (a letter and a value), settings of parameters and comments. All values of
a block are calculated before any of its settings take effect.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

from ...errors import ToolpathError
from .codes import (
    AXIS_LETTERS,
    CYCLES,
    G_GROUP,
    G_USES,
    M_GROUP,
    M_USES,
    POLAR_LETTERS,
    REFUSED_LETTERS,
    TAKES_AXES,
    Group,
    g_name,
    why_not_g,
    why_not_m,
)
from .expression import Scanner
from .parameters import STORED_TABLES, Parameters
from .source import COMMENT, SourceLine

_LINE_NUMBER = re.compile(r"n[0-9]+(?:\.[0-9]*)?")
_INTEGER_LETTERS = "hlt"
"""Words whose value is an integer."""
GREATEST_VALUE = 1e9
"""Bound of the magnitude of a word's value."""

_VALUE_LETTERS = "abcefhijklpqrstxyz" + POLAR_LETTERS
"""Words whose value is a number with decimals."""


@dataclass(slots=True)
class Block:
    """The words of a line.

    `values` holds words by their letter without G and M, `g` the G codes by group and `m` the M codes by group.
    `places` holds the start of each word in the compact text, by letter, or by its code such as "g10" and "m3".
    """

    line: SourceLine
    values: dict[str, float] = field(default_factory=dict)
    g: dict[Group, int] = field(default_factory=dict)
    m: dict[int, int] = field(default_factory=dict)
    places: dict[str, int] = field(default_factory=dict)
    settings: list[tuple[int | str, float]] = field(default_factory=list)

    def error(self, word: str, text: str) -> ToolpathError:
        """An error at a word, named as in `places`; at the start of the line if the block lacks it."""
        return self.line.error(self.places.get(word, 0), text)

    def motion_error(self, text: str) -> ToolpathError:
        """An error of the motion: at its G code, or at the first word if the motion mode is from an earlier block."""
        code = self.g.get(Group.MOTION)
        first = min(self.places.values(), default=0)
        return self.line.error(first if code is None else self.places[f"g{code}"], text)

    def has_any(self, letters: str) -> bool:
        """Whether the block has a word with one of these letters."""
        return any(letter in self.values for letter in letters)

    def integer(self, letter: str, what: str, least: int, most: int) -> int:
        """The value of a word that must be an integer within bounds. Raises ToolpathError if it is not."""
        value = self.values[letter]
        nearest = round(value)
        if abs(value - nearest) > 1e-3 or not least <= nearest <= most:
            raise self.error(letter, f"{what} must be an integer from {least} to {most}")
        return nearest


def start_of_words(line: SourceLine) -> int:
    """The place after the sign of block delete and the line number."""
    at = 1 if line.text.startswith("/") else 0
    found = _LINE_NUMBER.match(line.text, at)
    return found.end() if found else at


def parse_block(line: SourceLine, parameters: Parameters) -> Block:
    """The block of a line. The settings of parameters are read, not made.

    Raises ToolpathError: not a sequence of words, a word twice, two codes of one group, or a code or letter that is
    not supported.
    """
    block = Block(line)
    scanner = Scanner(line, parameters, start_of_words(line))
    text = line.text
    while scanner.at < len(text):
        start = scanner.at
        letter = text[start]
        if letter == COMMENT:
            scanner.at += 1
        elif letter == "#":
            _read_setting(block, scanner)
        else:
            _read_word(block, scanner, letter)
    return block


def _read_setting(block: Block, scanner: Scanner) -> None:
    start = scanner.at
    key = scanner.parameter_key()
    if scanner.text[scanner.at : scanner.at + 1] != "=":
        raise block.line.error(scanner.at, 'expected "=" and the value of the parameter')
    if scanner.parameters.is_read_only(key):
        name = f"#{key}" if isinstance(key, int) else f"#<{key}>"
        raise block.line.error(start, f"{name} cannot be set: use another parameter")
    scanner.at += 1
    value = scanner.value()
    if key in STORED_TABLES and abs(value) >= GREATEST_VALUE:
        raise block.line.error(start, f"the value of #{key} is too large: use numbers below 1e9")
    block.settings.append((key, value))


def _read_word(block: Block, scanner: Scanner, letter: str) -> None:
    start = scanner.at
    scanner.at += 1
    if letter == "g":
        _add_g(block, start, scanner.value())
    elif letter == "m":
        _add_m(block, start, scanner.integer())
    elif letter in _VALUE_LETTERS:
        if letter in block.values:
            raise block.line.error(start, f"{letter.upper()} twice in a block: remove one")
        value = float(scanner.integer()) if letter in _INTEGER_LETTERS else scanner.value()
        if abs(value) >= GREATEST_VALUE:
            raise block.line.error(start, f"{letter.upper()} is too large: use numbers below 1e9")
        block.places[letter] = start
        block.values[letter] = value
    else:
        text = (
            f'unexpected character "{letter}"' if letter.isprintable() else "unprintable character"
        )
        raise block.line.error(start, REFUSED_LETTERS.get(letter, f"{text}: remove it"))


def _add_g(block: Block, start: int, number: float) -> None:
    code = round(number * 10.0) if abs(number) < 1e6 else -1
    if code < 0 or abs(number * 10.0 - code) > 1e-3:
        raise block.line.error(start, f"G{number:g} is unknown: G codes have at most one decimal")
    group = G_GROUP.get(code)
    if group is None:
        raise block.line.error(start, why_not_g(code))
    other = block.g.get(group)
    block.places[f"g{code}"] = start
    if other is not None and code != 800 and other != 800:
        names = f"{g_name(other)} and {g_name(code)}"
        raise block.line.error(start, f"{names} exclude each other: put them in separate blocks")
    if other is None or other == 800:
        block.g[group] = code


def _add_m(block: Block, start: int, code: int) -> None:
    group = M_GROUP.get(code)
    if group is None:
        raise block.line.error(start, why_not_m(code))
    if group in block.m:
        names = f"M{block.m[group]} and M{code}"
        raise block.line.error(start, f"{names} exclude each other: put them in separate blocks")
    block.m[group] = code
    block.places[f"m{code}"] = start


def motion_of(block: Block, modal: int | None) -> int | None:
    """The motion code that the block executes, given the one that is active; None if it moves nothing.

    Raises ToolpathError: axis words without a code for them, two codes for the same words, or words that no code uses.
    """
    explicit = block.g.get(Group.MOTION)
    other = block.g.get(Group.NON_MODAL)
    takes_axes = other in TAKES_AXES or block.g.get(Group.TOOL_LENGTH) == 431
    motion = explicit
    if explicit is None and not takes_axes:
        motion = _modal_motion(block, modal)
    elif explicit not in (None, 800) and takes_axes:
        raise block.motion_error("two codes use axis words: put them in separate blocks")
    if motion in CYCLES and not block.has_any("xyz" + POLAR_LETTERS):
        raise block.motion_error(f"{g_name(motion or 0)} needs X, Y or Z")
    _check_used(block, motion)
    return motion


def _modal_motion(block: Block, modal: int | None) -> int | None:
    letters = AXIS_LETTERS + POLAR_LETTERS
    if block.has_any(letters):
        if modal is None or modal == 800:
            first = min(block.places[each] for each in letters if each in block.values)
            raise block.line.error(first, "axis words without motion: write G0 or G1 before them")
        return modal
    return modal if modal in (20, 30) and block.has_any("ijk") else None


def _check_used(block: Block, motion: int | None) -> None:
    """Every word but F, S and T is used by just one code."""
    users: list[tuple[str, str]] = []
    if motion is not None:
        users.append((g_name(motion), G_USES.get(motion, "")))
    for group, code in block.g.items():
        if group is not Group.MOTION:
            users.append((g_name(code), G_USES.get(code, "")))
    users += [(f"M{code}", M_USES.get(code, "")) for code in block.m.values()]
    for letter in block.values:
        if letter in "fst":
            continue
        names = [name for name, letters in users if letter in letters]
        if not names:
            raise block.error(letter, f"no code in this block uses {letter.upper()}: remove it")
        if len(names) > 1:
            both = " and ".join(names)
            text = f"{letter.upper()} would be used by {both}: put them in separate blocks"
            raise block.error(letter, text)
