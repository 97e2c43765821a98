# SPDX-License-Identifier: MIT
"""Reading TOML tables with checks whose messages name the file, the key and the remedy. Used by many modules of
host_tools: the readers of path, machine, drive, scenario and campaign files. Reads the file that it is given, and
checks whether files are there.

A `Table` keeps its file and the name of its section. Each getter returns a value of the promised type and range, or
raises `InputError` with one line such as `path.toml: [feed] nominal_mm_s must be a number, but is "fast"`.

No schema library is used: the messages of msgspec name neither the value nor near keys, so these getters would still be
needed.
"""

from __future__ import annotations

import difflib
import math
import tomllib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError, one_line
from ..names import AXES

MAX_FILE_BYTES = 64 * 2**20
"""A configuration file above this size is refused unread (10^5 points take about 4 MB)."""

_MISSING: Any = object()
_COUNTS = {2: "two", 3: "three", 4: "four", 5: "five", 6: "six"}


def read_toml(file: Path) -> dict[str, Any]:
    """The contents of a TOML file.

    Raises InputError: no such file, not readable, too large, not UTF-8, not TOML.
    """
    try:
        if file.stat().st_size > MAX_FILE_BYTES:
            raise InputError(f"{file}: larger than {MAX_FILE_BYTES >> 20} MB: is this a path file?")
        return tomllib.loads(file.read_bytes().decode("utf-8"))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except IsADirectoryError:
        raise InputError(f"{file}: is a directory: name a TOML file") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror}") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{file}: not UTF-8 text (byte {error.start}): is it TOML?") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{file}: not valid TOML: {one_line(error)}") from None
    except RecursionError:
        raise InputError(f"{file}: not valid TOML: nested too deeply") from None


def is_there(file: Path) -> bool:
    """Whether there is a file of this name; False also for a name that no file can have, such as one that is too
    long.
    """
    try:
        return file.is_file()
    except OSError:
        return False


