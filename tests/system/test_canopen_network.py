# SPDX-License-Identifier: MIT
"""NMT, heartbeat, EMCY, SYNC and what is refused, with python canopen as the master."""

from __future__ import annotations

import itertools
import struct
import time
from collections.abc import Iterator

import can
import canopen
import pytest
from canopen_bench import (
    CONTROLLER,
    CONTROLLER_EDS,
    DRIVE,
    DRIVE_EDS,
    NO_OBJECT,
    VALUE,
    abort_code,
    client,
    controller_process,
    drain,
    drive_process,
    until,
)

pytestmark = pytest.mark.bus

BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
QUICK = 0.3
"""Seconds in which an answer that must not come would have come."""


class Listened:
    """A node, and the heartbeats of it so far."""

    def __init__(self, node: canopen.RemoteNode) -> None:
        self.node = node
        self.beats: list[tuple[float, int]] = []
        node.nmt.add_heartbeat_callback(self._beat)

    def _beat(self, state: int) -> None:
        self.beats.append((time.monotonic(), state))

    def told(self, state: int) -> bool:
        return any(beat == state for _, beat in self.beats)

    def command(self, name: str, state: int) -> None:
        """An NMT command, until a heartbeat tells the state."""
        self.beats.clear()
        self.node.nmt.state = name
        until(lambda: self.told(state))


@pytest.fixture
def drive() -> Iterator[Listened]:
    with drive_process(), client(canopen.RemoteNode(DRIVE, str(DRIVE_EDS))) as network:
        yield Listened(network[DRIVE])


@pytest.fixture
def controller() -> Iterator[Listened]:
    with (
        controller_process(),
        client(canopen.RemoteNode(CONTROLLER, str(CONTROLLER_EDS))) as network,
    ):
        yield Listened(network[CONTROLLER])


def sends_on_sync(node: canopen.RemoteNode) -> bool:
    """Whether a SYNC is answered with a TPDO1."""
    with can.Bus(
        interface="socketcan",
        channel="vcan0",
        can_filters=[{"can_id": 0x180 + node.id, "can_mask": 0x7FF}],
    ) as bus:
        drain(bus)
        node.network.send_message(0x80, b"\x01")
        return bus.recv(QUICK) is not None


def test_all_commands(drive: Listened) -> None:
    node = drive.node
    assert node.nmt.wait_for_heartbeat(5) == "PRE-OPERATIONAL"
    assert not sends_on_sync(node)
    drive.command("OPERATIONAL", OPERATIONAL)
    assert sends_on_sync(node)
    assert node.sdo[0x1000].raw == 0x00020192
    drive.command("STOPPED", STOPPED)
    assert not sends_on_sync(node)
    node.sdo.RESPONSE_TIMEOUT = QUICK
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo.upload(0x1000, 0)
    node.sdo.RESPONSE_TIMEOUT = 3.0
    drive.command("PRE-OPERATIONAL", PRE_OPERATIONAL)
    assert node.sdo[0x1000].raw == 0x00020192
    assert not sends_on_sync(node)


@pytest.mark.parametrize("command", ["RESET", "RESET COMMUNICATION"])
@pytest.mark.parametrize("before", ["OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"])
def test_resets_from_every_state(drive: Listened, command: str, before: str) -> None:
    """One boot-up message, then pre-operational."""
    states = {"OPERATIONAL": OPERATIONAL, "STOPPED": STOPPED, "PRE-OPERATIONAL": PRE_OPERATIONAL}
    drive.command(before, states[before])
    drive.command(command, BOOT_UP)
    until(lambda: drive.told(PRE_OPERATIONAL))
    assert [state for _, state in drive.beats].count(BOOT_UP) == 1
    assert drive.node.sdo[0x1000].raw == 0x00020192


