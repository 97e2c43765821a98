# SPDX-License-Identifier: MIT
"""NMT, heartbeat, EMCY, SYNC and refusals, with python canopen as the master. Run by pytest; starts controllers and
drives, each on a local bus.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import can
import canopen
import numpy as np
import pytest
from canopen_bench import (
    DRIVE,
    NO_OBJECT,
    VALUE,
    abort_code,
    controller_node,
    drive_node,
    let_pass,
    listener,
    until,
)

from hodograph.bus.capture.frames import Frames
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.processes import virtual_clock
from hodograph.bustime.frame_bits import exact_bits

BOOT_UP, STOPPED, OPERATIONAL, PRE_OPERATIONAL = 0x00, 0x04, 0x05, 0x7F
QUICK_STOP = 0x07
"""Quick stop active, of the statusword."""
QUIET_S = 1.0
"""In which an answer that must not come would have come."""
DRIVE_LOOK_MS = 10.2
"""A drive that receives nothing reads its clock every 10 ms; then its frame has to go over the bus."""


class Listened:
    """A node, and the heartbeats of it so far."""

    def __init__(self, node: canopen.RemoteNode) -> None:
        self.node = node
        self.beats: list[tuple[float, int]] = []
        node.nmt.add_heartbeat_callback(self._beat)

    def _beat(self, state: int) -> None:
        self.beats.append((self.node.nmt.timestamp, state))

    def states(self, count: int) -> list[int]:
        """Of the next heartbeats."""
        self.beats.clear()
        until(self.node.network, lambda: len(self.beats) >= count)
        return [state for _, state in self.beats]

    def reported(self, state: int) -> bool:
        return any(beat == state for _, beat in self.beats)

    def command(self, name: str, state: int) -> None:
        """An NMT command, until a heartbeat reports the state."""
        self.beats.clear()
        self.node.nmt.state = name
        until(self.node.network, lambda: self.reported(state))


@pytest.fixture
def drive(hub: LocalHub, clock: VirtualClock) -> Iterator[Listened]:
    with drive_node(hub) as node:
        yield Listened(node)


@pytest.fixture
def controller(hub: LocalHub, clock: VirtualClock) -> Iterator[Listened]:
    with controller_node(hub) as node:
        yield Listened(node)


def tpdo_monitor_to_sync(hub: LocalHub, node: canopen.RemoteNode) -> list[int]:
    """COB-IDs of what a SYNC is answered with."""
    with listener(hub, 0x180, 0x280, 0x380, 0x480, node=node.id) as bus:
        node.network.send_message(0x80, b"\x01")
        let_pass(node.network, QUIET_S)
        return [frame.arbitration_id - node.id for frame in iter(lambda: bus.recv(0), None)]


def test_all_commands(hub: LocalHub, drive: Listened) -> None:
    node = drive.node
    assert drive.states(2) == [PRE_OPERATIONAL] * 2
    assert tpdo_monitor_to_sync(hub, node) == []
    drive.command("OPERATIONAL", OPERATIONAL)
    assert tpdo_monitor_to_sync(hub, node) == [0x180, 0x280]
    assert node.sdo[0x1000].raw == 0x00020192
    drive.command("STOPPED", STOPPED)
    assert tpdo_monitor_to_sync(hub, node) == []
    with pytest.raises(canopen.SdoCommunicationError):
        node.sdo.upload(0x1000, 0)
    drive.command("PRE-OPERATIONAL", PRE_OPERATIONAL)
    assert node.sdo[0x1000].raw == 0x00020192
    assert tpdo_monitor_to_sync(hub, node) == []


@pytest.mark.parametrize("command", ["RESET", "RESET COMMUNICATION"])
@pytest.mark.parametrize("before", ["OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"])
def test_resets_from_every_state(drive: Listened, command: str, before: str) -> None:
    """One boot-up message, then pre-operational."""
    states = {"OPERATIONAL": OPERATIONAL, "STOPPED": STOPPED, "PRE-OPERATIONAL": PRE_OPERATIONAL}
    drive.command(before, states[before])
    drive.command(command, BOOT_UP)
    until(drive.node.network, lambda: len(drive.beats) >= 4)
    reported = [state for _, state in drive.beats]
    assert reported[reported.index(BOOT_UP) :] == [BOOT_UP, *[PRE_OPERATIONAL] * 3]
    assert drive.node.sdo[0x1000].raw == 0x00020192


def test_commands_to_all_and_to_others(drive: Listened) -> None:
    network = drive.node.network
    network.send_message(0, bytes([1, DRIVE + 1]))  # not to us
    network.send_message(0, bytes([99, DRIVE]))  # no such command
    network.send_message(0, bytes([1]))  # too short
    network.send_message(0, bytes([1, DRIVE, 0]))  # too long
    assert drive.states(3) == [PRE_OPERATIONAL] * 3
    network.send_message(0, bytes([1, 0]))
    let_pass(network, 0.001)
    assert drive.states(3) == [OPERATIONAL] * 3


@pytest.mark.parametrize("period_ms", [50, 250])
def test_the_heartbeat_follows_0x1017(drive: Listened, period_ms: int) -> None:
    drive.node.sdo[0x1017].raw = period_ms
    drive.states(9)
    times_ms = 1000 * np.array([at for at, _ in drive.beats])
    assert np.diff(times_ms) == pytest.approx(period_ms, abs=0.001)
    drive.node.sdo[0x1017].raw = 0
    drive.beats.clear()
    let_pass(drive.node.network, QUIET_S)
    assert drive.beats == []


def enabled(drive: Listened) -> canopen.RemoteNode:
    """The drive operational and in Operation enabled, in CSP."""
    node = drive.node
    node.nmt.state = "OPERATIONAL"
    node.sdo[0x6060].raw = 8
    for controlword in (6, 7, 15):
        node.sdo[0x6040].raw = controlword
    assert node.sdo[0x6041].raw & 0x6F == 0x27
    return node


@pytest.mark.parametrize("beats", [1, 6])
@pytest.mark.parametrize("limit_ms", [110, 400, 1000])
def test_the_drive_watches_a_heartbeat(drive: Listened, limit_ms: int, beats: int) -> None:
    """0x1016: when the master whose heartbeats it received stops sending, EMCY 0x8130 and quick stop."""
    node = drive.node
    node.sdo[0x2101][6].raw = 60_000  # SYNC may stay away: this is about heartbeats
    node.sdo[0x1016][1].raw = (1 << 16) | limit_ms
    enabled(drive)
    let_pass(node.network, 2.0)  # nobody is missed who never sent a heartbeat
    for _ in range(beats):
        last_s = node.network.clock.stamp_ns() * 1e-9
        node.network.send_message(0x701, bytes([OPERATIONAL]))
        let_pass(node.network, 0.1)
    assert node.emcy.log == []
    assert node.sdo[0x6041].raw & 0x6F == 0x27
    until(node.network, lambda: len(node.emcy.log) > 0)
    late_ms = (node.emcy.log[0].timestamp - last_s) * 1000 - limit_ms
    assert abs(late_ms) < DRIVE_LOOK_MS
    assert (node.emcy.log[0].code, node.emcy.log[0].register) == (0x8130, 0x11)
    assert node.sdo[0x6041].raw & 0x6F == QUICK_STOP
    assert node.sdo[0x1003][0].raw == 1
    assert node.sdo[0x1003][1].raw & 0xFFFF == 0x8130


def test_emergencies_with_history_and_reset(drive: Listened) -> None:
    """Loss of SYNC in Operation enabled; the history newest first, emptied by writing 0."""
    node, limit_ms = drive.node, 100
    node.sdo[0x2101][6].raw = limit_ms
    for count in range(1, 4):
        enabled(drive)
        last_s = node.network.clock.stamp_ns() * 1e-9
        node.network.send_message(0x80, b"\x01")
        until(node.network, lambda n=count: len(node.emcy.log) == 2 * n - 1)
        late_ms = (node.emcy.log[-1].timestamp - last_s) * 1000 - limit_ms
        assert 0 < late_ms < DRIVE_LOOK_MS
        assert node.sdo[0x6041].raw & 0x6F == QUICK_STOP
        node.sdo[0x6040].raw = 0
        node.sdo[0x6040].raw = 0x80
        assert node.sdo[0x6041].raw & 0x4F == 0x40
        assert len(node.emcy.log) == 2 * count - 1
    enabled(drive)  # which ends the error
    let_pass(node.network, 0.001)
    assert [(error.code, error.register) for error in node.emcy.log] == 3 * [(0x8700, 0x11), (0, 0)]
    assert [node.sdo[0x1003][i].raw & 0xFFFF for i in range(5)] == [3, 0x8700, 0x8700, 0x8700, 0]
    assert abort_code(lambda: node.sdo.download(0x1003, 0, b"\x02")) == VALUE
    node.sdo[0x1003][0].raw = 0
    assert node.sdo[0x1003][0].raw == 0
    assert node.sdo[0x1003][1].raw == 0


@pytest.mark.parametrize("kind", ["drive", "controller"])
def test_node_guarding_is_refused(request: pytest.FixtureRequest, kind: str) -> None:
    """Remote frames get no answer, and its objects are not there."""
    listened: Listened = request.getfixturevalue(kind)
    node = listened.node
    for index in (0x100C, 0x100D):
        assert abort_code(lambda i=index: node.sdo.upload(i, 0)) == NO_OBJECT
        assert abort_code(lambda i=index: node.sdo.download(i, 0, b"\0")) == NO_OBJECT
    slowest_ms = {"drive": 0, "controller": 1000}[kind]  # drives watch a controller: it has to beat
    node.sdo[0x1017].raw = slowest_ms
    if slowest_ms:
        let_pass(node.network, 3.0)  # without a configuration its heartbeats pause at first
        listened.beats.clear()
        until(node.network, lambda: listened.beats)
    listened.beats.clear()
    for base in (0x700, 0x180, 0x080, 0x580):
        node.network.send_message(base + node.id, b"", remote=True)
    let_pass(node.network, 0.9 * QUIET_S)
    assert listened.beats == []
    assert node.sdo[0x1017].raw == slowest_ms


def test_the_sync_counter(drive: Listened) -> None:
    """The drive's clock is the counter: differences are periods, repetitions and losses are counted."""
    node = drive.node
    drive.command("OPERATIONAL", OPERATIONAL)
    simulation = node.sdo[0x2101]
    for counter in (1, 2, 3, 7, 7, 8, 240, 1):
        node.network.send_message(0x80, bytes([counter]))
    assert (simulation[3].raw, simulation[4].raw) == (3 + 231, 1)
    for wrong in (b"", b"\0", b"\xf1", b"\1\2"):
        node.network.send_message(0x80, wrong)
    assert (simulation[3].raw, simulation[4].raw) == (3 + 231, 1)


