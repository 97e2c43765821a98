# SPDX-License-Identifier: MIT
"""The most stack that a linked image can need, from its own instructions. Used by tools/check_image and tools/size.
Reads stack.toml, and the image by `analysis/image`.

Each path through each function, also of libraries, is followed with the value of the stack pointer, so the stack in use
at each call is known. firmware/targets/stack.toml has what instructions do not show: targets of calls through pointers,
and the interrupts. Recursion, a stack that grows in a loop, and instructions that cannot be interpreted are
StackErrors.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from functools import cached_property
from pathlib import Path

from analysis.effects import StackError, effect
from analysis.image import Function, Image

_MOST_BYTES = 1 << 16
"""At a greater depth the stack is taken to grow in a loop."""
_FRAME_BYTES, _FPU_FRAME_BYTES = 32 + 4, 104 + 4  # each with the word that aligns it to 8


@dataclass(frozen=True)
class Rules:
    """stack.toml: calls through pointers, by caller; levels of interrupts, by handler. Names are patterns."""

    calls: dict[str, list[str]] = field(default_factory=dict)
    interrupts: dict[str, int] = field(default_factory=dict)

    @classmethod
    def read(cls, file: Path) -> Rules:
        """From the file."""
        data = tomllib.loads(file.read_text(encoding="utf-8"))
        return cls(data["calls"], data["interrupts"])


@dataclass(frozen=True)
class Call:
    """Stack taken when it is made; `callee` is None for one through a pointer."""

    taken: int
    callee: Function | None


@dataclass(frozen=True)
class Frame:
    """One function: the most that it takes itself, and its calls."""

    most: int
    calls: frozenset[Call]


def frame(image: Image, function: Function) -> Frame:
    """Follows all paths through a function."""
    index = {instruction.address: i for i, instruction in enumerate(function.instructions)}
    taken: dict[int, int] = {}
    calls: set[Call] = set()
    todo, jumped = [(0, 0)], -1
    while todo or jumped >= 0:
        if not todo:  # after a jump by a table: whatever no other path leads to
            left = [i for i in index.values() if i not in taken]
            if not left:
                break
            todo = [(left[0], jumped)]
        i, depth = todo.pop()
        if taken.get(i, -1) >= depth:
            continue
        if depth > _MOST_BYTES:
            raise StackError(f"{function.name}: the stack grows in a loop")
        taken[i] = depth
        does = effect(image, function, i)
        depth += does.grows
        if does.jump:
            jumped = max(jumped, depth)
        if does.indirect:
            calls.add(Call(depth, None))
        if does.call is not None:
            calls.add(Call(depth, image.function_at(does.call)))
        if does.branch is not None and does.branch in index:
            todo.append((index[does.branch], depth))
        elif does.branch is not None:
            calls.add(Call(depth, image.function_at(does.branch)))
        if does.falls and i + 1 < len(function.instructions):
            todo.append((i + 1, depth))
        elif does.falls and does.call is None:
            calls.update(Call(depth, below) for below in _below(image, function))
    most = max(depth + max(0, effect(image, function, i).grows) for i, depth in taken.items())
    return Frame(most, frozenset(calls))


def _below(image: Image, function: Function) -> list[Function]:
    """The symbol that a function without an end runs into. Padding runs nowhere."""
    last = function.instructions[-1]
    if last.mnemonic.startswith("nop"):
        return []
    return [f for f in image.functions if f.address - last.address in (2, 4)]


@dataclass(frozen=True, order=True)
class Need:
    """Bytes, and the chain of calls that needs them."""

    bytes: int
    path: tuple[str, ...]


class Stack:
    """The bound of one image."""

    def __init__(self, image: Image, rules: Rules) -> None:
        self.image = image
        self._rules = rules
        self._worst: dict[int, Need] = {}

    @cached_property
    def room(self) -> int:
        """What the linker script gives."""
        symbols = self.image.symbols
        return symbols["startup_stack_top"] - symbols["startup_stack_bottom"]

    @cached_property
    def parts(self) -> dict[str, Need]:
        """The main loop, then each level of interrupts with its exception frame."""
        symbols = self.image.symbols
        found = {"main": self.worst(self.image.function_at(symbols["startup_reset"] & ~1))}
        for handler in self._handlers():
            name, need = f"interrupt {self._level(handler)}", self.worst(handler)
            found[name] = max(need, found.get(name, need))
        frame_bytes = _FPU_FRAME_BYTES if self.image.has_fpu else _FRAME_BYTES
        return {
            name: Need(need.bytes + (0 if name == "main" else frame_bytes), need.path)
            for name, need in sorted(found.items(), reverse=True)
        }

    @property
    def bytes(self) -> int:
        """The bound: the main loop and all levels one upon the other."""
        return sum(need.bytes for need in self.parts.values())

    def _handlers(self) -> list[Function]:
        """Functions in the table of vectors, but reset."""
        symbols = self.image.symbols
        if "startup_vectors_end" not in symbols:
            return []
        begin, end = symbols["startup_vectors_begin"], symbols["startup_vectors_end"]
        words = {self.image.word(address) & ~1 for address in range(begin + 8, end, 4)} - {0}
        return [self.image.function_at(word) for word in sorted(words)]

    def _level(self, handler: Function) -> int:
        for pattern, level in self._rules.interrupts.items():
            if fnmatchcase(handler.name, pattern):
                return level
        raise StackError(f"{handler.name} is in the table of vectors, not in [interrupts]")

    def worst(self, function: Function, above: tuple[Function, ...] = ()) -> Need:
        """From the entry of a function on, called through `above`."""
        known = self._worst.get(function.address)
        if known is not None:
            return known
        if function in above:
            circle = [f.name for f in (*above[above.index(function) :], function)]
            raise StackError("recursion: " + " -> ".join(circle))
        own = frame(self.image, function)
        worst = Need(own.most, (function.name,))
        for call in own.calls:
            for callee in [call.callee] if call.callee else self._pointed(function):
                deeper = self.worst(callee, (*above, function))
                worst = max(worst, Need(call.taken + deeper.bytes, (function.name, *deeper.path)))
        self._worst[function.address] = worst
        return worst

    def _pointed(self, caller: Function) -> list[Function]:
        """Where the calls of a function through pointers may go."""
        for pattern, callees in self._rules.calls.items():
            if fnmatchcase(caller.name, pattern):
                return [
                    function
                    for function in self.image.functions
                    if any(fnmatchcase(function.name, callee) for callee in callees)
                ]
        raise StackError(f"{caller.name} calls through a pointer and is not in [calls]")
