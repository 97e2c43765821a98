# SPDX-License-Identifier: MIT
"""Emergency frames as messages to the browsers: some of a storm, and how many were left out."""

from __future__ import annotations

from typing import Any

from ..bus.listening.frames import Frames
from ..bus.words.texts import fault_words

WINDOW_S = 1.0
MOST_TOLD = 10
"""Events in a window; of the same node and code one."""
_EMCY, _NODES = 0x080, 0x7F


class Emergencies:
    """Told as they come, within the bounds of each window; what was left out is counted at its end."""

    def __init__(self) -> None:
        self._since_s = -WINDOW_S
        self._told: set[tuple[int, int]] = set()
        self._left_out = 0

    def feed(self, frames: Frames, now_s: float) -> list[dict[str, Any]]:
        """Messages for these frames; to be called without frames too, since windows end."""
        events = []
        if now_s - self._since_s >= WINDOW_S:
            if self._left_out:
                text = f"{self._left_out} more emergency frames in {now_s - self._since_s:.1f} s"
                events.append({"type": "event", "text": text, "fault": True})
            self._since_s, self._left_out = now_s, 0
            self._told.clear()
        identifiers = frames["id"]
        found = frames[(identifiers > _EMCY) & (identifiers <= _EMCY + _NODES)]
        nodes = found["id"].astype(int) - _EMCY
        codes = found["data"][:, 0].astype(int) | found["data"][:, 1].astype(int) << 8
        for node, code in dict.fromkeys(zip(nodes.tolist(), codes.tolist(), strict=True)):
            count = int(((nodes == node) & (codes == code)).sum())
            if (node, code) in self._told or len(self._told) >= MOST_TOLD:
                self._left_out += count
                continue
            self._told.add((node, code))
            self._left_out += count - 1
            events.append(_event(node, code))
        return events


def _event(node: int, code: int) -> dict[str, Any]:
    text = "no error any more"
    if code != 0:
        words = fault_words(code)
        text = f"{words.text} (0x{code:04X}): {words.remedy}"
    return {"type": "event", "text": f"node {node}: {text}", "fault": code != 0}
