# SPDX-License-Identifier: MIT
"""Faults of a campaign: the rules of docs/reference/protocol.md section 4 that act on one axis alone. Used by
campaign/definition and campaign/run_settings. No I/O.

Rules that need frames, a bus or a controller that supervises are for `hodograph faults`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from ..errors import InputError
from ..faults.scenario import Scenario, draw
from ..native import FOR_EVER, OfflineFault

_VALUES = {
    "encoder-freeze": None,
    "encoder-jump": "counts",
    "saturate": "volts",
    "load": "volts",
    "drop": None,
}
_RPDO1 = 0x200
LONGEST_TICKS = 4_000_000


@dataclass(frozen=True)
class Fault:
    """A fault that runs may have; `scenario` None: no fault."""

    name: str
    scenario: Scenario | None = None

    def rules(
        self, seed: int, sample: int, nodes: tuple[int, ...], period_us: int
    ) -> list[OfflineFault]:
        """The faults of one sample. Raises InputError: a rule that a run without a bus cannot have."""
        return [offline_fault(line, nodes, period_us) for line in self.lines(seed, sample)]

    def lines(self, seed: int, sample: int) -> list[str]:
        """The rules of one sample as text, as drawn by `hodograph faults --seed` for seed + sample."""
        if self.scenario is None:
            return []
        return [
            line for line in draw(self.scenario, seed + sample).rules.splitlines() if line.strip()
        ]


def offline_fault(rule: str, nodes: tuple[int, ...], period_us: int) -> OfflineFault:
    """A line of rules, for the drives with these node numbers. Raises InputError."""
    kind, *words = rule.split()
    if kind not in _VALUES:
        raise InputError(
            f'rule "{rule}": {kind} needs a bus: use `hodograph faults`, or one of {", ".join(_VALUES)}'
        )
    value_key = _VALUES[kind]
    known = {"at", "for", "for_ms", *({"id", "count"} if kind == "drop" else {"node"})}
    known |= {value_key} if value_key else set()
    given = dict(_pair(rule, word, known) for word in words)
    node = int(_required(rule, given, "id")) - _RPDO1 if kind == "drop" else given.get("node")
    if node not in nodes:
        what = "setpoints (0x200 + node) of" if kind == "drop" else "the node of"
        raise InputError(f'rule "{rule}": is not about {what} an axis of the path ({nodes})')
    return OfflineFault(
        "setpoint-lost" if kind == "drop" else kind,
        nodes.index(int(node)),
        int(_required(rule, given, "at")),
        _ticks(kind, given, period_us),
        0.0 if value_key is None else _required(rule, given, value_key),
    )


def _pair(rule: str, word: str, known: set[str]) -> tuple[str, float]:
    key, _, text = word.partition("=")
    if key not in known:
        raise InputError(f'rule "{rule}": {key} has no place here; {", ".join(sorted(known))}')
    try:
        value = float(text) if key == "volts" else float(int(text, 0))
    except (ValueError, OverflowError):
        raise InputError(f'rule "{rule}": {word} is not a number') from None
    if not math.isfinite(value):
        raise InputError(f'rule "{rule}": {word} is not a finite number')
    least = 0 if key == "at" else 1
    if key in ("at", "for", "for_ms", "count") and not least <= value <= LONGEST_TICKS:
        raise InputError(f'rule "{rule}": {word} is out of range')
    return key, value


def _required(rule: str, given: dict[str, float], key: str) -> float:
    if key not in given:
        raise InputError(f'rule "{rule}": {key} is missing: add {key}=...')
    return given[key]


def _ticks(kind: str, given: dict[str, float], period_us: int) -> int:
    if "for_ms" in given:
        ticks = math.ceil(given["for_ms"] * 1000 / period_us)
    else:
        ticks = int(given.get("for", FOR_EVER if kind == "encoder-jump" else 1))
    return min(ticks, int(given.get("count", FOR_EVER)))  # a drive gets one setpoint a tick
