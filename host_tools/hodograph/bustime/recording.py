# SPDX-License-Identifier: MIT
"""The load of recorded traffic from its counted bits, compared with the load by the model. Used by bus/analysis. No
I/O.

Time on the bus is the number of SYNCs times the period. So the frames of ticks give the same load in a run at full pace
as in real time. Heartbeats and SDO follow the wall clock.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import RunError
from .frame_bits import exact_bits
from .model import BusTime
from .traffic import CYCLIC, SYNC_ID

OTHER = "SDO and other"


@dataclass(frozen=True)
class KindLoad:
    """One kind of frames: their number, bits, load in per cent, and the model's bounds (None: no model)."""

    kind: str
    frames: int
    bits: int
    measured_percent: float
    plain_percent: float | None
    worst_percent: float | None


@dataclass(frozen=True)
class RecordedLoad:
    """The load of a recording, from its first SYNC to its last."""

    bitrate: int
    periods: int
    kinds: tuple[KindLoad, ...]

    def cyclic(self) -> tuple[float, float, float]:
        """Frames that come once a tick, in per cent: without stuff bits, measured, at worst."""
        rows = [k for k in self.kinds if k.kind in CYCLIC]
        return (
            sum(k.plain_percent or 0.0 for k in rows),
            sum(k.measured_percent for k in rows),
            sum(k.worst_percent or 0.0 for k in rows),
        )

    def summary(self) -> dict[str, object]:
        """The keys that tools may rely on: `bus_load` of `hodograph run --json`."""
        plain, measured, worst = self.cyclic()
        return {
            "bitrate": self.bitrate,
            "measured_percent": measured,
            "model_least_percent": plain,
            "model_worst_percent": worst,
            "kinds": {
                k.kind: {
                    "frames": k.frames,
                    "bits": k.bits,
                    "measured_percent": k.measured_percent,
                    "model_least_percent": k.plain_percent,
                    "model_worst_percent": k.worst_percent,
                }
                for k in self.kinds
            },
        }

    def text(self) -> str:
        """The load as one line of text."""
        plain, measured, worst = self.cyclic()
        return (
            f"{measured:.1f} % at {self.bitrate} bit/s (model {plain:.1f} … {worst:.1f} %), "
            "frames of the ticks"
        )


def recorded_load(frames: NDArray[Any], model: BusTime) -> RecordedLoad:
    """Counts the bits of a recording (fields as struct can_frame). Raises RunError: fewer than two SYNCs."""
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    if sync_at.size < 2:
        raise RunError(f"{sync_at.size} SYNCs recorded: is the controller running?")
    frames = frames[sync_at[0] : sync_at[-1]]
    bits = exact_bits(frames)
    periods = int(sync_at.size) - 1
    window_bits = periods * model.period_us * model.bitrate / 1e6
    rows = []
    known = np.zeros(frames.size, dtype=bool)
    for kind in dict.fromkeys(message.kind for message in model.messages):
        own = np.isin(frames["id"], [m.identifier for m in model.messages if m.kind == kind])
        known |= own
        rows.append(_row(kind, bits[own], window_bits, *model.load_of(kind)))
    rows.append(_row(OTHER, bits[~known], window_bits, None, None))
    return RecordedLoad(model.bitrate, periods, tuple(rows))


def _row(
    kind: str,
    bits: NDArray[np.int64],
    window_bits: float,
    plain: float | None,
    worst: float | None,
) -> KindLoad:
    total = int(bits.sum())
    return KindLoad(kind, int(bits.size), total, 100 * total / window_bits, plain, worst)
