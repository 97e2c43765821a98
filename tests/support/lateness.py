# SPDX-License-Identifier: MIT
"""How late this computer itself is, for tests of real-time pace: measured in the same run, on the same core.

Used by tests of boards that are emulated at real-time pace. Reads /proc; starts a thread of high
priority, and sets its processor core.
"""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

_PERIOD_S = 0.001
_PRIORITY = 40
"""Above all processes of this project: it measures the host, not the tested processes."""
_LOOK_S = 0.05


class Lateness:
    """A thread that sleeps a millisecond at a time, before all others on the core that boards run on; a context
    manager.

    worst_s   how much longer it slept at worst
    waited_s  how long the thread of a child process that waited longest was ready to run and had no core (as far as
              the Linux kernel counts that; else 0). A sleeping thread gets a core at once even where computing ones
              wait, so both are needed.
    """

    def __init__(self) -> None:
        self.worst_s = 0.0
        self.waited_s = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._work, name="lateness", daemon=True)

    def _work(self) -> None:
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        looked_s = time.monotonic()
        while not self._over.is_set():
            began_s = time.monotonic()
            time.sleep(_PERIOD_S)
            now_s = time.monotonic()
            self.worst_s = max(self.worst_s, now_s - began_s - _PERIOD_S)
            if now_s - looked_s > _LOOK_S:
                looked_s = now_s
                self.waited_s = max((self.waited_s, *_waits_s(os.getpid())))

    def __enter__(self) -> Lateness:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()


def _waits_s(of: int) -> Iterator[float]:
    """For each thread of the processes below this one: how long it has been ready and had no core."""
    for tasks in Path(f"/proc/{of}/task").glob("*/children"):
        with suppress(OSError):
            for child in tasks.read_text().split():
                for waited in Path(f"/proc/{child}/task").glob("*/schedstat"):
                    with suppress(OSError):
                        yield int(waited.read_text().split()[1]) * 1e-9
                yield from _waits_s(int(child))
