# SPDX-License-Identifier: MIT
"""canopen's profile of CiA 402 drives one of our drives by itself: states, faults, modes, homing, targets with SYNC."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import pytest
from canopen.profiles.p402 import BaseNode402
from canopen_bench import DRIVE, DRIVE_EDS, client, drive_process, until

pytestmark = pytest.mark.bus

PERIOD_S = 0.004
"""Of SYNC by the wall clock; the drive counts periods of a millisecond."""


class Master:
    """SYNC with its counter from a thread, and the drive as canopen's profile sees it."""

    def __init__(self, node: BaseNode402) -> None:
        self.node = node
        self.counter = 0
        self.lock = threading.Lock()
        self.ended = threading.Event()
        self.thread = threading.Thread(target=self._work, daemon=True)
        self.thread.start()

    def _work(self) -> None:
        while not self.ended.wait(PERIOD_S):
            self.tick()

    def tick(self) -> None:
        """The setpoint and one SYNC: the profile leaves RPDOs of SYNC type to the master's cycle."""
        with self.lock:
            self.counter = self.counter % 240 + 1
            self.node.rpdo[1].transmit()
            self.node.network.send_message(0x80, bytes([self.counter]))

    def close(self) -> None:
        self.ended.set()
        self.thread.join()


def set_up(axis: str = "") -> Iterator[Master]:
    node = BaseNode402(DRIVE, str(DRIVE_EDS))
    with drive_process(axis=axis), client(node):
        node.TIMEOUT_CHECK_TPDO = 2.0
        node.TIMEOUT_SWITCH_STATE_FINAL = 10.0
        node.TIMEOUT_SWITCH_STATE_SINGLE = 5.0
        node.TIMEOUT_SWITCH_OP_MODE = 5.0
        until(lambda: node.nmt.state == "PRE-OPERATIONAL")
        node.sdo[0x2101][6].raw = 5000  # patience with SYNC on a slow host
        node.setup_402_state_machine()
        node.nmt.state = "OPERATIONAL"
        until(lambda: node.sdo[0x1001].raw == 0)
        master = Master(node)
        try:
            node.check_statusword()
            yield master
        finally:
            master.close()


@pytest.fixture
def master() -> Iterator[Master]:
    yield from set_up()


def hold_target(node: BaseNode402) -> None:
    """Setpoint = actual, as every bumpless start has it."""
    node.rpdo[1]["Target position"].raw = node.sdo[0x6064].raw


def test_it_finds_the_words_in_the_pdos(master: Master) -> None:
    node = master.node
    assert 0x6040 in node.rpdo_pointers
    assert 0x6041 in node.tpdo_values
    assert node.state == "SWITCH ON DISABLED"


@pytest.mark.parametrize(
    "path",
    [
        ["READY TO SWITCH ON", "SWITCHED ON", "OPERATION ENABLED"],
        ["OPERATION ENABLED", "SWITCHED ON", "READY TO SWITCH ON", "SWITCH ON DISABLED"],
        ["OPERATION ENABLED", "READY TO SWITCH ON", "OPERATION ENABLED", "SWITCH ON DISABLED"],
        ["SWITCHED ON", "SWITCH ON DISABLED", "READY TO SWITCH ON", "SWITCH ON DISABLED"],
    ],
    ids=" ".join,
)
def test_through_the_states(master: Master, path: list[str]) -> None:
    node = master.node
    hold_target(node)
    for state in path:
        node.state = state
        assert node.state == state
        node.check_statusword()
        assert node.state == state


def test_quick_stop_and_back(master: Master) -> None:
    """0x605A = 6: the drive stays in Quick stop active, until told to go on or to give up."""
    node = master.node
    node.sdo[0x605A].raw = 6
    hold_target(node)
    node.state = "OPERATION ENABLED"
    node.state = "QUICK STOP ACTIVE"
    assert node.state == "QUICK STOP ACTIVE"
    node.state = "OPERATION ENABLED"
    node.state = "QUICK STOP ACTIVE"
    node.state = "SWITCH ON DISABLED"
    node.sdo[0x605A].raw = 2  # stop, then off by itself
    node.state = "OPERATION ENABLED"
    node.controlword = 0x0002
    until(lambda: node.state == "SWITCH ON DISABLED")


