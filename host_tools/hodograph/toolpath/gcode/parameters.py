# SPDX-License-Identifier: MIT
"""Parameters of G-code: `#5` and `#<name>`. Used by toolpath/gcode. No I/O; changes its own object only.

Numbered parameters 1 to 5601 are 0 until they are set. Named ones are local to the subroutine that sets them, or to
the main program; those whose name begins with an underscore are global. Some parameters hold the state of the
interpreter and cannot be set (`computed_numbers`, `computed_names`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

GREATEST_NUMBER = 5601
ARGUMENTS = 30
"""Parameters 1 to 30 hold the arguments of a subroutine and come back when it returns."""
STORED_TABLES = range(5161, 5391)
"""Parameters that hold reference points, offsets and coordinate systems (`coordinates`)."""

SHOWS_DEBUG = 5599
"""Parameter that turns off messages of (DEBUG, ...) if it is 0; it begins as 1."""

Getter = Callable[[], float]


class Parameters:
    """All parameters of one program."""

    def __init__(self) -> None:
        """Numbered parameters are 0, and there are no named ones."""
        self.numbered: dict[int, float] = {SHOWS_DEBUG: 1.0}
        self.computed_numbers: dict[int, Getter] = {}
        self.computed_names: dict[str, Getter] = {}
        self._globals: dict[str, float] = {}
        self._locals: list[dict[str, float]] = [{}]
        self._saved: list[dict[int, float]] = []

    def number(self, number: int) -> float:
        """The value of a numbered parameter."""
        getter = self.computed_numbers.get(number)
        return self.numbered.get(number, 0.0) if getter is None else getter()

    def name(self, name: str) -> float | None:
        """The value of a named parameter; None if there is none."""
        getter = self.computed_names.get(name)
        if getter is not None:
            return getter()
        return self._table(name).get(name)

    def is_read_only(self, key: int | str) -> bool:
        """Whether a program cannot set this parameter."""
        return key in self.computed_numbers or key in self.computed_names

    def set(self, key: int | str, value: float) -> None:
        """Set a parameter, which is not read-only."""
        if isinstance(key, int):
            self.numbered[key] = value
        else:
            self._table(key)[key] = value

    def _table(self, name: str) -> dict[str, float]:
        return self._globals if name.startswith("_") else self._locals[-1]

    @property
    def level(self) -> int:
        """How many subroutines are active."""
        return len(self._saved)

    def enter(self, arguments: Sequence[float]) -> None:
        """Begin a subroutine: parameters 1 to 30 are its arguments, and 0 where there is none."""
        numbers = range(1, ARGUMENTS + 1)
        self._saved.append({number: self.numbered.get(number, 0.0) for number in numbers})
        self._locals.append({})
        for number in numbers:
            self.numbered[number] = arguments[number - 1] if number <= len(arguments) else 0.0

    def leave(self) -> None:
        """End a subroutine: parameters 1 to 30 and local names are those of its caller."""
        self.numbered.update(self._saved.pop())
        self._locals.pop()
