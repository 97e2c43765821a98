# SPDX-License-Identifier: MIT
"""Emergency frames as messages to the browsers: of many equal ones a few, with the number of the others. Used by
monitor/pump. No I/O. Changes its own object only; one thread.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..bus.capture.frames import Frames
from ..bus.diagnostics.texts import fault_words

WINDOW_S = 1.0
MOST_REPORTED = 10
"""Most events in a window; of the same node and code one."""
_EMCY, _NODES = 0x080, 0x7F
_WINDOW_US = round(1e6 * WINDOW_S)


class Emergencies:
    """Reports emergencies as they come, within the bounds of each window; at its end it reports the number of the
    others.

    A window begins with an emergency frame and ends by the time stamps of the bus. So the messages for a recording do
    not depend on the parts in which it is read.
    """

    def __init__(self) -> None:
        self._since_us: int | None = None
        self._reported: set[tuple[int, int]] = set()
        self._left_out = 0

    def feed(self, frames: Frames, now_us: int | None = None) -> list[dict[str, Any]]:
        """Messages for these frames (`RECORD_DTYPE`). `now_us`: the present time, None: not known; it also ends a
        window without frames.
        """
        identifiers = frames["id"]
        found = frames[(identifiers > _EMCY) & (identifiers <= _EMCY + _NODES)]
        events: list[dict[str, Any]] = []
        while found.size:
            first_us = int(found["time_us"][0])
            events += self._end_before(first_us)
            self._since_us = first_us if self._since_us is None else self._since_us
            since_us = found["time_us"] - self._since_us
            beyond = np.flatnonzero((since_us < 0) | (since_us >= _WINDOW_US))
            inside = int(beyond[0]) if beyond.size else found.size
            events += self._report(found[:inside])
            found = found[inside:]
        if now_us is None and frames.size:
            now_us = int(frames["time_us"][-1])
        return events if now_us is None else events + self._end_before(now_us)

    def _end_before(self, now_us: int) -> list[dict[str, Any]]:
        """Closes the window when its time is over, or the clock was set back."""
        if self._since_us is None or 0 <= now_us - self._since_us < _WINDOW_US:
            return []
        left_out = self._left_out
        self._since_us, self._left_out = None, 0
        self._reported.clear()
        if not left_out:
            return []
        text = f"{left_out} more emergency frames in {WINDOW_S:.1f} s"
        return [{"type": "event", "text": text, "fault": True}]

    def _report(self, found: Frames) -> list[dict[str, Any]]:
        events = []
        nodes = found["id"].astype(int) - _EMCY
        codes = found["data"][:, 0].astype(int) | found["data"][:, 1].astype(int) << 8
        for node, code in dict.fromkeys(zip(nodes.tolist(), codes.tolist(), strict=True)):
            count = int(((nodes == node) & (codes == code)).sum())
            if (node, code) in self._reported or len(self._reported) >= MOST_REPORTED:
                self._left_out += count
                continue
            self._reported.add((node, code))
            self._left_out += count - 1
            events.append(_event(node, code))
        return events


def _event(node: int, code: int) -> dict[str, Any]:
    text = "no error any more"
    if code != 0:
        words = fault_words(code)
        text = f"{words.text} (0x{code:04X}): {words.remedy}"
    return {"type": "event", "text": f"node {node}: {text}", "fault": code != 0}
