# SPDX-License-Identifier: MIT
"""Drives that slept, as the processes of a suspended computer do: the recovery. Run by pytest; starts a controller and
drives on a local bus.
"""

from __future__ import annotations

import pytest

from bench import MakeAlpha, MakeBench
from hodograph.bus.clock import VirtualClock
from hodograph.bus.sdo.controller import FAULT_STATE, OFF
from hodograph.bus.sdo.objects import MISSED_TPDOS
from hodograph.cli.main import main


@pytest.mark.parametrize("asleep_s", [0.9, 1.1, 6.0, 60.0])
def test_drives_that_slept_are_back_at_once(
    make_bench: MakeBench,
    alpha_at: MakeAlpha,
    clock: VirtualClock,
    asleep_s: float,
) -> None:
    """What piled up for them meanwhile is not worked off: SYNCs of seconds ago, each a period of servo loops."""
    controller = make_bench().controller
    assert main(["goto", str(alpha_at(20))]) == 0
    assert main(["start"]) == 0
    clock.suspend("drives")
    clock.sleep(asleep_s)
    assert controller.state() == FAULT_STATE
    clock.resume("drives")
    assert main(["reset"]) == 0
    assert controller.state() == OFF
    clock.sleep(1.0)
    assert [controller.read(MISSED_TPDOS, axis) for axis in (1, 2)] == [0, 0]
