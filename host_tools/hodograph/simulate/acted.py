# SPDX-License-Identifier: MIT
"""What the outputs on the path did in a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..config.outputs import Outputs
from ..events import DIGITAL, PROPORTIONAL, Event, Events


@dataclass(frozen=True)
class ActedOutput:
    """What became of one output in a run, and when: the tick whose setpoint was the first at or past the place.

    value  true or false of a digital output; of an analogue one in its own unit; `per_mm_s`: from there on it follows
           the feed, by so much for each mm/s
    """

    name: str
    place_mm: float
    tick: int
    time_s: float
    value: float | bool | None
    per_mm_s: float | None = None

    @property
    def words(self) -> str:
        """What became of it, in short."""
        if isinstance(self.value, bool):
            return "on" if self.value else "off"
        return f"{self.value:g}" if self.per_mm_s is None else f"{self.per_mm_s:g} by mm/s"

    def summary(self) -> dict[str, object]:
        """As `--json` gives it."""
        found: dict[str, object] = {
            "name": self.name,
            "place_mm": self.place_mm,
            "time_s": self.time_s,
            "tick": self.tick,
            "value": self.value,
        }
        return found if self.per_mm_s is None else found | {"per_mm_s": self.per_mm_s}


def acted_outputs(
    outputs: Outputs | None, events: Events, event_ticks: NDArray[np.int64], period_us: int
) -> list[ActedOutput]:
    """What the events did that a run came to, in their order.

    event_ticks  (E,) the tick in which each acted; negative: in none
    """
    if outputs is None:
        return []
    found = []
    for event, tick in zip(events.tolist(), event_ticks.tolist(), strict=True):
        if tick >= 0:
            at = (event[0] * 2.0**-40, tick, tick * period_us / 1e6)
            found += _changes(outputs, Event(*event), at)
    return found


def _changes(outputs: Outputs, event: Event, at: tuple[float, int, float]) -> list[ActedOutput]:
    out = []
    for one in outputs.channels:
        if one.digital and event.kind == DIGITAL and event.mask >> one.number & 1:
            out.append(ActedOutput(one.name, *at, bool(event.value >> one.number & 1)))
        elif not one.digital and event.kind != DIGITAL and event.channel == one.number:
            if event.kind == PROPORTIONAL:
                gain = event.value / 65536 / one.scale
                out.append(ActedOutput(one.name, *at, None, gain))
            else:
                out.append(ActedOutput(one.name, *at, event.value / one.scale))
    return out
