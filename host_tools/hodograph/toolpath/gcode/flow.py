# SPDX-License-Identifier: MIT
"""O-words: subroutines, conditions and loops. Used by gcode/reader. Reads the lines of the program that it is given.

    o<name> sub ... o<name> return [v] ... o<name> endsub [v]     o<name> call [v1] [v2] ...
    o1 if [v] ... o1 elseif [v] ... o1 else ... o1 endif
    o2 while [v] ... o2 endwhile        o3 do ... o3 while [v]        o4 repeat [n] ... o4 endrepeat
    o2 break        o2 continue

A label is a number or a name; that of a call may be calculated (`o[#1 + 10] call`), and that of a return is ignored.
Structures may be nested but not overlap. `Structure` finds their parts before anything runs; `Flow` then goes from line
to line.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field

from ...errors import ToolpathError
from .block import start_of_words
from .expression import Scanner
from .interpreter import Interpreter
from .parameters import ARGUMENTS
from .source import COMMENT, SourceLine

MOST_LEVELS = 100
"""Most subroutines that are active at a time."""

MAY_BE_O_LINE = re.compile(r"[ \t/]*(?:[nN][0-9. \t]*)?[oO]")
"""Matches every line with an O-word, and few other lines."""

_NUMBER = re.compile(r"[0-9]+")
_NAME = re.compile(r"<([!-'*-;=?-~]+)>")
_KEYWORD = re.compile(
    "endwhile|endrepeat|endsub|endif|elseif|else|continue|repeat|return|while|break|call|sub|if|do"
)
_CLOSERS = {"endif": "if", "endwhile": "while", "endrepeat": "repeat", "endsub": "sub"}
_LOOPS = ("while", "do", "repeat")


@dataclass(slots=True)
class OLine:
    """A line with an O-word. `label` is empty if it is calculated; `keyword` is empty for a program number.

    `place` is the start of the O-word in the compact text, `rest` that of its arguments. `opener`, `branches`
    and `closer` are indices of lines: of the line that begins the structure that this line belongs to (for break and
    continue, the loop), of its elseif and else, and of its end.
    """

    line: SourceLine
    label: str
    keyword: str
    place: int
    rest: int
    opener: int = -1
    closer: int = -1
    branches: list[int] = field(default_factory=list)

    def error(self, text: str) -> ToolpathError:
        """An error at the O-word."""
        return self.line.error(self.place, text)


def parse_o_line(line: SourceLine) -> OLine | None:
    """The O-word of a line; None if it has none. Raises ToolpathError: no label, no keyword."""
    text, place = line.text, start_of_words(line)
    if text[place : place + 1] != "o":
        return None
    label, at = _read_label(line, place + 1)
    found = _KEYWORD.match(text, at)
    if found is None:
        if label.isdigit() and not text[at:].strip(COMMENT):
            return OLine(line, label, "", place, at)
        raise line.error(at, "expected a keyword such as sub, call, if or while")
    if not label and found[0] != "call":
        raise line.error(place, "only a call can have a calculated label: write a number or a name")
    return OLine(line, label, found[0], place, found.end())


def _read_label(line: SourceLine, at: int) -> tuple[str, int]:
    text = line.text
    found = _NUMBER.match(text, at)
    if found:
        return str(int(found[0])) if len(found[0]) < 20 else found[0], found.end()
    if text[at : at + 1] == "<":
        name = _NAME.match(text, at)
        if name is None:
            raise line.error(at, 'expected a name in "<" and ">"')
        return name[1], name.end()
    if text[at : at + 1] in ("[", "#"):
        return "", _end_of_calculated(line, at)
    raise line.error(at, "an O-word needs a label: a number, or a name in < and >")


def _end_of_calculated(line: SourceLine, at: int) -> int:
    """The place after `[...]`, `#5`, `#<name>` or `#[...]`."""
    depth = 0
    for place in range(at, len(line.text)):
        character = line.text[place]
        depth += (character in "[<") - (character in "]>")
        is_inside = depth > 0 or character == "#" or (place > at and character.isdigit())
        if not is_inside:
            return place + (character in "]>")
    raise line.error(at, "expected a keyword after the label")


class Structure:
    """The lines with O-words by index, and the subroutines by label."""

    def __init__(self, lines: Iterable[tuple[int, SourceLine]]) -> None:
        """Find the parts of each structure among lines that may have O-words.

        Raises ToolpathError: a structure without end or beginning, or one that overlaps another.
        """
        self.at: dict[int, OLine] = {}
        self.subroutines: dict[str, int] = {}
        self._open: list[int] = []
        for index, line in lines:
            o_line = parse_o_line(line)
            if o_line is not None and o_line.keyword:
                self.at[index] = o_line
                self._add(index, o_line)
        if self._open:
            opener = self.at[self._open[-1]]
            raise opener.error(f"o<{opener.label}> {opener.keyword} has no end: add it")

    def _add(self, index: int, o_line: OLine) -> None:
        keyword = o_line.keyword
        if keyword == "sub":
            self._add_subroutine(index, o_line)
        elif keyword in ("elseif", "else"):
            opener = self._innermost(o_line, "if")
            o_line.opener = self._open[-1]
            if opener.branches and self.at[opener.branches[-1]].keyword == "else":
                raise o_line.error(f"{keyword} after else: move it before the else")
            opener.branches.append(index)
        elif keyword in _CLOSERS:
            self._close(index, o_line, _CLOSERS[keyword])
        elif keyword == "while" and self._closes_do(o_line):
            self._close(index, o_line, "do")
        elif keyword in ("if", "while", "do", "repeat"):
            self._open.append(index)
        elif keyword in ("break", "continue"):
            o_line.opener = self._enclosing_loop(o_line)
        elif keyword == "return" and not self._is_in_subroutine():
            raise o_line.error("return outside of a subroutine: remove it")

    def _is_in_subroutine(self) -> bool:
        return bool(self._open) and self.at[self._open[0]].keyword == "sub"

    def _add_subroutine(self, index: int, o_line: OLine) -> None:
        if self._open:
            raise o_line.error("a subroutine cannot begin inside another structure: move it")
        if o_line.label in self.subroutines:
            raise o_line.error(f"subroutine o<{o_line.label}> is there already: rename one")
        self.subroutines[o_line.label] = index
        self._open.append(index)

    def _innermost(self, o_line: OLine, keyword: str) -> OLine:
        opener = self.at[self._open[-1]] if self._open else None
        if opener is None or opener.keyword != keyword or opener.label != o_line.label:
            raise o_line.error(
                f"{o_line.keyword} without o<{o_line.label}> {keyword}: check labels and order"
            )
        return opener

    def _closes_do(self, o_line: OLine) -> bool:
        opener = self.at[self._open[-1]] if self._open else None
        return opener is not None and opener.keyword == "do" and opener.label == o_line.label

    def _close(self, index: int, o_line: OLine, keyword: str) -> None:
        opener = self._innermost(o_line, keyword)
        o_line.opener = self._open.pop()
        opener.closer = index

    def _enclosing_loop(self, o_line: OLine) -> int:
        for index in reversed(self._open):
            opener = self.at[index]
            if opener.keyword in _LOOPS and opener.label == o_line.label:
                return index
        raise o_line.error(f"{o_line.keyword} is not inside a loop o<{o_line.label}>: check labels")


@dataclass(slots=True)
class _Frame:
    """An active subroutine, or the main program: the line after its call, and its remaining repeats."""

    back: int
    repeats: dict[int, int] = field(default_factory=dict)


class Flow:
    """Decides which line comes next. `most_jumps` bounds calls and backward jumps."""

    def __init__(self, structure: Structure, interpreter: Interpreter, most_jumps: int) -> None:
        """Begin in the main program."""
        self._structure = structure
        self._interpreter = interpreter
        self._frames = [_Frame(-1)]
        self._most_jumps = most_jumps
        self._jumps = 0

    def next_index(self, index: int, o_line: OLine) -> int:
        """Execute a line with an O-word; return the index of the line that follows.

        Raises ToolpathError: a value is wrong, an unknown subroutine, too many levels or jumps.
        """
        step = getattr(self, f"_{o_line.keyword}", None)
        scanner = Scanner(o_line.line, self._interpreter.parameters, o_line.rest)
        self._interpreter.modes.line = o_line.line.number
        following = index + 1 if step is None else int(step(index, o_line, scanner))
        if following <= index or o_line.keyword == "call":
            self._count_jump(o_line)
        return following

    def _count_jump(self, o_line: OLine) -> None:
        self._jumps += 1
        if self._jumps > self._most_jumps:
            raise o_line.error(
                f"more than {self._most_jumps} jumps: the program has no end, or needs a higher limit of jumps"
            )

    def _condition(self, o_line: OLine, scanner: Scanner) -> float:
        value = scanner.expression()
        _check_end(o_line, scanner)
        return value

    def _if(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        if self._condition(o_line, scanner):
            return index + 1
        for branch in o_line.branches:
            other = self._structure.at[branch]
            there = Scanner(other.line, self._interpreter.parameters, other.rest)
            if other.keyword == "else":
                _check_end(other, there)
                return branch + 1
            if self._condition(other, there):
                return branch + 1
        return o_line.closer + 1

    def _elseif(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        """Reached at the end of the branch above: continue after the whole structure."""
        return self._structure.at[o_line.opener].closer + 1

    _else = _elseif

    def _endif(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        _check_end(o_line, scanner)
        return index + 1

    _do = _endif

    def _while(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        continues = self._condition(o_line, scanner)
        if o_line.opener >= 0:
            return o_line.opener + 1 if continues else index + 1
        return index + 1 if continues else o_line.closer + 1

    def _endwhile(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        _check_end(o_line, scanner)
        return o_line.opener

    def _repeat(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        count = round(self._condition(o_line, scanner))
        self._frames[-1].repeats[index] = count
        return index + 1 if count > 0 else o_line.closer + 1

    def _endrepeat(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        _check_end(o_line, scanner)
        repeats = self._frames[-1].repeats
        repeats[o_line.opener] -= 1
        return o_line.opener + 1 if repeats[o_line.opener] > 0 else index + 1

    def _break(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        _check_end(o_line, scanner)
        return self._structure.at[o_line.opener].closer + 1

    def _continue(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        _check_end(o_line, scanner)
        loop = self._structure.at[o_line.opener]
        return o_line.opener if loop.keyword == "while" else loop.closer

    def _sub(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        """Reached from the line above: a definition is not executed."""
        return o_line.closer + 1

    def _call(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        label = o_line.label
        if not label:
            at = Scanner(o_line.line, self._interpreter.parameters, o_line.place + 1)
            label = str(at.integer())
        start = self._structure.subroutines.get(label)
        if start is None:
            text = f"no subroutine o<{label}> in this file: copy it into the file"
            raise o_line.error(text)
        arguments = self._arguments(o_line, scanner)
        if len(self._frames) > MOST_LEVELS:
            raise o_line.error(f"more than {MOST_LEVELS} subroutines within one another")
        self._interpreter.parameters.enter(arguments)
        self._frames.append(_Frame(index + 1))
        return start + 1

    def _arguments(self, o_line: OLine, scanner: Scanner) -> list[float]:
        arguments: list[float] = []
        while scanner.at < len(scanner.text):
            if scanner.text[scanner.at] == COMMENT:
                scanner.at += 1
                continue
            if len(arguments) == ARGUMENTS:
                raise o_line.line.error(scanner.at, f"more than {ARGUMENTS} arguments")
            arguments.append(scanner.expression())
        return arguments

    def _return(self, index: int, o_line: OLine, scanner: Scanner) -> int:
        value = None
        if scanner.text[scanner.at : scanner.at + 1] == "[":
            value = scanner.expression()
        _check_end(o_line, scanner)
        self._interpreter.modes.returned = value
        self._interpreter.parameters.leave()
        return self._frames.pop().back

    _endsub = _return


def _check_end(o_line: OLine, scanner: Scanner) -> None:
    if scanner.text[scanner.at :].strip(COMMENT):
        raise o_line.line.error(scanner.at, f"nothing can follow {o_line.keyword}: remove it")
