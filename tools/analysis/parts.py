# SPDX-License-Identifier: MIT
"""Maps the instructions of an image to parts of the tick, for count_plugin.c. Used by analysis/ and tools/count_til.
Starts objdump and addr2line.

The compiler merges functions, so addr2line (DWARF) gives the functions from which an address was inlined. The innermost
of them that has a rule below gives the part. A function without a rule (helpers, the compiler's own library) counts for
whatever part calls it.
"""

from __future__ import annotations

import itertools
import re
import subprocess
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

# Numbers of the plugin are positions in this list.
PARTS = (
    "rest",
    "rate",
    "feed",
    "search",
    "newton",
    "position",
    "packing",
    "sending",
    "supervision",
)

# FILE:FUNCTION, the first that is found; those of one file from the most special to the most general.
RULES = (
    (r"core/(program_clock|override)\w*\.\w:", "rate"),
    (r"core/feed_piece\.\w:feed_piece_(at|point)", "feed"),
    (r"core/interpolator\.\w:evaluate_feed", "feed"),
    (r"core/kernel_\w+\.\w:(set_|\w+_set$)", "search"),
    (r"core/feed_piece\.\w:\w+_(set|make)$", "search"),
    (r"core/(ph_segment|coefficients)\.\w:", "search"),
    (r"core/interpolator\.\w:(find_|step_)", "search"),
    (r"core/kernel_\w+\.\w:(newton|slope|first_guess)", "newton"),
    (r"core/kernel_\w+\.\w:\w+_at$", "position"),
    (r"core/counts\.\w:", "position"),
    (r"app/machine/axis\.\w:(axis_setpoint|axis_sent)", "packing"),
    (r"canopen/(sync|pdo\w*|cob)\.\w:", "packing"),
    (r"app/tick\.\w:(send|find)_", "sending"),
    (r"app/machine/(machine_|statusword_monitor|tpdo_monitor|statistics)\w*\.\w:", "supervision"),
)
_RULES = tuple((re.compile(pattern), PARTS.index(part)) for pattern, part in RULES)
_LABEL = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_INSTRUCTION = re.compile(r"^ *([0-9a-f]+):\t[0-9a-f ]+\t(\S+)\s*(.*)$")
_RETURN = re.compile(r"^bx lr|^(pop|ldmia).*\bpc\b|^(ret|mret)$")
_CALLS = ("bl", "blx", "jal", "jalr", "c.jal", "c.jalr")


@dataclass(frozen=True)
class Instruction:
    """A line of the disassembly."""

    address: int
    function: str
    name: str
    operands: str


def disassemble(cross: str, image: Path) -> list[Instruction]:
    """All instructions of an image."""
    text = _tool(f"{cross}objdump", "-d", str(image))
    found = []
    function = ""
    for line in text.splitlines():
        label = _LABEL.match(line)
        if label:
            function = label[2]
        instruction = _INSTRUCTION.match(line)
        if instruction:
            address, name, operands = instruction.groups()
            found.append(Instruction(int(address, 16), function, name, operands))
    return found


def returns_to(code: list[Instruction], function: str) -> list[int]:
    """Addresses after the calls of a function."""
    return [
        behind.address
        for call, behind in itertools.pairwise(code)
        if call.name in _CALLS and call.operands.endswith(f"<{function}>")
    ]


def frames(cross: str, image: Path, code: list[Instruction]) -> Iterator[list[str]]:
    """For each instruction the functions it comes from, innermost first, as FILE:FUNCTION."""
    asked = "".join(f"{i.address:x}\n" for i in code)
    text = _tool(f"{cross}addr2line", "-a", "-f", "-i", "-e", str(image), given=asked)
    chain: list[str] = []
    lines = iter(text.splitlines())
    next(lines)
    for line in lines:
        if line.startswith("0x"):
            yield chain
            chain = []
        else:
            chain.append(f"{next(lines).rsplit(':', 1)[0]}:{line}")
    yield chain


def part_of(chain: list[str]) -> int:
    """The part of an instruction, 0 when no rule names it."""
    for frame in chain:
        for pattern, part in _RULES:
            if pattern.search(frame):
                return part
    return 0


