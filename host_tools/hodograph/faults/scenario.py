# SPDX-License-Identifier: MIT
"""Scenario files: a fault with random places and strengths, and the expected reaction. Used by campaign/,
cli/faults_command, faults/ and schemas/campaign_file. Reads the files that it is given.

text = "what happens"
path = "path.toml"                  # the program, and by it the machine; relative to the file
rules = ["drop at={at} id={tpdo1}"] # docs/reference/protocol.md section 4, with the names drawn below
[random]
at = [20, 500]                      # a whole number from the first to the second
node = [2, 3]                       # also gives {tpdo1}, {tpdo2}, {rpdo1}
side = ["controller", "drives"]     # one of these words
[host]
action = "kill-controller"          # what the host does, at tick {at}
[expect]
codes = [0x8250]                    # fault codes of which one must be raised, and no other; none: no fault at all
may = true                          # a fault is allowed, not required
within_ticks = 5                    # from the first injection to the fault
within_ms = 300                     # the same in wall time, where ticks do not go on
rest_ticks = 400                    # from the fault until the axes are at rest
rest_ms = 400                       # the same in wall time
on_path = true                      # the setpoints come to rest on the path, within the program's bound of a fault stop
unseen = true                       # a drive may stop sending as its axis comes to rest: the others are judged
recover_ms = 3000                   # from the reset until the drives are found and configured anew
"""

from __future__ import annotations

import random
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from string import Formatter
from typing import Any

from ..config.table import Table, is_there, read_toml
from ..errors import InputError

ACTIONS = (
    "none",
    "kill-controller",
    "kill-drives",
    "kill-one-drive",
    "kill-host",
    "watch-drives",
    "cut-upload",
    "kill-upload",
)
NO_LIMIT = 10**9
RECOVER_MS, NOTHING_TO_RESET_MS = 3000, 1000
"""Longest recovery of a fault; and of scenarios without codes, whose machine continues by itself."""
_EXPECT = (
    *("codes", "may", "within_ticks", "within_ms", "rest_ticks", "rest_ms", "same_encoders"),
    *("unseen", "recover_ms", "on_path"),
)

NEEDED = {
    "kill-one-drive": ("node",),
    "kill-upload": ("frames",),
    "cut-upload": ("permille", "manner"),
}
"""Names that an action takes from [random]."""

_OF_SCENARIOS = {"rules", "random", "host", "expect"}
"""Keys that path and machine files next to the scenarios do not have."""

Drawn = int | str


@dataclass(frozen=True)
class Expectation:
    """The expected reaction to a fault. Times that are not given are not checked."""

    codes: tuple[int, ...]
    may: bool
    within_ticks: int
    within_ms: int
    rest_ticks: int
    rest_ms: int
    same_encoders: bool = True
    unseen: bool = False
    recover_ms: int = RECOVER_MS
    on_path: bool = False

    @property
    def limits_rest(self) -> bool:
        """Whether the recording has to show that the axes come to rest in time."""
        return min(self.rest_ticks, self.rest_ms) < NO_LIMIT


@dataclass(frozen=True)
class Scenario:
    """A scenario file; `name` is the file's."""

    name: str
    text: str
    path: Path
    rules: tuple[str, ...]
    ranges: Mapping[str, tuple[Drawn, ...]]
    action: str
    expect: Expectation


@dataclass(frozen=True)
class Case:
    """A scenario with what one seed drew."""

    scenario: Scenario
    seed: int
    drawn: Mapping[str, Drawn]

    @property
    def rules(self) -> str:
        """The text of the rule file."""
        return "".join(f"{rule.format_map(self.drawn)}\n" for rule in self.scenario.rules)

    @property
    def at(self) -> int:
        """The tick of the host's action."""
        return int(self.drawn.get("at", 0))

    @property
    def last_tick(self) -> int:
        """The tick at which the last rule has ended."""
        ends = [0]
        for rule in self.rules.splitlines():
            at, lasts = re.search(r"\bat=(\d+)", rule), re.search(r"\bfor=(\d+)", rule)
            ends.append((int(at[1]) if at else 0) + (int(lasts[1]) if lasts else 1))
        return max(ends)

    @property
    def longest_ms(self) -> int:
        """The longest wall time that a rule acts."""
        return max(map(int, re.findall(r"\bfor_ms=(\d+)", self.rules)), default=0)

    def __str__(self) -> str:
        return f"{self.scenario.name} seed {self.seed}"


def load_scenario(file: Path) -> Scenario:
    """Raises InputError."""
    root = Table(file, "", read_toml(file), ("text", "path", "rules", "random", "host", "expect"))
    expect = root.table("expect", _EXPECT, required=False)
    host = root.table("host", ("action",), required=False)
    raw = read_toml(file)
    scenario = Scenario(
        name=file.stem,
        text=root.text("text"),
        path=root.path("path"),
        rules=_texts(root, raw, "rules"),
        ranges=_ranges(root, raw),
        action=host.choice("action", ACTIONS, "none"),
        expect=_expectation(expect, raw.get("expect", {})),
    )
    _try(scenario, root)
    return scenario


