# SPDX-License-Identifier: MIT
"""Events of a program: outputs that switch at arc lengths (docs/reference/protocol.md 1.8). Used by many modules of
host_tools: program images, jobs, streaming, simulation, the live page. No I/O.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

DIGITAL, ANALOGUE, PROPORTIONAL = 1, 2, 3
"""Kinds of an event."""
DIGITALS, ANALOGUES = 16, 3
"""Outputs that events can switch."""
EVENTS_A_TICK = 16
"""Greatest number of events that one tick may pass, at any override."""
VALUE_LOW, VALUE_HIGH = -(2**15), 2**15 - 1
"""Least and greatest value of an analogue output."""

EVENT = np.dtype(
    [("place", "<i8"), ("kind", "u1"), ("channel", "u1"), ("mask", "<u2"), ("value", "<i4")]
)
"""One event in the program image."""

Events = NDArray[np.void]
"""(E,) records of `EVENT`, by place."""


class Event(NamedTuple):
    """One event: arc length in mm 2^-40, kind, channel of an analogue output, mask of digital ones, value."""

    place_q40: int
    kind: int
    channel: int
    mask: int
    value: int


def no_events() -> Events:
    """An empty table."""
    return np.zeros(0, dtype=EVENT)


def events_of(events: Iterable[Event]) -> Events:
    """A table of events, in the order of their places; events of one place keep their order."""
    return np.array(sorted((tuple(one) for one in events), key=lambda one: one[0]), dtype=EVENT)


class OutputValues(NamedTuple):
    """Levels of the digital outputs, one bit each, and values of the analogue ones, as on the bus."""

    digital: int = 0
    analogue: tuple[int, ...] = (0,) * ANALOGUES

    @property
    def together(self) -> int:
        """All as one number: the digital outputs in its lowest 16 bits, then the analogue ones, 16 bits each."""
        return sum(
            (value & 0xFFFF) << 16 * i for i, value in enumerate((self.digital, *self.analogue))
        )


class SwitchedOutputs:
    """The state of the outputs after events, from all off or from the given ones."""

    def __init__(self, begin: OutputValues | None = None) -> None:
        values = begin or OutputValues()
        self._levels = values.digital
        self._analogue = {
            i: Event(0, ANALOGUE, i, 0, value) for i, value in enumerate(values.analogue) if value
        }

    def act(self, events: Events) -> None:
        """Applies events in their order."""
        for event in map(Event._make, events.tolist()):
            if event.kind == DIGITAL:
                self._levels = (self._levels & ~event.mask) | event.value
            else:
                self._analogue[event.channel] = event

    @property
    def at_rest(self) -> OutputValues:
        """The outputs at standstill, where a value in proportion to the feed is 0."""
        value = [0] * ANALOGUES
        for event in self._analogue.values():
            value[event.channel] = event.value if event.kind == ANALOGUE else 0
        return OutputValues(self._levels, tuple(value))

    def begin(self) -> Events:
        """Events at arc length 0 that bring outputs from all off to this state."""
        found = [Event(0, DIGITAL, 0, self._levels, self._levels)] if self._levels else []
        found += [one._replace(place_q40=0) for one in self._analogue.values() if one.value]
        return events_of(found)


def events_after(events: Events, place_q40: int) -> tuple[Events, Events]:
    """Events up to an arc length, and those after it with places counted from there."""
    at = int(np.searchsorted(events["place"], place_q40, side="right"))
    after = events[at:].copy()
    after["place"] -= place_q40
    return events[:at], after
