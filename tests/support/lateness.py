# SPDX-License-Identifier: MIT
"""How late this computer itself is, for tests of real-time pace: measured in the same run, on the same core."""

from __future__ import annotations

import os
import threading
import time
from contextlib import suppress

_PERIOD_S = 0.001
_PRIORITY = 40
"""Above all processes of this project: it measures the host, not the tested processes."""


class Lateness:
    """A thread that sleeps a millisecond at a time, before all others on the core that boards run on; a context
    manager. `worst_s`: how much longer it slept at worst.
    """

    def __init__(self) -> None:
        self.worst_s = 0.0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._work, name="lateness", daemon=True)

    def _work(self) -> None:
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})
        with suppress(PermissionError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(_PRIORITY))
        while not self._over.is_set():
            began_s = time.monotonic()
            time.sleep(_PERIOD_S)
            self.worst_s = max(self.worst_s, time.monotonic() - began_s - _PERIOD_S)

    def __enter__(self) -> Lateness:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._over.set()
        self._thread.join()