def inline_scenario(table: Table, raw: Mapping[str, Any], name: str) -> Scenario:
    """Rules within another file: the keys `rules` and `random` of one of its tables. Raises InputError."""
    scenario = Scenario(
        name=name,
        text=name,
        path=table.file,
        rules=_texts(table, raw, "rules"),
        ranges=_ranges(table, raw),
        action="none",
        expect=_expectation(table, {}),
    )
    _try(scenario, table)
    return scenario


def _ranges(root: Table, raw: Mapping[str, Any]) -> dict[str, tuple[Drawn, ...]]:
    random_ = raw.get("random", {})
    if not isinstance(random_, dict):
        raise root.error("random", "must be a section")
    ranges = {name: _range(root, name, value) for name, value in random_.items()}
    if isinstance(ranges.get("at", (0,))[0], str):
        raise root.error("random", "at must be [least, greatest], two ticks")
    return ranges


def _try(scenario: Scenario, root: Table) -> None:
    for name in NEEDED.get(scenario.action, ()):
        if name not in scenario.ranges:
            raise root.error(
                "random", f'must have {name}, which the action "{scenario.action}" needs'
            )
    for rule in scenario.rules:
        _require_names(rule, root)
    try:
        case = draw(scenario, 0)
        case.rules  # noqa: B018
    except (KeyError, IndexError, ValueError) as error:
        raise root.error("rules", f"name what [random] does not give: {error}") from None
    try:
        case.last_tick, case.longest_ms  # noqa: B018
    except ValueError:
        raise root.error("rules", "hold a number that is too long") from None


def _require_names(rule: str, root: Table) -> None:
    """Raises InputError: braces contain more than a name, such as attributes, indices or formats of Python."""
    try:
        fields = [field[1:] for field in Formatter().parse(rule) if field[1] is not None]
    except ValueError as error:
        raise root.error("rules", f"hold {rule!r}: {error}") from None
    for name, form, conversion in fields:
        if not str(name).isidentifier() or form or conversion:
            raise root.error("rules", f"hold {rule!r}: between braces is a name and nothing else")


def _texts(table: Table, raw: Mapping[str, Any], key: str) -> tuple[str, ...]:
    values = raw.get(key, [])
    if not isinstance(values, list) or not all(isinstance(value, str) for value in values):
        raise table.error(key, "must be a list of texts")
    return tuple(values)


def _range(root: Table, name: str, value: object) -> tuple[Drawn, ...]:
    if isinstance(value, list) and value and all(isinstance(item, str) for item in value):
        return tuple(value)
    whole = isinstance(value, list) and len(value) == 2 and all(type(v) is int for v in value)
    if not whole or value[0] > value[1]:  # type: ignore[index]
        raise root.error("random", f"{name} must be [least, greatest] or a list of words")
    return tuple(value)  # type: ignore[arg-type]


def _expectation(table: Table, raw: Mapping[str, Any]) -> Expectation:
    codes = raw.get("codes", [])
    if not isinstance(codes, list) or not all(type(code) is int for code in codes):
        raise table.error("codes", "must be a list of numbers such as 0x8130")

    def limit(key: str) -> int:
        return table.integer(key, NO_LIMIT, low=0, high=NO_LIMIT)

    return Expectation(
        codes=tuple(codes),
        may=table.flag("may", False),
        within_ticks=limit("within_ticks"),
        within_ms=limit("within_ms"),
        rest_ticks=limit("rest_ticks"),
        rest_ms=limit("rest_ms"),
        same_encoders=table.flag("same_encoders", True),
        unseen=table.flag("unseen", False),
        recover_ms=table.integer(
            "recover_ms", RECOVER_MS if codes else NOTHING_TO_RESET_MS, low=0, high=NO_LIMIT
        ),
        on_path=table.flag("on_path", False),
    )


def draw(scenario: Scenario, seed: int) -> Case:
    """What a seed makes of a scenario: always the same."""
    source = random.Random(f"{scenario.name} {seed}")
    drawn: dict[str, Drawn] = {"seed": seed + 1}
    for name, values in scenario.ranges.items():
        if isinstance(values[0], str):
            drawn[name] = source.choice(values)
        else:
            drawn[name] = source.randint(int(values[0]), int(values[1]))
    node = drawn.get("node")
    if isinstance(node, int):
        drawn |= {"tpdo1": 0x180 + node, "tpdo2": 0x280 + node, "rpdo1": 0x200 + node}
    return Case(scenario, seed, drawn)


def find_scenarios(folder: Path, names: list[str]) -> list[Scenario]:
    """The scenarios of a folder, or those named (a name may also be a file). Raises InputError."""
    known = {
        file.stem: file
        for file in sorted(folder.glob("*.toml"))
        if _OF_SCENARIOS & set(read_toml(file))
    }
    if not names:
        return [load_scenario(file) for file in known.values()]
    found = []
    for name in names:
        file = known.get(name, Path(name))
        if name not in known and not is_there(file):
            raise InputError(f'there is no scenario "{name}"; {folder} has {", ".join(known)}')
        found.append(load_scenario(file))
    return found
