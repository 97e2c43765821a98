# SPDX-License-Identifier: MIT
"""`status --watch` while the controller is away. Run by pytest; starts and writes nothing."""

from __future__ import annotations

from typing import Any

import pytest

from hodograph.bus.clock import REAL_CLOCK
from hodograph.cli.status_command import _Screen, _show
from hodograph.errors import BusError


class Away:
    """A controller that does not answer."""

    def answers(self, _: float) -> bool:
        return False

    def who(self) -> str:
        return "node 1"


class Meter:
    """Counts how often what was received is taken away; the bus may be down as well."""

    def __init__(self, down: bool) -> None:
        self.down = down
        self.taken: list[float] = []

    def measure(self, least_s: float) -> None:
        self.taken.append(least_s)
        if self.down:
            raise BusError("down")


@pytest.mark.parametrize("down", [False, True])
def test_frames_received_meanwhile_are_not_kept(
    down: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    meter: Any = Meter(down)
    away: Any = Away()
    for _ in range(3):
        _show(away, meter, _Screen((), as_json=True, clock=REAL_CLOCK))
    assert meter.taken == [0.0, 0.0, 0.0]
    assert capsys.readouterr().out.count("no answer from node 1") == 3
