# SPDX-License-Identifier: MIT
"""The page shows no values of a bus that is silent or lost as if they were present ones. Run by pytest; starts threads,
and opens no bus.
"""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
import pytest

from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.errors import BusError
from hodograph.monitor import pump as pump_module
from hodograph.monitor.pump import Layout, Pump
from hodograph.monitor.source import NO_FRAMES, Taken
from traffic import machine_frames

HANGS_S = 600.0  # of real time: none of these takes a second
COUNT = 200
LAYOUT = Layout(("x", "y"), (2, 3), (1_000_000,) * 2, ("mm",) * 2, 2, 1000, 1_000_000)
HEARTBEAT = 0x702


def part(begin_us: int) -> Frames:
    """So many SYNCs at standstill, 1 ms apart, from a time on."""
    still = np.full((COUNT, 2), 5_000_000)
    plain = machine_frames(still, still)
    frames = np.zeros(plain.size, dtype=RECORD_DTYPE)
    for name in plain.dtype.names or ():
        frames[name] = plain[name]
    frames["time_us"] = begin_us + 1000 * np.cumsum(plain["id"] == 0x080)
    return frames


def heartbeat(time_us: int) -> Frames:
    frames = np.zeros(1, dtype=RECORD_DTYPE)
    frames["id"], frames["length"], frames["time_us"] = HEARTBEAT, 1, time_us
    return frames


class Scripted:
    """A source that gives its parts, one a poll, and then nothing; a BusError is raised."""

    def __init__(self, parts: list[Taken | BusError], over: threading.Event) -> None:
        self._parts, self._over = parts, over

    def take(self) -> Taken:
        if not self._parts:
            self._over.set()
            return Taken(NO_FRAMES)
        one = self._parts.pop(0)
        if isinstance(one, BusError):
            raise one
        return one

    def close(self) -> None:
        pass


def published(sources: list[list[Taken | BusError]]) -> list[dict[str, Any]]:
    """The messages of a pump that has these sources, one after the other."""
    messages: list[dict[str, Any]] = []
    over = threading.Event()
    opened = iter(sources)
    last: list[Taken | BusError] = []

    def open_next() -> Scripted:
        return Scripted(next(opened, last), over)

    pump = Pump(open_next, LAYOUT, messages.append)
    pump.start()
    assert over.wait(HANGS_S)
    pump.close()
    return messages


def states(messages: list[dict[str, Any]]) -> list[tuple[str, float | None]]:
    return [
        (message["drives"][0]["state"], message["drives"][0]["actual_mm"])
        for message in messages
        if message["type"] == "drives"
    ]


@pytest.mark.parametrize("is_known", [True, False])
def test_without_sync_the_drives_are_silent(is_known: bool) -> None:
    """With the present time of the bus, and by the frames of others alone."""
    end_us = 1000 * COUNT

    def later(ms: int) -> Taken:
        frames = NO_FRAMES if is_known else heartbeat(end_us + 1000 * ms)
        return Taken(frames, end_us + 1000 * ms if is_known else None)

    first = Taken(part(0), end_us if is_known else None)
    again = Taken(part(end_us + 5_000_000), end_us + 5_200_000 if is_known else None)
    shown = states(published([[first, later(900), later(1100), later(2000), again]]))
    assert shown == [
        ("operation enabled", 5.0),
        ("silent", None),
        ("operation enabled", 5.0),
    ]


def test_a_recording_at_its_end_keeps_its_last_values() -> None:
    shown = states(published([[Taken(part(0), 1000 * COUNT), Taken(NO_FRAMES, ended=True)]]))
    assert shown == [("operation enabled", 5.0)]


def test_a_bus_that_was_lost_and_came_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """The drives are silent meanwhile, and the time of the plots goes on, so that they do not mix old and new rows."""
    monkeypatch.setattr(pump_module, "_RETRY_S", 0.05)
    messages = published([[Taken(part(0), 0), BusError("down")], [Taken(part(0), 0)]])
    assert [state for state, _ in states(messages)] == [
        "operation enabled",
        "silent",
        "operation enabled",
    ]
    times = [t for message in messages if message["type"] == "rows" for t in message["t"]]
    assert times == sorted(times)
    assert max(np.diff(times)) >= 0.05