def part_lines(cross: str, image: Path, code: list[Instruction]) -> Iterator[str]:
    """`part LOW HIGH N` for each stretch of one part."""
    low, high, part = 0, 0, 0
    for instruction, chain in zip(code, frames(cross, image, code), strict=True):
        new = part_of(chain)
        if new != part:
            if part:
                yield f"part {low:x} {high:x} {part}"
            low, part = instruction.address, new
        high = instruction.address + 1
    if part:
        yield f"part {low:x} {high:x} {part}"


@dataclass(frozen=True)
class Counted:
    """The function whose calls are counted, and the handlers of interrupts that do not count."""

    entry: str
    interrupts: tuple[str, ...] = ()


@dataclass(frozen=True)
class Map:
    """What count_plugin.c reads, and the names of what it counts."""

    text: str
    names: tuple[str, ...]


def _returns(handler: list[Instruction]) -> list[int]:
    ends = [i for i in handler if _RETURN.search(f"{i.name} {i.operands}")]
    if not ends or ends[-1].name.endswith(("eq", "ne")):
        raise RuntimeError(f"{handler[0].function}: where it returns cannot be seen")
    return [i.address for i in ends]


def interrupt_lines(code: list[Instruction], handler: str) -> Iterator[str]:
    """`pause` where a handler begins, `resume` where it returns; static functions can share a name."""
    for name, block in itertools.groupby(code, lambda i: i.function):
        if name == handler:
            own = list(block)
            yield f"pause {own[0].address:x}"
            yield from (f"resume {a:x}" for a in _returns(own))


def _ends(code: list[Instruction], entry: str) -> Iterator[str]:
    """Where a call is over: after what calls it; of a handler in the table of vectors where it returns."""
    after = returns_to(code, entry)
    yield from (f"end {a:x}" for a in after)
    if not after:
        yield from (f"last {a:x}" for a in _returns([i for i in code if i.function == entry]))


def _map(
    code: list[Instruction],
    counted: Counted,
    ranges: Iterable[str],
    names: Iterable[str],
) -> Map:
    begin = [i.address for i in code if i.function == counted.entry][:1]
    lines = [f"begin {a:x}" for a in begin]
    if not begin:
        raise RuntimeError(f"{counted.entry} is not there: was it inlined?")
    lines += _ends(code, counted.entry)
    for handler in counted.interrupts:
        lines += interrupt_lines(code, handler)
    return Map("".join(f"{line}\n" for line in (*lines, *ranges)), tuple(names))


def part_map(cross: str, image: Path, counted: Counted) -> Map:
    """By parts."""
    code = disassemble(cross, image)
    return _map(code, counted, part_lines(cross, image, code), PARTS)


def function_map(cross: str, image: Path, counted: Counted) -> Map:
    """By functions as they are linked, those that the entry can reach by calls, directly or through a pointer."""
    code = disassemble(cross, image)
    spans: dict[str, list[int]] = {}
    for instruction in code:
        spans.setdefault(instruction.function, []).append(instruction.address)
    names = _reachable(code, counted.entry)
    ranges = [
        f"part {spans[name][0]:x} {spans[name][-1] + 1:x} {number}"
        for number, name in enumerate(names, 1)
    ]
    return _map(code, counted, ranges, ["?", *names])


def _reachable(code: list[Instruction], entry: str) -> list[str]:
    """Names of functions, at most as many as the plugin has parts for."""
    uses: dict[str, set[str]] = {}
    for i in code:
        used = re.search(r"<([^>+]+)>", i.operands)
        uses.setdefault(i.function, set()).update({used[1]} if used else set())
    wanted, found = [entry], [entry]
    hidden = [name for name in uses if re.search(r"_(at|set|point|make)$|^set_segment$", name)]
    while wanted:
        for name in sorted(uses.get(wanted.pop(), set())) + (hidden if not wanted else []):
            if name in uses and name not in found:
                found.append(name)
                wanted.append(name)
    return found[:127]


def _tool(*command: str, given: str | None = None) -> str:
    return subprocess.run(command, input=given, capture_output=True, text=True, check=True).stdout
