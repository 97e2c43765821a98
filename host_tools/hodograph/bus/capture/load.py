# SPDX-License-Identifier: MIT
"""Measures the load of a bus from captured frames (docs/reference/bus-time.md section 3). Used by bus/status_text,
cli/status_command and monitor/pump. Receives frames, and waits by the clock of the bus, real or virtual; sends none.

The load is the bits of all frames, with their computed stuff bits, divided by the bit rate and the time. Shown by
`hodograph status` and the live page.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...bustime.frame_bits import ERROR, EXTENDED, exact_bits
from ..address import BusAddress
from ..clock import REAL_CLOCK, Clock
from .frames import Frames
from .recorder import Recorder

LEAST_LISTEN_S = 0.25
LONGEST_S = 1.0
"""How long captured frames are kept for the next call."""

_CLASSES = (
    ("NMT", 0x000, 0x000),
    ("SYNC", 0x080, 0x080),
    ("EMCY", 0x081, 0x0FF),
    ("TIME", 0x100, 0x100),
    ("TPDO1", 0x181, 0x1FF),
    ("RPDO1", 0x201, 0x27F),
    ("TPDO2", 0x281, 0x2FF),
    ("RPDO2", 0x301, 0x37F),
    ("TPDO3", 0x381, 0x3FF),
    ("RPDO3", 0x401, 0x47F),
    ("TPDO4", 0x481, 0x4FF),
    ("RPDO4", 0x501, 0x57F),
    ("SDO", 0x581, 0x67F),
    ("heartbeat", 0x701, 0x77F),
)
"""COB-IDs of the predefined connection set (CiA 301 tables 38 and 39)."""
OTHER = "other"


@dataclass(frozen=True)
class ClassLoad:
    """One class of COB-IDs: frames a second, and their share of the bus's time."""

    frames_per_s: float
    percent: float


@dataclass(frozen=True)
class BusLoad:
    """The load of a bus during `seconds`; classes without frames are left out."""

    bitrate: int
    seconds: float
    frames_per_s: float
    percent: float
    classes: dict[str, ClassLoad]

    def json(self) -> dict[str, Any]:
        """As nested dictionaries."""
        return asdict(self)


def bus_load(frames: Frames, seconds: float, bitrate: int) -> BusLoad:
    """The load of frames that came during `seconds` on a bus of `bitrate` bit/s."""
    bits = exact_bits(frames)
    kinds = _kinds(frames["id"])
    classes = {}
    for kind, name in enumerate([name for name, _, _ in _CLASSES] + [OTHER]):
        own = bits[kinds == kind]
        if own.size:
            classes[name] = ClassLoad(own.size / seconds, _percent(own, seconds, bitrate))
    return BusLoad(
        bitrate, seconds, frames.size / seconds, _percent(bits, seconds, bitrate), classes
    )


def _percent(bits: NDArray[np.int64], seconds: float, bitrate: int) -> float:
    return 100.0 * int(bits.sum()) / (seconds * bitrate)


def _kinds(identifiers: NDArray[np.uint32]) -> NDArray[np.int64]:
    kinds = np.full(identifiers.size, len(_CLASSES))
    plain = (identifiers & np.uint32(EXTENDED | ERROR)) == 0
    numbers = identifiers & np.uint32(0x7FF)
    for kind, (_, first, last) in enumerate(_CLASSES):
        kinds[plain & (numbers >= first) & (numbers <= last)] = kind
    return kinds


class LoadCapture:
    """Bus load of the frames captured since the last call."""

    def __init__(self, bitrate: int) -> None:
        self._bitrate = bitrate
        self._heard: list[Frames] = []
        self._since_s: float | None = None
        self._last_s = 0.0

    def feed(self, frames: Frames, last_s: float) -> None:
        """All frames since the last call; the last one came at `last_s` by the clock of the bus."""
        if self._since_s is None or last_s < self._last_s:
            self._since_s = last_s
            self._heard.clear()
        else:
            if last_s - self._since_s > LONGEST_S:
                self._since_s = self._last_s
                self._heard.clear()
            self._heard.append(frames)
        self._last_s = last_s

    def measure(self) -> BusLoad | None:
        """The load from the last frame of the last call to the last one received; None: no time passed between them."""
        if self._since_s is None or self._last_s <= self._since_s:
            return None
        load = bus_load(np.concatenate(self._heard), self._last_s - self._since_s, self._bitrate)
        self._since_s = self._last_s
        self._heard.clear()
        return load


class LoadMeter:
    """Measures the load of a bus; a context manager. `clock` is that of a connection to it. Raises BusError."""

    def __init__(self, address: BusAddress, bitrate: int, clock: Clock = REAL_CLOCK) -> None:
        self._clock = clock
        self._recorder = Recorder(address)
        self._bitrate = bitrate
        self._since_us = self._now_us()
        self._left = self._recorder.take()[:0]

    def measure(self, least_s: float = LEAST_LISTEN_S) -> BusLoad:
        """The load since the beginning or the last call, waiting until that is `least_s` ago."""
        due_us = self._since_us + round(1e6 * least_s)
        self._clock.sleep((due_us - self._now_us()) / 1e6)
        now_us = self._now_us()
        frames = np.concatenate([self._left, self._recorder.take()])
        in_time = (frames["time_us"] >= self._since_us) & (frames["time_us"] < now_us)
        self._left = frames[frames["time_us"] >= now_us]
        seconds, self._since_us = (now_us - self._since_us) / 1e6, now_us
        return bus_load(frames[in_time], max(seconds, 1e-6), self._bitrate)

    def _now_us(self) -> int:
        return self._clock.stamp_ns() // 1000

    def __enter__(self) -> LoadMeter:
        return self

    def __exit__(self, *_: object) -> None:
        self._recorder.stop()