def test_the_controller_sends_sync_with_its_counter(hub: LocalHub, controller: Listened) -> None:
    with Recorder(hub.address) as recorder:
        let_pass(controller.node.network, 0.5)
        frames = recorder.so_far()
    syncs = frames[frames["id"] == 0x80]
    counters = syncs["data"][:, 0].astype(int)
    begins_us = syncs["time_us"] - exact_bits(syncs)
    assert syncs.size == 500
    # an NMT command to a drive that is looked for has the higher priority: 68 us when both are due at once
    assert (np.abs(begins_us - begins_us[0] - 1000 * np.arange(500)) <= 68).all()
    assert (syncs["length"] == 1).all()
    assert set(np.diff(counters) % 240) == {1}
    assert set(counters) == set(range(1, 241))
    assert controller.node.sdo[0x1019].raw == 240


def test_the_controller_executes_resets_only(controller: Listened) -> None:
    """It is the master: it starts itself, and nobody stops it."""
    assert controller.states(1) == [OPERATIONAL]
    for name in ("STOPPED", "PRE-OPERATIONAL"):
        controller.node.nmt.state = name
        assert controller.states(3) == [OPERATIONAL] * 3
    for name in ("RESET", "RESET COMMUNICATION"):
        controller.node.nmt.state = name
        assert controller.states(3) == [BOOT_UP, OPERATIONAL, OPERATIONAL]


