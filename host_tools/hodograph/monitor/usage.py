# SPDX-License-Identifier: MIT
"""What the monitor itself takes."""

from __future__ import annotations

import os
import resource
import time
from typing import Any


class Usage:
    """Share of a processor since the last message, and memory."""

    def __init__(self) -> None:
        self._last = (time.monotonic(), sum(os.times()[:2]))

    def message(self, clients: int) -> dict[str, Any]:
        """For the page's last line. `clients`: browsers that look on."""
        now = (time.monotonic(), sum(os.times()[:2]))
        passed_s = max(now[0] - self._last[0], 1e-3)
        percent = 100 * (now[1] - self._last[1]) / passed_s
        self._last = now
        return {
            "type": "usage",
            "cpu_percent": round(percent, 1),
            "memory_mib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
            "clients": clients,
        }
