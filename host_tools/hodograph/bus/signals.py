# SPDX-License-Identifier: MIT
"""Ignores Ctrl-C, SIGTERM and SIGHUP while commands stop the axes. Main thread; without effect in others. Used by
bus/run and sdo/controller. Changes signal handlers of the process and restores them.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress


@contextmanager
def interrupts_ignored() -> Iterator[None]:
    """Ignores Ctrl-C, SIGTERM and SIGHUP while the axes are being stopped."""
    kept = {}
    with suppress(ValueError):  # only the main thread may
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            kept[number] = signal.signal(number, signal.SIG_IGN)
    try:
        yield
    finally:
        for number, handler in kept.items():
            signal.signal(number, handler)