def test_a_fault_is_seen_and_reset(master: Master) -> None:
    """A target further away than the following error window: FAULT with EMCY 0x8611, and out of it again."""
    node = master.node
    node.sdo[0x6065].raw = 1000
    node.sdo[0x6066].raw = 10
    hold_target(node)
    node.state = "OPERATION ENABLED"
    node.rpdo[1]["Target position"].raw = node.sdo[0x6064].raw + 5_000_000
    until(lambda: node.state == "FAULT")
    assert node.is_faulted()
    until(lambda: len(node.emcy.log) > 0)
    assert node.emcy.log[0].code == 0x8611
    assert node.sdo[0x603F].raw == 0x8611
    assert node.sdo[0x1001].raw != 0
    hold_target(node)
    node.sdo[0x6065].raw = 0xFFFFFFFF
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    assert not node.is_faulted()
    until(lambda: node.emcy.log[-1].code == 0)
    assert node.sdo[0x1001].raw == 0


def test_modes(master: Master) -> None:
    node = master.node
    assert node.op_mode == "CYCLIC SYNCHRONOUS POSITION"
    assert node.is_op_mode_supported("HOMING")
    assert not node.is_op_mode_supported("CYCLIC SYNCHRONOUS TORQUE")
    for mode in ("HOMING", "CYCLIC SYNCHRONOUS POSITION"):
        node.op_mode = mode
        assert node.op_mode == mode
    with pytest.raises(TypeError):
        node.op_mode = "PROFILED VELOCITY"


def test_targets_in_csp(master: Master) -> None:
    """A ramp of targets, one a SYNC: the drive follows each, and says so in bit 12."""
    node = master.node
    hold_target(node)
    node.state = "OPERATION ENABLED"
    master.close()
    start = node.sdo[0x6064].raw
    for step in range(1, 301):
        node.rpdo[1]["Target position"].raw = start + 2000 * step
        master.tick()
        time.sleep(0.001)
    for _ in range(500):
        master.tick()
        time.sleep(0.0005)
    until(lambda: node.sdo[0x2101][2].raw >= 800)
    assert node.statusword & 0x1000
    assert node.sdo[0x6062].raw == start + 600_000
    assert abs(node.sdo[0x6064].raw - start - 600_000) < 200
    assert node.emcy.log == []
    assert node.sdo[0x2101][5].raw == 1, "reproducible"


@pytest.mark.parametrize("method", [37, 35])
def test_homing_on_the_spot(master: Master, method: int) -> None:
    node = master.node
    node.sdo[0x6098].raw = method
    node.sdo[0x607C].raw = 123_456
    hold_target(node)
    assert node.homing(timeout=20)
    assert node.is_homed()
    assert abs(node.sdo[0x6064].raw - 123_456) <= 10
    hold_target(node)  # the one before belongs to the old zero
    node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    node.check_statusword()
    assert node.state == "OPERATION ENABLED"
    assert abs(node.sdo[0x6064].raw - 123_456) <= 10


SWITCHES = ",position_mm=2,limit_negative_mm=-3,limit_positive_mm=6"


@pytest.fixture
def master_with_switches() -> Iterator[Master]:
    yield from set_up(SWITCHES)


@pytest.mark.parametrize("method", [17, 18])
def test_homing_with_a_limit_switch(master_with_switches: Master, method: int) -> None:
    """The zero is where the switch lets go."""
    node = master_with_switches.node
    node.sdo[0x6098].raw = method
    node.sdo[0x6099][1].raw = 20_000_000
    node.sdo[0x6099][2].raw = 2_000_000
    node.sdo[0x609A].raw = 200_000_000
    node.sdo[0x607C].raw = 0
    hold_target(node)
    begun = node.sdo[0x6064].raw
    assert node.homing(timeout=60)
    assert node.is_homed()
    assert abs(node.sdo[0x6064].raw) < 100_000
    assert abs(node.sdo[0x6064].raw - begun) > 1_000_000 or method == 18
    switch = 1 if method == 17 else 2
    assert node.sdo[0x60FD].raw & switch == 0
    assert node.emcy.log == []
