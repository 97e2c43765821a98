# SPDX-License-Identifier: MIT
"""Events of a program: outputs that switch at arc lengths (docs/reference/protocol.md 1.8)."""

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
"""A tick passes at most so many events, at any override."""
VALUE_LOW, VALUE_HIGH = -(2**15), 2**15 - 1
"""Values of an analogue output."""

EVENT = np.dtype(
    [("place", "<i8"), ("kind", "u1"), ("channel", "u1"), ("mask", "<u2"), ("value", "<i4")]
)
"""One event as the image has it."""

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
    """None."""
    return np.zeros(0, dtype=EVENT)


def events_of(events: Iterable[Event]) -> Events:
    """A table of events, in the order of their places; events of one place keep their order."""
    return np.array(sorted((tuple(one) for one in events), key=lambda one: one[0]), dtype=EVENT)
