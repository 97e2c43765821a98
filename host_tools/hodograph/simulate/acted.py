# SPDX-License-Identifier: MIT
"""Time and place at which each output of the path switched in a run, simulated or on a bus; for `outputs` of `--json`,
and for marks in figures. Used by simulate/motion. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..config.outputs import Outputs, PlacedOutput, placed_by
from ..events import Event, Events


@dataclass(frozen=True, kw_only=True)
class ActedOutput(PlacedOutput):
    """One switched output of a run, with the tick whose setpoint was the first at or past the place."""

    tick: int
    time_s: float

    def summary(self) -> dict[str, object]:
        """The keys of `--json`."""
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
    """The outputs that the events of a run switched, in their order.

    event_ticks  (E,) the tick in which each acted; negative: in none
    """
    if outputs is None:
        return []
    found = []
    for event, tick in zip(events.tolist(), event_ticks.tolist(), strict=True):
        if tick >= 0:
            at = {"tick": tick, "time_s": tick * period_us / 1e6}
            found += [ActedOutput(**vars(one), **at) for one in placed_by(outputs, Event(*event))]
    return found
