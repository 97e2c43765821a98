# SPDX-License-Identifier: MIT
"""How late the ticks of a controller are on this computer, from the time stamps of its SYNC frames; `hodograph
latency`. Used by cli/latency_command. Receives frames of the bus that it is given, in real time, and sends nothing
there; without a bus it starts a hub and a controller.

On SocketCAN the Linux kernel stamps the frames. On a local bus the hub stamps them, so the figures also contain the
time that the hub takes to wake up.
"""

from __future__ import annotations

import os
import platform
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter1d

from .bus.address import BusAddress
from .bus.capture.recorder import Recorder
from .bus.hub import LocalHub
from .bus.processes import Process, controller_command
from .config import Machine
from .errors import BusError

Real = NDArray[np.float64]

EDGES_US = (0, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000)
"""Bins of the histogram in us; the last one has no end."""
_SYNC = 0x080
_BOOT_S = 1.0
_AROUND = 500
"""Ticks before and after each one that give its due time: over so many, drift of the clocks does not count."""
_MISSED = 2.0
"""Periods between two ticks after which a new grid begins: a controller restarts its clock when a tick is a period
late.
"""


@dataclass(frozen=True)
class Load:
    """Other load of this computer during the measurement."""

    cpus: int
    busy_percent: float
    load_average_begin: float
    load_average_end: float


@dataclass(frozen=True, eq=False)
class Latency:
    """Lateness of ticks.

    lateness_us  (n,) of each SYNC after its place in the grid of periods
    missed       ticks that did not come
    """

    bus: str
    period_us: int
    lateness_us: Real
    missed: int
    load: Load

    def histogram(self) -> list[tuple[int, int | None, int]]:
        """Bins: from, to in us (None: no end), number of ticks."""
        counts, _ = np.histogram(self.lateness_us, bins=[*EDGES_US, np.inf])
        ends = [*EDGES_US[1:], None]
        return list(zip(EDGES_US, ends, counts.tolist(), strict=True))

    def share_us(self, percent: float) -> float:
        """The lateness, us, that this share of the ticks does not exceed."""
        return float(np.percentile(self.lateness_us, percent))

    def json(self) -> dict[str, Any]:
        """Ready for JSON."""
        return {
            "bus": self.bus,
            "period_us": self.period_us,
            "ticks": int(self.lateness_us.size),
            "missed": self.missed,
            "lateness_us": {
                "median": self.share_us(50),
                "p99": self.share_us(99),
                "p99_9": self.share_us(99.9),
                "greatest": float(self.lateness_us.max()),
            },
            "histogram": [list(row) for row in self.histogram()],
            "kernel": platform.release(),
            "realtime_kernel": is_realtime_kernel(),
            "load": vars(self.load),
        }


def is_realtime_kernel() -> bool:
    """Whether the Linux kernel of this computer is built with PREEMPT_RT."""
    try:
        return Path("/sys/kernel/realtime").read_text().strip() == "1"
    except OSError:
        return False


def lateness(times_us: Real, period_us: float) -> tuple[Real, int]:
    """Lateness (n,) of ticks at `times_us` (n,), and how many are missing between them.

    The lateness of a tick counts from a grid of periods through the earliest of the ticks around it. After a gap of
    more than a period a new grid begins, as the controller's clock does.
    """
    gaps = np.diff(times_us)
    breaks = gaps > _MISSED * period_us
    missed = int(np.sum(np.round(gaps[breaks] / period_us) - 1))
    found = []
    for part in np.split(times_us, np.flatnonzero(breaks) + 1):
        offset = part - part[0] - period_us * np.arange(part.size)
        found.append(offset - minimum_filter1d(offset, 2 * _AROUND + 1, mode="nearest"))
    return np.concatenate(found), missed


def measure(address: BusAddress, period_us: int, seconds: float) -> Latency:
    """Measures a controller on a bus by its SYNC frames. Raises BusError: there are none."""
    busy, average = _busy(), os.getloadavg()[0]
    with Recorder(address) as recorder:
        time.sleep(seconds)
    frames = recorder.frames()
    load = Load(os.cpu_count() or 1, _share(busy, _busy()), average, os.getloadavg()[0])
    times_us = frames["time_us"][frames["id"] == _SYNC].astype(np.float64)
    if times_us.size < 2:
        raise BusError(f"{address}: no SYNC within {seconds:g} s: start the controller")
    found, missed = lateness(times_us - times_us[0], period_us)
    return Latency(str(address), period_us, found, missed, load)


def measure_own(machine: Machine, seconds: float) -> Latency:
    """Measures a controller process without drives, which it starts on a local bus of its own in real time. Its ticks
    wait for its clock only. Raises BusError.
    """
    with LocalHub(virtual=False) as hub:
        process = Process("controller", controller_command(machine, hub.address, "real-time"))
        try:
            time.sleep(_BOOT_S)
            process.check()
            return measure(hub.address, machine.period_us, seconds)
        finally:
            process.end()


def _busy() -> tuple[int, int]:
    """Clock ticks of all processors since boot: busy, all."""
    words = Path("/proc/stat").read_text().splitlines()[0].split()[1:9]
    user, nice, system, idle, io_wait, *rest = map(int, words)
    busy = user + nice + system + sum(rest)
    return busy, busy + idle + io_wait


def _share(begin: tuple[int, int], end: tuple[int, int]) -> float:
    return 100.0 * (end[0] - begin[0]) / max(end[1] - begin[1], 1)