def test_commands_to_all_and_to_others(drive: Listened) -> None:
    network = drive.node.network
    network.send_message(0, bytes([1, DRIVE + 1]))  # not to us
    network.send_message(0, bytes([99, DRIVE]))  # no such command
    network.send_message(0, bytes([1]))  # too short
    network.send_message(0, bytes([1, DRIVE, 0]))  # too long
    drive.beats.clear()
    until(lambda: len(drive.beats) >= 3)
    assert {state for _, state in drive.beats} == {PRE_OPERATIONAL}
    network.send_message(0, bytes([1, 0]))
    until(lambda: drive.told(OPERATIONAL))


def test_the_heartbeat_follows_0x1017(drive: Listened) -> None:
    for period_ms in (50, 250):
        drive.node.sdo[0x1017].raw = period_ms
        drive.beats.clear()
        until(lambda: len(drive.beats) >= 9)
        times = [at for at, _ in drive.beats[1:]]
        mean_ms = (times[-1] - times[0]) / (len(times) - 1) * 1000
        assert period_ms * 0.8 < mean_ms < period_ms * 1.6, mean_ms
    drive.node.sdo[0x1017].raw = 0
    time.sleep(0.3)
    drive.beats.clear()
    time.sleep(QUICK)
    assert drive.beats == []


def enabled(drive: Listened) -> canopen.RemoteNode:
    """The drive operational and in Operation enabled, in CSP."""
    node = drive.node
    node.nmt.state = "OPERATIONAL"
    for controlword in (6, 7, 15):
        node.sdo[0x6040].raw = controlword
    until(lambda: node.sdo[0x6041].raw & 0x6F == 0x27)
    return node


def test_the_drive_watches_a_heartbeat(drive: Listened) -> None:
    """0x1016: when the master that it has heard falls silent, EMCY 0x8130 and no more motion."""
    node = drive.node
    node.sdo[0x2101][6].raw = 60_000  # SYNC may stay away: this is about heartbeats
    node.sdo[0x1016][1].raw = (1 << 16) | 400
    enabled(drive)
    for _ in range(6):
        node.network.send_message(0x701, bytes([OPERATIONAL]))
        time.sleep(0.1)
    assert node.emcy.log == []
    assert node.sdo[0x6041].raw & 0x6F == 0x27
    until(lambda: len(node.emcy.log) > 0)
    assert (node.emcy.log[0].code, node.emcy.log[0].register & 0x11) == (0x8130, 0x11)
    until(lambda: node.sdo[0x6041].raw & 0x6F != 0x27)
    assert node.sdo[0x1003][0].raw == 1
    assert node.sdo[0x1003][1].raw & 0xFFFF == 0x8130


def test_emergencies_with_history_and_reset(drive: Listened) -> None:
    """Loss of SYNC in Operation enabled; the history newest first, emptied by writing 0."""
    node = drive.node
    node.sdo[0x2101][6].raw = 100
    codes = []
    for _ in range(3):
        enabled(drive)
        node.network.send_message(0x80, b"\x01")
        seen = len(node.emcy.log)
        until(lambda n=seen: len(node.emcy.log) > n)
        codes.append(node.emcy.log[seen].code)
        until(lambda: node.sdo[0x6041].raw & 0x6F != 0x27)
        node.sdo[0x6040].raw = 0
        node.sdo[0x6040].raw = 0x80
        until(lambda: node.sdo[0x6041].raw & 0x4F == 0x40)
    assert set(codes) == {0x8700}
    count = node.sdo[0x1003][0].raw
    assert count >= 3
    history = [node.sdo[0x1003][i].raw & 0xFFFF for i in range(1, min(count, 8) + 1)]
    assert history.count(0x8700) >= 3
    assert abort_code(lambda: node.sdo.download(0x1003, 0, b"\x02")) == VALUE
    node.sdo[0x1003][0].raw = 0
    assert node.sdo[0x1003][0].raw == 0
    assert node.sdo[0x1003][1].raw == 0


