# SPDX-License-Identifier: MIT
"""The longest path through a function of a linked image, with all that it calls, in instructions. Used by
tools/longest_path. Reads loops.toml. Reads the image by `analysis/image`, which starts the binary utilities.

All paths through the instructions count, also those that no values lead to. So no execution is longer.
firmware/targets/loops.toml has what instructions do not show: bounds of loops and targets of calls through pointers.
The caller names the functions that are never called. A loop, or a call through a pointer, without an entry is a
LongestError.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path

from analysis.effects import effect
from analysis.image import Function, Image

_NEVER = -(10**9)  # less than the length of any path


class LongestError(Exception):
    """No bound exists, or none could be shown."""


@dataclass(frozen=True)
class Bounds:
    """Contents of loops.toml, and the functions that are never called."""

    rounds: dict[str, int]
    order: dict[str, list[str]]
    never: frozenset[str]

    @classmethod
    def read(cls, file: Path, *never: str) -> Bounds:
        """Reads the file. `never`: functions that are never called."""
        data = tomllib.loads(file.read_text(encoding="utf-8"))
        return cls(data["rounds"], data["order"], frozenset(never))


@dataclass
class _Graph:
    """Instructions of a function: what each costs, and which can follow."""

    cost: dict[int, int] = field(default_factory=dict)
    follow: dict[int, list[int]] = field(default_factory=dict)


@dataclass
class Longest:
    """Of one image."""

    image: Image
    bounds: Bounds
    known: dict[Function, int] = field(default_factory=dict)  # all that were requested
    _open: set[Function] = field(default_factory=set)

    def of(self, name: str) -> int:
        """Of a function by its name."""
        found = [f for f in self.image.functions if f.name == name]
        if len(found) != 1:
            raise LongestError(f"{name}: {len(found)} functions of that name")
        return self._of(found[0])

    def _of(self, function: Function) -> int:
        if function not in self.known:
            if function in self._open:
                raise LongestError(f"{function.name}: recursion")
            self._open.add(function)
            self.known[function] = self._longest(function)
            self._open.remove(function)
        return self.known[function]

    def _longest(self, function: Function) -> int:
        graph = self._graph(function)
        best: dict[int, int] = {}  # from a knot to the end
        for knot in _knots(graph.follow, 0):
            inside = set(knot)
            cost = sum(graph.cost[i] for i in knot)
            if len(knot) > 1 or knot[0] in graph.follow[knot[0]]:
                cost *= self._rounds(function, knot)
            behind = (best[j] for i in knot for j in graph.follow[i] if j not in inside)
            most = cost + max(behind, default=0)
            best.update(dict.fromkeys(knot, most))
        return best[0]

    def _rounds(self, function: Function, knot: list[int]) -> int:
        if function.name not in self.bounds.rounds:
            where = function.instructions[min(knot)].address
            raise LongestError(f"{function.name}: {where:#x}: a loop without a bound")
        return self.bounds.rounds[function.name]

    def _graph(self, function: Function) -> _Graph:
        """Without the instructions that call what is never called. What only a jump by a table leads to follows it."""
        index = {instruction.address: i for i, instruction in enumerate(function.instructions)}
        graph = _Graph()
        jumps: list[int] = []
        todo = [0]
        while todo or jumps:
            if not todo:
                rest = [i for i in index.values() if i not in graph.cost]
                if not rest:
                    break
                for jump in jumps:
                    graph.follow[jump].append(rest[0])
                todo = rest[:1]
            i = todo.pop()
            if i in graph.cost:
                continue
            does = effect(self.image, function, i)
            called = self._pointed(function, i) if does.indirect else []
            if does.call is not None:
                called.append(self.image.function_at(does.call))
            follow = [i + 1] if does.falls and i + 1 < len(function.instructions) else []
            if does.branch in index:
                follow.append(index[does.branch])
            graph.cost[i] = 1 + self._most_expensive(called)
            graph.follow[i] = follow if graph.cost[i] > 0 else []
            todo += graph.follow[i]
            if does.branch is not None and does.branch not in index:
                to = self.image.function_at(does.branch)
                self._leave(graph, i, i + len(function.instructions), to, does.falls)
            if does.jump:
                jumps.append(i)
        return graph

    def _most_expensive(self, called: list[Function]) -> int:
        """Of what an instruction may call; far below zero where it calls what is never called."""
        there = [f for f in called if f.name not in self.bounds.never]
        if called and not there:
            return _NEVER
        return max((self._of(f) for f in there), default=0)

    def _leave(self, graph: _Graph, at: int, leaving: int, to: Function, falls: bool) -> None:
        """A jump into another function, which returns to the caller."""
        cost = self._most_expensive([to])
        if cost > 0:
            graph.cost[leaving], graph.follow[leaving] = cost, []
            graph.follow[at] = [*graph.follow[at], leaving]
        elif not falls:
            graph.cost[at] = _NEVER

    def _pointed(self, function: Function, at: int) -> list[Function]:
        """What a call through a pointer may call: the first of them what is first in loops.toml, and so on."""
        calls = [i for i in range(len(function.instructions)) if self._is_indirect(function, i)]
        names = self.bounds.order.get(function.name, [])
        if len(calls) != len(names):
            raise LongestError(f"{function.name}: {len(calls)} calls through pointers")
        return [f for f in self.image.functions if fnmatchcase(f.name, names[calls.index(at)])]

    def _is_indirect(self, function: Function, index: int) -> bool:
        return effect(self.image, function, index).indirect


def _knots(follow: dict[int, list[int]], start: int) -> Iterable[list[int]]:
    """Strongly connected parts of what can be reached, each after all that can follow it (Tarjan's algorithm)."""
    number: dict[int, int] = {}
    low: dict[int, int] = {}
    stack: list[int] = []
    on_stack: set[int] = set()
    work = [(start, 0)]
    while work:
        node, at = work.pop()
        if at == 0:
            number[node] = low[node] = len(number)
            stack.append(node)
            on_stack.add(node)
        for k in range(at, len(follow[node])):
            below = follow[node][k]
            if below not in number:
                work += [(node, k + 1), (below, 0)]
                break
            if below in on_stack:
                low[node] = min(low[node], number[below])
        else:
            if work:
                low[work[-1][0]] = min(low[work[-1][0]], low[node])
            if low[node] == number[node]:
                knot = stack[stack.index(node) :]
                del stack[stack.index(node) :]
                on_stack.difference_update(knot)
                yield knot
