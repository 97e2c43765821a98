# SPDX-License-Identifier: MIT
"""PDOs of a drive, read, remapped and used through python canopen; and remaps that must be refused. Run by pytest;
starts a drive on a local bus.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import canopen
import numpy as np
import pytest
from canopen_bench import (
    DRIVE,
    NO_OBJECT,
    NO_SUB,
    STATE,
    TOO_HIGH,
    VALUE,
    abort_code,
    drive_node,
    let_pass,
    listener,
)

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus

NOT_MAPPABLE, PDO_LENGTH = 0x06040041, 0x06040042
OFF = 1 << 31


@pytest.fixture
def drive(hub: LocalHub, clock: VirtualClock) -> Iterator[canopen.RemoteNode]:
    with drive_node(hub) as node:
        yield node


@pytest.fixture
def bus(hub: LocalHub, clock: VirtualClock) -> Iterator[LocalBus]:
    """Receives all TPDOs of the drive."""
    with listener(hub, 0x180, 0x280, 0x380, 0x480, node=DRIVE) as made:
        yield made


def operational(node: canopen.RemoteNode) -> None:
    node.nmt.state = "OPERATIONAL"
    let_pass(node.network, 0.2)  # one heartbeat at least
    assert node.nmt.state == "OPERATIONAL"


class Sync:
    """SYNC with its counter, from here."""

    def __init__(self, node: canopen.RemoteNode) -> None:
        self.network = node.network
        self.counter = 0

    def send(self) -> None:
        self.counter = self.counter % 240 + 1
        self.network.send_message(0x80, bytes([self.counter]))


def answers(bus: LocalBus, wait_s: float = 0.15) -> dict[int, bytes]:
    """TPDOs that come in this time, by COB-ID less the node."""
    bus.clock.sleep(wait_s)
    frames = list(iter(lambda: bus.recv(0), None))
    found = {frame.arbitration_id - DRIVE: bytes(frame.data) for frame in frames}
    assert len(found) == len(frames), "the same PDO twice"
    return found


def mapped(pdo: canopen.pdo.base.PdoMap) -> list[tuple[int, int, int]]:
    return [(variable.index, variable.subindex, variable.length) for variable in pdo]


def test_what_python_canopen_reads(drive: canopen.RemoteNode) -> None:
    drive.rpdo.read()
    drive.tpdo.read()
    assert mapped(drive.rpdo[1]) == [(0x6040, 0, 16), (0x607A, 0, 32)]
    assert mapped(drive.tpdo[1]) == [(0x6041, 0, 16), (0x6064, 0, 32)]
    assert mapped(drive.tpdo[2]) == [(0x2100, 0, 16)]
    for pdo, cob_id in ((drive.rpdo[1], 0x200), (drive.tpdo[1], 0x180), (drive.tpdo[2], 0x280)):
        assert (pdo.cob_id, pdo.enabled, pdo.trans_type) == (cob_id + DRIVE, True, 1)


def test_a_tpdo_remapped_by_save(drive: canopen.RemoteNode, bus: LocalBus) -> None:
    """canopen's order: off, number 0, entries, number, on."""
    drive.sdo[0x6060].raw = 8
    drive.tpdo.read()
    pdo = drive.tpdo[1]
    pdo.clear()
    for index in (0x6041, 0x6061, 0x606C, 0x1001):
        pdo.add_variable(index)
    pdo.trans_type = 1
    pdo.enabled = True
    pdo.save()
    assert [drive.sdo[0x1A00][i].raw for i in range(5)] == [
        4,
        0x60410010,
        0x60610008,
        0x606C0020,
        0x10010008,
    ]
    operational(drive)
    Sync(drive).send()
    word, mode, speed, register = struct.unpack("<HbiB", answers(bus)[0x180])
    assert (word & 0x4F, mode, speed, register) == (0x40, 8, 0, 0)
    let_pass(drive.network, 0)
    assert pdo["Modes of operation display"].raw == 8


