# SPDX-License-Identifier: MIT
"""Notes why a running program does not move, each reason once, while a command waits for its end. Used by bus/run,
stream/sender and cli/. Reads objects of the controller by SDO.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from .controller import Controller
from .objects import HELD, OVERRIDE

LOOK_S = 0.5


class Follower:
    """Reads the state twice a second and calls `note` with the reason if the program does not move. Call it
    repeatedly.
    """

    def __init__(self, controller: Controller, note: Callable[[str], None]) -> None:
        self._controller = controller
        self._note = note
        self._said = ""
        self._next_s = -math.inf

    def __call__(self) -> None:
        """Reads the state if half a second has passed."""
        now_s = self._controller.clock.now_s()
        if now_s < self._next_s:
            return
        self._next_s = now_s + LOOK_S
        reason = self._reason()
        if reason and reason != self._said:
            self._note(reason)
        self._said = reason

    def _reason(self) -> str:
        if self._controller.state() == HELD:
            return "held: hodograph resume goes on, hodograph stop ends it"
        if self._controller.read(OVERRIDE, 1) == 0:
            return "the feed override is 0 %, nothing moves: hodograph override PERCENT goes on"
        return ""