def test_node_guarding_is_refused(drive: Listened, controller: Listened) -> None:
    """Remote frames get no answer, and its objects are not there."""
    for listened in (drive, controller):
        node = listened.node
        for index in (0x100C, 0x100D):
            assert abort_code(lambda n=node, i=index: n.sdo.upload(i, 0)) == NO_OBJECT
            assert abort_code(lambda n=node, i=index: n.sdo.download(i, 0, b"\0")) == NO_OBJECT
        node.sdo[0x1017].raw = 0
        time.sleep(0.3)
        listened.beats.clear()
        for base in (0x700, 0x180, 0x080, 0x580):
            node.network.send_message(base + node.id, b"", remote=True)
        time.sleep(QUICK)
        assert listened.beats == []
        assert node.sdo[0x1017].raw == 0


def test_the_sync_counter(drive: Listened) -> None:
    """The drive's clock is the counter: differences are periods, repetitions and losses are counted."""
    node = drive.node
    node.nmt.state = "OPERATIONAL"
    until(lambda: drive.told(OPERATIONAL))
    simulation = node.sdo[0x2101]
    for counter in (1, 2, 3, 7, 7, 8, 240, 1):
        node.network.send_message(0x80, bytes([counter]))
        time.sleep(0.01)
    until(lambda: simulation[4].raw == 1)
    assert simulation[3].raw == 3 + 231
    for wrong in (b"", b"\0", b"\xf1", b"\1\2"):
        node.network.send_message(0x80, wrong)
    time.sleep(0.05)
    assert (simulation[3].raw, simulation[4].raw) == (3 + 231, 1)


def test_the_controller_sends_sync_with_its_counter(controller: Listened) -> None:
    with can.Bus(
        interface="socketcan", channel="vcan0", can_filters=[{"can_id": 0x80, "can_mask": 0x7FF}]
    ) as bus:
        drain(bus)
        frames = [bus.recv(1.0) for _ in range(500)]
    counters = [frame.data[0] for frame in frames if frame is not None and frame.dlc == 1]
    assert len(counters) == 500
    assert {(b - a) % 240 for a, b in itertools.pairwise(counters)} == {1}
    assert set(counters) == set(range(1, 241))
    assert controller.node.sdo[0x1019].raw == 240


def test_the_controller_obeys_resets_only(controller: Listened) -> None:
    """It is the master: it starts itself, and nobody stops it."""
    until(lambda: controller.told(OPERATIONAL))
    for name in ("STOPPED", "PRE-OPERATIONAL"):
        controller.beats.clear()
        controller.node.nmt.state = name
        until(lambda: len(controller.beats) >= 3)
        assert {state for _, state in controller.beats} == {OPERATIONAL}
    for name in ("RESET", "RESET COMMUNICATION"):
        controller.command(name, BOOT_UP)
        until(lambda: controller.told(OPERATIONAL))
        assert [state for _, state in controller.beats].count(BOOT_UP) == 1


def test_foreign_frames_do_no_harm(drive: Listened) -> None:
    """Extended and remote frames with our identifiers are not ours."""
    node = drive.node
    with can.Bus(interface="socketcan", channel="vcan0") as bus:
        for identifier in (0x000, 0x080, 0x200 + DRIVE, 0x600 + DRIVE):
            for extended, remote in ((True, False), (False, True)):
                bus.send(
                    can.Message(
                        arbitration_id=identifier,
                        data=None if remote else struct.pack("<BB6x", 1, DRIVE),
                        dlc=8 if remote else None,
                        is_extended_id=extended,
                        is_remote_frame=remote,
                    )
                )
    drive.beats.clear()
    until(lambda: len(drive.beats) >= 3)
    assert {state for _, state in drive.beats} == {PRE_OPERATIONAL}
    assert node.sdo[0x1000].raw == 0x00020192


def test_drives_watch_the_controller_whatever_its_node() -> None:
    """0x1016 of the drives names the node that configured them."""
    with drive_process(2), drive_process(3):
        with (
            controller_process(5),
            client(canopen.RemoteNode(5, str(CONTROLLER_EDS))) as network,
        ):
            until(lambda: network[5].sdo[0x2002].raw == 1)
        with client(canopen.RemoteNode(2, str(DRIVE_EDS))) as network:
            assert network[2].sdo[0x1016][1].raw >> 16 == 5