def test_an_rpdo_remapped_by_save(drive: canopen.RemoteNode) -> None:
    """Eight bytes: controlword, target, torque offset, as the controller asks for; and a second one."""
    drive.rpdo.read()
    first, second = drive.rpdo[1], drive.rpdo[2]
    first.clear()
    for index in (0x6040, 0x607A, 0x60B2):
        first.add_variable(index)
    first.trans_type = 1
    first.enabled = True
    first.save()
    second.clear()
    second.add_variable(0x60B1)
    second.cob_id = 0x300 + DRIVE
    second.trans_type = 1
    second.enabled = True
    second.save()
    operational(drive)
    sync = Sync(drive)
    first[0].raw, first[1].raw, first[2].raw = 6, 12345, -300
    second[0].raw = -7_000_000
    first.transmit()
    second.transmit()
    let_pass(drive.network, 0.05)
    assert drive.sdo[0x60B2].raw == 0, "type 1 waits for SYNC"
    sync.send()
    assert drive.sdo[0x60B2].raw == -300
    assert drive.sdo[0x60B1].raw == -7_000_000
    assert drive.sdo[0x6040].raw == 6
    assert drive.sdo[0x6041].raw & 0x6F == 0x21
    drive.network.send_message(0x200 + DRIVE, struct.pack("<Hi", 0, 99))  # shorter than mapped
    sync.send()
    let_pass(drive.network, 0.05)
    assert [error.code for error in drive.emcy.log] == [0x8210]
    assert drive.sdo[0x6041].raw & 0x6F == 0x21


@pytest.mark.parametrize("kind", [2, 3, 10, 240])
def test_every_nth_sync(drive: canopen.RemoteNode, bus: LocalBus, kind: int) -> None:
    """Transmission type n: with each n-th SYNC."""
    drive.sdo[0x1800][2].raw = kind
    operational(drive)
    sync = Sync(drive)
    sent = []
    for number in range(1, 3 * kind + 1):
        sync.send()
        found = answers(bus, 0.001)
        assert set(found) - {0x180} == {0x280}
        if 0x180 in found:
            sent.append(number)
    assert sent == [kind, 2 * kind, 3 * kind]


def test_acyclic_and_on_change(drive: canopen.RemoteNode, bus: LocalBus) -> None:
    """Type 0: with a SYNC after a change only. Type 255: at a change, without SYNC, and by the event timer."""
    for number, (kind, index) in enumerate(((0, 0x60400010), (255, 0x60B10020))):
        base = 0x1802 + number
        cob_id = (0x380, 0x480)[number] + DRIVE
        drive.sdo[base][1].raw = cob_id | OFF
        drive.sdo[base + 0x200][0].raw = 0
        drive.sdo[base + 0x200][1].raw = index
        drive.sdo[base + 0x200][0].raw = 1
        drive.sdo[base][2].raw = kind
        drive.sdo[base][1].raw = cob_id
    operational(drive)
    sync = Sync(drive)
    sync.send()
    answers(bus)
    sync.send()
    assert set(answers(bus)) == {0x180, 0x280}
    drive.sdo[0x60B1].raw = -5
    drive.sdo[0x6040].raw = 6
    assert answers(bus) == {0x480: struct.pack("<i", -5)}
    sync.send()
    found = answers(bus)
    assert set(found) == {0x180, 0x280, 0x380}
    assert found[0x380] == b"\6\0"
    drive.sdo[0x1803][5].raw = 100
    times = [frame.timestamp for frame in (bus.recv(2.0) for _ in range(6)) if frame is not None]
    assert len(times) == 6
    assert np.diff(times[1:]) == pytest.approx(0.1, abs=1e-6)


