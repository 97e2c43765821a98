# SPDX-License-Identifier: MIT
"""The outputs on a path by their names: where they switch, and what they did in a run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..config.outputs import Outputs
from ..events import DIGITAL, PROPORTIONAL, Event, Events


@dataclass(frozen=True, kw_only=True)
class PlacedOutput:
    """One output that switches at a place of a path.

    value  true or false of a digital output; of an analogue one in its own unit; `per_mm_s`: from there on it follows
           the feed, by so much for each mm/s
    """

    name: str
    place_mm: float
    value: float | bool | None
    per_mm_s: float | None = None

    @property
    def words(self) -> str:
        """What becomes of it, in short."""
        if isinstance(self.value, bool):
            return "on" if self.value else "off"
        return f"{self.value:g}" if self.per_mm_s is None else f"{self.per_mm_s:g} by mm/s"


@dataclass(frozen=True, kw_only=True)
class ActedOutput(PlacedOutput):
    """What became of one output in a run, and when: the tick whose setpoint was the first at or past the place."""

    tick: int
    time_s: float

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


def placed_outputs(outputs: Outputs | None, events: Events) -> list[PlacedOutput]:
    """What the events of a path switch, in their order; nothing where no outputs are known."""
    if outputs is None:
        return []
    return [one for event in events.tolist() for one in _changes(outputs, Event(*event))]


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
            at = {"tick": tick, "time_s": tick * period_us / 1e6}
            found += [ActedOutput(**vars(one), **at) for one in _changes(outputs, Event(*event))]
    return found


def _changes(outputs: Outputs, event: Event) -> list[PlacedOutput]:
    out = []
    place_mm = event.place_q40 * 2.0**-40
    for one in outputs.channels:
        value: float | bool | None
        gain = None
        if one.digital and event.kind == DIGITAL and event.mask >> one.number & 1:
            value = bool(event.value >> one.number & 1)
        elif not one.digital and event.kind != DIGITAL and event.channel == one.number:
            if event.kind == PROPORTIONAL:
                value, gain = None, event.value / 65536 / one.scale
            else:
                value = event.value / one.scale
        else:
            continue
        out.append(PlacedOutput(name=one.name, place_mm=place_mm, value=value, per_mm_s=gain))
    return out
