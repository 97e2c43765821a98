# SPDX-License-Identifier: MIT
"""Numbers, parameters and expressions of G-code (RS274/NGC version 3, section 3.3.2). Used by gcode/block and
gcode/flow. No I/O.

Operators, the strongest first; those of one row go from left to right:

    **
    *  /  MOD
    +  -
    EQ  NE  GT  GE  LT  LE
    AND  OR  XOR

Angles of functions are in degrees. EQ and NE take numbers as equal that differ by less than 0.0001. MOD is never
negative. A logical or comparing operator gives 1 or 0, and takes every number but 0 as true.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable

from .parameters import GREATEST_NUMBER, Parameters
from .source import SourceLine

SAME = 1e-4
"""Numbers that differ by less are equal; an integer may be off by this much."""

MAX_NESTING = 32
"""Most brackets within one another."""

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)")
_FUNCTION = re.compile(r"(abs|acos|asin|atan|cos|exists|exp|fix|fup|ln|round|sin|sqrt|tan)(?=\[)")
_OPERATOR = re.compile(r"\*\*|[-+*/]|mod|eq|ne|gt|ge|lt|le|and|or|xor")
_NAME = re.compile(r"<([!-'*-;=?-~]+)>")


def _modulo(left: float, right: float) -> float:
    rest = math.fmod(left, right)
    return rest + abs(right) if rest < 0.0 else rest


def _round(value: float) -> float:
    return float(math.floor(abs(value) + 0.5)) * math.copysign(1.0, value)


Binary = Callable[[float, float], float]
_OPERATORS: dict[str, tuple[int, Binary]] = {
    "**": (5, math.pow),
    "*": (4, lambda a, b: a * b),
    "/": (4, lambda a, b: a / b),
    "mod": (4, _modulo),
    "+": (3, lambda a, b: a + b),
    "-": (3, lambda a, b: a - b),
    "eq": (2, lambda a, b: float(abs(a - b) < SAME)),
    "ne": (2, lambda a, b: float(abs(a - b) >= SAME)),
    "gt": (2, lambda a, b: float(a > b)),
    "ge": (2, lambda a, b: float(a >= b)),
    "lt": (2, lambda a, b: float(a < b)),
    "le": (2, lambda a, b: float(a <= b)),
    "and": (1, lambda a, b: float(a != 0.0 and b != 0.0)),
    "or": (1, lambda a, b: float(a != 0.0 or b != 0.0)),
    "xor": (1, lambda a, b: float((a != 0.0) != (b != 0.0))),
}

_FUNCTIONS: dict[str, Callable[[float], float]] = {
    "abs": abs,
    "acos": lambda a: math.degrees(math.acos(a)),
    "asin": lambda a: math.degrees(math.asin(a)),
    "cos": lambda a: math.cos(math.radians(a)),
    "exp": math.exp,
    "fix": lambda a: float(math.floor(a)),
    "fup": lambda a: float(math.ceil(a)),
    "ln": math.log,
    "round": _round,
    "sin": lambda a: math.sin(math.radians(a)),
    "sqrt": math.sqrt,
    "tan": lambda a: math.tan(math.radians(a)),
}


class Scanner:
    """Reads values from the compact text of a line; `at` is the place of the next character."""

    __slots__ = ("_nesting", "at", "line", "parameters", "text")

    def __init__(self, line: SourceLine, parameters: Parameters, at: int = 0) -> None:
        """Begin at place `at`."""
        self.line = line
        self.text = line.text
        self.parameters = parameters
        self.at = at
        self._nesting = 0

    def value(self) -> float:
        """Read a number, a parameter, a function or an expression in brackets.

        Raises ToolpathError: none of them is here, or it has no value.
        """
        text, start = self.text, self.at
        found = _NUMBER.match(text, start)
        if found:
            self.at = found.end()
            value = float(found[0])
        else:
            value = self._compound_value()
        if not math.isfinite(value):
            raise self.line.error(start, "the value is too large: use numbers below 1e308")
        return value

    def _compound_value(self) -> float:
        start = self.at
        self._nesting += 1
        if self._nesting > MAX_NESTING:
            raise self.line.error(start, f"more than {MAX_NESTING} levels: use parameters")
        first = self.text[start : start + 1]
        if first in ("+", "-"):
            self.at += 1
            value = self.value()
            value = -value if first == "-" else value
        elif first == "[":
            value = self.expression()
        elif first == "#":
            value = self._parameter_value()
        else:
            value = self._function_value()
        self._nesting -= 1
        return value

    def integer(self) -> int:
        """Read a value that is an integer but for rounding."""
        start = self.at
        value = self.value()
        nearest = math.floor(value + 0.5)
        if abs(value - nearest) > SAME:
            raise self.line.error(start, f"{value:g} is not an integer: write a whole number")
        return nearest

    def expression(self) -> float:
        """Read `[...]`."""
        if self.text[self.at : self.at + 1] != "[":
            raise self.line.error(self.at, 'an expression is missing: write "[...]"')
        self.at += 1
        value = self._operation(1)
        if self.text[self.at : self.at + 1] != "]":
            raise self.line.error(self.at, 'expected an operator or "]"')
        self.at += 1
        return value

    def _operation(self, weakest: int) -> float:
        """Read values joined by operators of at least strength `weakest`."""
        left = self.value()
        while True:
            start = self.at
            found = _OPERATOR.match(self.text, start)
            if found is None:
                return left
            strength, operate = _OPERATORS[found[0]]
            if strength < weakest:
                return left
            self.at = found.end()
            right = self._operation(strength + 1)
            left = self._apply(start, found[0], operate, left, right)

    def _apply(self, at: int, what: str, operate: Callable[..., float], *numbers: float) -> float:
        try:
            value = operate(*numbers)
        except (ValueError, ZeroDivisionError):
            raise self.line.error(at, f"{what.upper()} is not defined for these numbers") from None
        except OverflowError:
            value = math.inf
        if not math.isfinite(value):
            raise self.line.error(at, f"the result of {what.upper()} is too large")
        return value

    def _function_value(self) -> float:
        start = self.at
        found = _FUNCTION.match(self.text, start)
        if found is None:
            raise self.line.error(
                start, 'expected a number, "#", "[" or a function such as SIN[...]'
            )
        self.at = found.end()
        if found[1] == "exists":
            return self._exists()
        argument = self.expression()
        if found[1] != "atan":
            return self._apply(start, found[1], _FUNCTIONS[found[1]], argument)
        if self.text[self.at : self.at + 2] != "/[":
            raise self.line.error(self.at, "ATAN needs two expressions: write ATAN[y]/[x]")
        self.at += 1
        return math.degrees(math.atan2(argument, self.expression()))

    def _exists(self) -> float:
        start = self.at + 1
        self.at = start
        if self.text[start : start + 1] != "#":
            raise self.line.error(start, "EXISTS needs a parameter: write EXISTS[#<name>]")
        key = self.parameter_key()
        if self.text[self.at : self.at + 1] != "]":
            raise self.line.error(self.at, 'expected "]"')
        self.at += 1
        return 1.0 if isinstance(key, int) else float(self.parameters.name(key) is not None)

    def parameter_key(self) -> int | str:
        """Read `#5`, `#[...]` or `#<name>`, as far as it names a parameter."""
        start = self.at
        self.at += 1
        if self.text[self.at : self.at + 1] == "<":
            return self.bracketed_name()
        number = self.integer()
        if not 1 <= number <= GREATEST_NUMBER:
            raise self.line.error(start, f"no parameter #{number}: use 1 to {GREATEST_NUMBER}")
        return number

    def bracketed_name(self) -> str:
        """Read `<name>`."""
        found = _NAME.match(self.text, self.at)
        if found is None:
            raise self.line.error(self.at, 'expected a name in "<" and ">"')
        self.at = found.end()
        return found[1]

    def _parameter_value(self) -> float:
        start = self.at
        key = self.parameter_key()
        if isinstance(key, int):
            return self.parameters.number(key)
        value = self.parameters.name(key)
        if value is None:
            raise self.line.error(start, f"#<{key}> has no value: set it first")
        return value