class Table:
    """One table of a TOML file, with the names that it may hold."""

    def __init__(
        self, file: Path, section: str, data: Mapping[str, Any], known: Collection[str]
    ) -> None:
        """Wrap `data`; raises InputError when it holds a key outside `known`."""
        self.file = file
        self.section = section
        self._data = data
        for key in data:
            if key not in known:
                raise InputError(f"{file}: {self._name(key)}: unknown key; {_advice(key, known)}")

    def _name(self, key: str) -> str:
        return f"[{self.section}] {key}" if self.section else f"[{key}]"

    def error(self, key: str, message: str) -> InputError:
        """An InputError about one key of this table."""
        return InputError(f"{self.file}: {self._name(key)} {message}")

    def has(self, key: str) -> bool:
        """Whether the file gives this key."""
        return key in self._data

    def is_text(self, key: str) -> bool:
        """Whether the file gives this key, and as a text."""
        return isinstance(self._data.get(key), str)

    def is_list(self, key: str) -> bool:
        """Whether the file gives this key, and as a list."""
        return isinstance(self._data.get(key), list)

    def is_table(self, key: str) -> bool:
        """Whether the file gives this key, and as a table."""
        return isinstance(self._data.get(key), Mapping)

    def contents(self, key: str) -> Mapping[str, Any]:
        """The table of a key for which `is_table` holds, unchecked."""
        found: Mapping[str, Any] = self._data[key]
        return found

    def _get(self, key: str, default: Any, what: str) -> Any:
        if key in self._data:
            return self._data[key]
        if default is _MISSING:
            raise self.error(key, f"is missing: add {key} = {what}")
        return default

    def number(
        self, key: str, default: float = _MISSING, *, low: float = -1e12, high: float = 1e12
    ) -> float:
        """A finite number from `low` to `high`, both included."""
        value = self._get(key, default, "a number")
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise self.error(key, f"must be a number, but is {_show(value)}")
        value = _as_float(value)
        if not math.isfinite(value):
            raise self.error(key, f"must be a finite number, but is {value}")
        if not low <= value <= high:
            raise self.error(key, f"must be from {low:g} to {high:g}, but is {value:g}")
        return value

    def optional_number(self, key: str, *, low: float, high: float) -> float | None:
        """As `number`; None when the file does not give the key."""
        return self.number(key, low=low, high=high) if self.has(key) else None

    def optional_per_axis(
        self, key: str, count: int, *, low: float, high: float
    ) -> tuple[float, ...] | None:
        """A number for all axes alike, or one for each of `count`; None when the file does not give the key."""
        if not self.has(key):
            return None
        if isinstance(self._data[key], (list, tuple)):
            return self.vector(key, count, low=low, high=high)
        return (self.number(key, low=low, high=high),) * count

    def integer(self, key: str, default: int = _MISSING, *, low: int, high: int) -> int:
        """A whole number from `low` to `high`, both included."""
        value = self._get(key, default, "a whole number")
        if isinstance(value, bool) or not isinstance(value, int):
            raise self.error(key, f"must be a whole number, but is {_show(value)}")
        if not low <= value <= high:
            raise self.error(key, f"must be from {low} to {high}, but is {value}")
        return value

    def choice(self, key: str, choices: Sequence[str], default: str = _MISSING) -> str:
        """One of the words `choices`."""
        value = self._get(key, default, " or ".join(f'"{c}"' for c in choices))
        if value not in choices or not isinstance(value, str):
            advice = _advice(value, choices) if isinstance(value, str) else "use one of: "
            if not isinstance(value, str):
                advice += ", ".join(choices)
            raise self.error(key, f"cannot be {_show(value)}; {advice}")
        return value

    def text(self, key: str, default: str = _MISSING) -> str:
        """A text that is not empty."""
        value = self._get(key, default, "a text")
        if not isinstance(value, str) or not value.strip():
            raise self.error(key, f"must be a text, but is {_show(value)}")
        return value

    def flag(self, key: str, default: bool = _MISSING) -> bool:
        """true or false."""
        value = self._get(key, default, "true or false")
        if not isinstance(value, bool):
            raise self.error(key, f"must be true or false, but is {_show(value)}")
        return value

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of one or more texts that are not empty."""
        value = self._get(key, _MISSING, '["a", "b", ...]')
        if not isinstance(value, list) or not value:
            raise self.error(key, f"must be a list of texts, but is {_show(value)}")
        return tuple(Table(self.file, self.section, {key: v}, (key,)).text(key) for v in value)

    def pair(
        self, key: str, default: tuple[float, float] = _MISSING, *, low: float, high: float
    ) -> tuple[float, float]:
        """Two finite numbers from `low` to `high`."""
        if key not in self._data and default is not _MISSING:
            return default
        one, two = self.vector(key, 2, low=low, high=high)
        return one, two

    def vector(self, key: str, count: int, *, low: float, high: float) -> tuple[float, ...]:
        """`count` (2 to 6) finite numbers from `low` to `high`."""
        form = f"[{', '.join('abcdef'[:count])}]"
        value = self._get(key, _MISSING, form)
        if not isinstance(value, (list, tuple)) or len(value) != count:
            raise self.error(key, f"must be {_COUNTS[count]} numbers {form}, but is {_show(value)}")
        each = [Table(self.file, self.section, {key: item}, (key,)) for item in value]
        return tuple(one.number(key, low=low, high=high) for one in each)

    def numbers(self, key: str, *, low: float = -1e9, high: float = 1e9) -> tuple[float, ...]:
        """A list of one or more different finite numbers from `low` to `high`."""
        value = self._get(key, _MISSING, "[a, b, ...]")
        if not isinstance(value, list) or not value:
            raise self.error(key, f"must be a list of numbers, but is {_show(value)}")
        each = [Table(self.file, self.section, {key: item}, (key,)) for item in value]
        found = tuple(one.number(key, low=low, high=high) for one in each)
        if len(set(found)) < len(found):
            raise self.error(key, f"holds a number twice: {_show(value)}")
        return found

    def triple(self, key: str, *, low: float, high: float) -> tuple[float, float, float]:
        """Three finite numbers from `low` to `high`."""
        x, y, z = self.vector(key, 3, low=low, high=high)
        return x, y, z

    def points(self, key: str, *, limit: float) -> NDArray[np.float64]:
        """A list of [x, y], of [x, y, z], or of these with one to three extra axes, as an array (n, 2 … 6).

        Each component is within ±`limit`.
        """
        value = self._get(key, _MISSING, "[[x, y], ...]")
        if not isinstance(value, list) or not value:
            raise self.error(key, f"must be a list [[x, y], ...], but is {_show(value)}")
        first = value[0]
        if isinstance(first, list) and len(first) > len(AXES):
            raise self.error(
                key, f"point 0 has {len(first)} numbers: at most {len(AXES)}, one for each axis"
            )
        size = len(first) if isinstance(first, list) and 2 <= len(first) <= len(AXES) else 2
        form = f"[{', '.join(AXES[:size])}]" + (" like the first" if size > 2 else "")
        for i, point in enumerate(value):
            if not isinstance(point, list) or len(point) != size:
                raise self.error(key, f"point {i} must be {form}, but is {_show(point)}")
            for axis, coordinate in zip(AXES, point, strict=False):
                self._check_coordinate(key, i, coordinate, limit, _COUNTS[size], axis in "xyz")
        return np.asarray(value, dtype=np.float64)

    def _check_coordinate(
        self, key: str, i: int, coordinate: Any, limit: float, count: str, drawn: bool
    ) -> None:
        if isinstance(coordinate, bool) or not isinstance(coordinate, (int, float)):
            raise self.error(key, f"point {i} holds {_show(coordinate)}: give {count} numbers")
        if not math.isfinite(_as_float(coordinate)):
            raise self.error(
                key, f"point {i} holds {_show(coordinate)}: give {count} finite numbers"
            )
        if abs(coordinate) > limit:
            unit = " mm" if drawn else ""
            raise self.error(key, f"point {i} holds {coordinate:g}: at most {limit:g}{unit} from 0")

    def table(self, key: str, known: Collection[str], *, required: bool = True) -> Table:
        """The sub-table `key`; empty when it is absent and not required. Its messages begin with [outer.key]."""
        if key not in self._data and required:
            raise InputError(f"{self.file}: the section {self._name(key)} is missing: add it")
        value = self._data.get(key, {})
        if not isinstance(value, dict):
            raise self.error(key, f"must be a section, but is {_show(value)}")
        section = f"{self.section}.{key}" if self.section else key
        return Table(self.file, section, value, known)

    def tables(self, key: str, known: Collection[str], *, required: bool = True) -> list[Table]:
        """The array of tables [[key]]; at least one where it is required."""
        if not required and not self.has(key):
            return []
        value = self._data.get(key, [])
        name = f"{self.section}.{key}" if self.section else key
        if not isinstance(value, list) or not value or not all(isinstance(v, dict) for v in value):
            raise InputError(f"{self.file}: needs one section [[{name}]] or more")
        return [Table(self.file, f"{name} {i + 1}", v, known) for i, v in enumerate(value)]

    def path(self, key: str) -> Path:
        """A file name, relative to the directory of this file; the file need not be there."""
        name = self.text(key)
        if "\0" in name:
            raise self.error(key, "holds a NUL character: name a file")
        return self.file.parent / Path(name).expanduser()

    def present(self, key: str) -> Path:
        """As `path`, of a file that is there."""
        found = self.path(key)
        if not is_there(found):
            raise self.error(key, f"names {found}, which is not there")
        return found


def _advice(key: str, known: Collection[str]) -> str:
    near = difflib.get_close_matches(key, list(known), n=1, cutoff=0.6)
    if near:
        return f'did you mean "{near[0]}"?'
    return "use one of: " + ", ".join(known)


def _as_float(value: float) -> float:
    try:
        return float(value)
    except OverflowError:  # an integer of hundreds of digits
        return math.inf if value > 0 else -math.inf


def _show(value: object) -> str:
    text = repr(value) if not isinstance(value, str) else f'"{value}"'
    text = " ".join(text.split())
    return text if len(text) <= 40 else text[:37] + "..."