def test_a_pdo_that_is_off_is_silent(drive: canopen.RemoteNode, bus: LocalBus) -> None:
    drive.sdo[0x1800][1].raw = (0x180 + DRIVE) | OFF
    drive.sdo[0x1400][1].raw = (0x200 + DRIVE) | OFF
    operational(drive)
    sync = Sync(drive)
    drive.network.send_message(0x200 + DRIVE, struct.pack("<Hi", 6, 0))
    sync.send()
    assert set(answers(bus)) == {0x280}
    assert drive.sdo[0x6040].raw == 0
    drive.sdo[0x1800][1].raw = 0x180 + DRIVE
    sync.send()
    assert set(answers(bus)) == {0x180, 0x280}


def write(node: canopen.RemoteNode, index: int, sub: int, value: int, size: int = 4) -> int:
    return abort_code(lambda: node.sdo.download(index, sub, value.to_bytes(size, "little")))


@pytest.mark.parametrize("communication", [0x1400, 0x1800])
def test_wrong_remaps_are_refused(drive: canopen.RemoteNode, communication: int) -> None:
    """And leave everything as it was."""
    mapping, received = communication + 0x200, communication == 0x1400
    base = (0x200 if received else 0x180) + DRIVE
    before = [drive.sdo[mapping][i].raw for i in range(3)]

    assert write(drive, mapping, 0, 0, 1) == STATE, "a mapping of a valid PDO"
    assert write(drive, mapping, 1, 0x60FF0020) == STATE
    assert write(drive, communication, 1, base + 1) == VALUE, "another identifier while valid"
    for kind in (241, 251):
        assert write(drive, communication, 2, kind, 1) == VALUE, kind
    if not received:
        assert write(drive, communication, 2, 252, 1) == VALUE, "no remote requests"
        assert write(drive, communication, 3, 100, 2) == STATE, "inhibit time while valid"

    assert write(drive, communication, 1, base | OFF) == 0
    for identifier in (0x000, 0x080, 0x581, 0x600 + DRIVE, 0x700 + DRIVE, 0x7FF, 0x20000180):
        assert write(drive, communication, 1, identifier) == VALUE, hex(identifier)
    assert write(drive, mapping, 1, 0x60640020) == STATE, "an entry while sub 0 is not 0"
    assert write(drive, mapping, 0, 9, 1) == TOO_HIGH
    assert write(drive, mapping, 0, 0, 1) == 0
    assert write(drive, mapping, 1, 0x5FFF0020) == NO_OBJECT
    assert write(drive, mapping, 1, 0x607D0920) == NO_SUB
    assert write(drive, mapping, 1, 0x10170010) == NOT_MAPPABLE
    assert write(drive, mapping, 1, 0x607A0010) == NOT_MAPPABLE, "half of an object"
    wrong_way = 0x60640020 if received else None
    if wrong_way is not None:
        assert write(drive, mapping, 1, wrong_way) == NOT_MAPPABLE, "what cannot be written"
    for sub in (1, 2, 3):
        assert write(drive, mapping, sub, 0x607A0020) == 0
    assert write(drive, mapping, 0, 3, 1) == PDO_LENGTH, "twelve bytes"
    assert write(drive, mapping, 0, 2, 1) == 0

    assert write(drive, mapping, 0, 0, 1) == 0
    for sub in (1, 2):
        assert write(drive, mapping, sub, before[sub]) == 0
    assert write(drive, mapping, 0, before[0], 1) == 0
    assert write(drive, communication, 1, base) == 0
    assert [drive.sdo[mapping][i].raw for i in range(3)] == before


def test_a_reset_brings_the_mapping_back(drive: canopen.RemoteNode) -> None:
    drive.tpdo.read()
    pdo = drive.tpdo[1]
    pdo.clear()
    pdo.add_variable(0x6061)
    pdo.enabled = True
    pdo.save()
    assert drive.sdo[0x1A00][1].raw == 0x60610008
    beats: list[int] = []
    drive.nmt.add_heartbeat_callback(beats.append)
    drive.nmt.state = "RESET COMMUNICATION"
    let_pass(drive.network, 0.1)
    assert beats.count(0) == 1
    assert [drive.sdo[0x1A00][i].raw for i in range(3)] == [2, 0x60410010, 0x60640020]
