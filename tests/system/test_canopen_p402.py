# SPDX-License-Identifier: MIT
"""canopen's profile of CiA 402 drives one of our drives by itself: states, faults, modes, homing, targets with SYNC.
Run by pytest; starts a drive on a local bus.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import SimpleNamespace
from typing import Any

import can
import pytest
from canopen.pdo.base import PdoMap
from canopen.profiles import p402
from canopen_bench import DRIVE, DRIVE_EDS, NOTHING, client, drive_process, let_pass, until

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.sdo.network import Network
from hodograph.data import object_dictionary

HANGS_S = 600.0  # of real time: none of these takes a second
PERIOD_S = 0.001
SETPOINT_AHEAD_S = 0.0002
"""Of SYNC, which would go first where both wait for the bus."""
"""Of SYNC, which is what the drive takes it for."""


class Reception:
    """What canopen waits on for a PDO, in the time of the bus instead of that of a thread which receives."""

    def __init__(self, network: Network, pdo: PdoMap) -> None:
        self._network, self._pdo = network, pdo

    def __enter__(self) -> Reception:
        return self

    def __exit__(self, *_: object) -> None:
        pass

    def notify_all(self) -> None:
        """The waiting one looks by itself."""

    def wait(self, timeout_s: float) -> None:
        self._network.wait_until(lambda: self._pdo.is_received, timeout_s)


class Master:
    """SYNC with its counter from a thread, and the drive as canopen's profile sees it.

    The thread takes part in virtual time by itself, so SYNC goes on whatever the test waits for.
    """

    def __init__(self, hub: LocalHub, node: p402.BaseNode402) -> None:
        self.node = node
        self.sent = 0
        self._channel = hub.address.channel
        self._clock = node.network.clock
        self._ended = False
        self._joined = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)
        self._thread.start()
        assert self._joined.wait(HANGS_S)  # time stands still for it meanwhile

    def _work(self) -> None:
        with LocalBus(self._channel, can_filters=NOTHING) as bus:
            self._joined.set()
            while not self._ended:
                self.tick(bus)
                bus.clock.sleep(PERIOD_S - SETPOINT_AHEAD_S)

    def tick(self, bus: LocalBus) -> None:
        """The setpoint and one SYNC: the profile leaves RPDOs of SYNC type to the master's cycle."""
        self._send(bus, self.node.rpdo[1].cob_id, bytes(self.node.rpdo[1].data))
        bus.clock.sleep(SETPOINT_AHEAD_S)
        self.sent += 1
        self._send(bus, 0x80, bytes([(self.sent - 1) % 240 + 1]))

    def _send(self, bus: LocalBus, identifier: int, data: bytes) -> None:
        bus.send(can.Message(arbitration_id=identifier, data=data, is_extended_id=False))

    def pass_periods(self, count: int) -> None:
        """Lets so many SYNCs pass."""
        let_pass(self.node.network, count * PERIOD_S)

    def close(self) -> None:
        """Ends SYNC."""
        self._ended = True
        self._clock.sleep(2 * PERIOD_S)
        self._thread.join()


@contextmanager
def set_up(hub: LocalHub, monkeypatch: pytest.MonkeyPatch, axis: str = "") -> Iterator[Master]:
    node: Any = p402.BaseNode402(DRIVE, object_dictionary(DRIVE_EDS, DRIVE))
    with drive_process(hub, axis=axis), client(hub, node) as network:
        monkeypatch.setattr(p402, "time", SimpleNamespace(monotonic=network.clock.now_s))
        let_pass(network, 0.2)
        assert node.nmt.state == "PRE-OPERATIONAL"
        assert node.sdo[0x6061].raw == 0  # no mode at power-on
        node.sdo[0x6060].raw = 8
        node.setup_402_state_machine()
        for pdo in node.tpdo.values():
            pdo.receive_condition = Reception(network, pdo)
        node.nmt.state = "OPERATIONAL"
        master = Master(hub, node)
        try:
            node.check_statusword()
            yield master
        finally:
            master.close()


@pytest.fixture
def master(hub: LocalHub, clock: VirtualClock, monkeypatch: pytest.MonkeyPatch) -> Iterator[Master]:
    with set_up(hub, monkeypatch) as made:
        yield made


def hold_target(node: p402.BaseNode402) -> None:
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
    """0x605A = 6: the drive stays in Quick stop active, until commanded to go on or to give up."""
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
    until(node.network, lambda: node.state == "SWITCH ON DISABLED", 2.0)


def test_a_fault_is_seen_and_reset(master: Master) -> None:
    """A target further away than the following error window: FAULT with EMCY 0x8611, and out of it again."""
    node = master.node
    node.sdo[0x6065].raw = 1000
    node.sdo[0x6066].raw = 10
    hold_target(node)
    node.state = "OPERATION ENABLED"
    node.rpdo[1]["Target position"].raw = node.sdo[0x6064].raw + 5_000_000
    until(node.network, lambda: node.state == "FAULT", 1.0)
    assert node.is_faulted()
    assert [error.code for error in node.emcy.log] == [0x8611]
    assert node.sdo[0x603F].raw == 0x8611
    assert node.sdo[0x1001].raw != 0
    hold_target(node)
    node.sdo[0x6065].raw = 0xFFFFFFFF
    node.reset_from_fault()
    assert node.state == "OPERATION ENABLED"
    assert not node.is_faulted()
    assert [error.code for error in node.emcy.log] == [0x8611, 0]
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
    start = node.sdo[0x6064].raw
    for step in range(1, 301):
        node.rpdo[1]["Target position"].raw = start + 2000 * step
        master.pass_periods(1)
        if step > 50:
            assert abs(node.tpdo[1]["Position actual value"].raw - start - 2000 * step) < 1600
    master.pass_periods(500)
    assert node.sdo[0x2101][2].raw == master.sent
    assert node.statusword & 0x1000
    assert node.sdo[0x6062].raw == start + 600_000
    assert abs(node.sdo[0x6064].raw - start - 600_000) <= 1
    assert node.emcy.log == []
    assert node.sdo[0x2101][5].raw == 1, "reproducible"


@pytest.mark.parametrize("method", [37, 35])
def test_homing_on_the_spot(master: Master, method: int) -> None:
    node = master.node
    node.sdo[0x6098].raw = method
    node.sdo[0x607C].raw = 123_456
    hold_target(node)
    assert node.homing(timeout=HANGS_S)
    assert node.is_homed()
    assert abs(node.sdo[0x6064].raw - 123_456) <= 1
    hold_target(node)  # the one before belongs to the old zero
    node.op_mode = "CYCLIC SYNCHRONOUS POSITION"
    node.check_statusword()
    assert node.state == "OPERATION ENABLED"
    assert abs(node.sdo[0x6064].raw - 123_456) <= 1


SWITCHES = ",position_mm=2,limit_negative_mm=-3,limit_positive_mm=6"


@pytest.fixture
def master_with_switches(
    hub: LocalHub, clock: VirtualClock, monkeypatch: pytest.MonkeyPatch
) -> Iterator[Master]:
    with set_up(hub, monkeypatch, SWITCHES) as made:
        yield made


@pytest.mark.parametrize("method", [17, 18])
def test_homing_with_a_limit_switch(master_with_switches: Master, method: int) -> None:
    """The zero is where the switch goes off."""
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
    assert abs(node.sdo[0x6064].raw) <= 1
    assert abs(node.sdo[0x6064].raw - begun) > 1_000_000
    switch = 1 if method == 17 else 2
    assert node.sdo[0x60FD].raw & switch == 0
    assert node.emcy.log == []