def test_foreign_frames_do_no_harm(hub: LocalHub, drive: Listened) -> None:
    """Extended and remote frames with our identifiers are not ours."""
    node = drive.node
    with listener(hub) as bus:
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
    assert drive.states(3) == [PRE_OPERATIONAL] * 3
    assert node.sdo[0x1000].raw == 0x00020192


def test_drives_watch_the_controller_whatever_its_node(hub: LocalHub, clock: VirtualClock) -> None:
    """0x1016 of the drives names the node that configured them."""
    with drive_node(hub, 2) as first, drive_node(hub, 3) as second:
        with controller_node(hub, 5) as node:
            until(node.network, lambda: node.sdo[0x2002].raw == 1)
        clock.sleep(0.1)  # drives may still answer the controller's last request
        for drive in (first, second):
            assert drive.sdo[0x1016][1].raw >> 16 == 5


def recorded(hub_of: LocalHub) -> Frames:
    """A drive and a controller, from power-on through commands, resets and SDO transfers."""
    with Recorder(hub_of.address) as recorder, drive_node(hub_of, 2) as drive:
        with controller_node(hub_of) as controller:
            let_pass(controller.network, 0.5)
            for name in ("OPERATIONAL", "RESET", "STOPPED", "RESET COMMUNICATION"):
                drive.nmt.state = name
                let_pass(drive.network, 0.2)
            assert controller.sdo[0x1008].raw == "Hodograph controller"
            let_pass(controller.network, 0.2)
        return recorder.so_far()


def test_the_same_frames_at_the_same_times_in_every_run(one_core: None) -> None:
    runs = []
    for _ in range(2):
        with LocalHub() as hub_of:
            clock_of = virtual_clock(hub_of.address)
            assert clock_of is not None
            runs.append(recorded(hub_of))
            clock_of.release()
    assert runs[0].size > 1500
    assert np.array_equal(runs[0], runs[1])
