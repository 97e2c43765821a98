# SPDX-License-Identifier: MIT
"""hodograph-drive as a process: its command line, its objects seen by python canopen, its end. Run by pytest; starts
drives on a local bus.
"""

from __future__ import annotations

import signal
import struct
import subprocess
from collections.abc import Iterator
from pathlib import Path

import can
import canopen
import pytest
from canopen_bench import DRIVE_EDS, FIGURES, let_pass, listener

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.processes import Process
from hodograph.bus.sdo.network import Network
from hodograph.data import object_dictionary

HANGS_S = 600.0  # of real time: none of these takes a second
DRIVE = "build/bin/hodograph-drive"
MODELLED = {0x1018, 0x2101, 0x6041, 0x6062, 0x6063, 0x6064, 0x6075, 0x6076, 0x607A, 0x6092}
"""Objects whose value is the model's, not the default of the EDS."""


def run(root: Path, *words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [str(root / DRIVE), *words], capture_output=True, text=True, timeout=HANGS_S, check=False
    )


@pytest.mark.parametrize(
    ("words", "status", "part"),
    [
        ((), 2, "--bus"),
        (("--bus", "vcan0"), 2, "--axis"),
        (("--bus", "vcan0", "--axis", "node=2"), 2, "gain_rad_s_v"),
        (("--bus", "vcan0", "--axis", f"node=2,{FIGURES},loop_rate_hz=1001"), 2, "servo samples"),
        (("--bus", "nobus9", "--axis", f"node=2,{FIGURES}"), 4, "nobus9"),
    ],
)
def test_faults_are_one_line_and_a_status(
    root: Path, words: tuple[str, ...], status: int, part: str
) -> None:
    done = run(root, *words)
    assert done.returncode == status
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert part in done.stderr


def test_help(root: Path) -> None:
    done = run(root, "--help")
    assert done.returncode == 0
    assert "Exit status" in done.stdout


@pytest.fixture
def drives(root: Path, hub: LocalHub, clock: VirtualClock) -> Iterator[Process]:
    """Two drives: node 42 at 1.5 mm, node 43 at 0 with a limit switch at -2 mm."""
    words = [str(root / DRIVE), "--bus", hub.address.channel]
    for axis in ("node=42,position_mm=1.5", "node=43,limit_negative_mm=-2"):
        words += ["--axis", f"{axis},{FIGURES}"]
    with listener(hub) as bus:
        process = Process("drives", words, clock)
        booted = [bus.recv(1.0) for _ in range(2)]
    assert [frame.arbitration_id for frame in booted if frame] == [0x700 + 42, 0x700 + 43]
    yield process
    process.kill()
    process.end()


@pytest.fixture
def network(hub: LocalHub, drives: Process) -> Iterator[Network]:
    network = Network(LocalBus(hub.address.channel))
    for node in (42, 43):
        network.add_node(node, object_dictionary(DRIVE_EDS, node)).sdo.RESPONSE_TIMEOUT = 2.0
    yield network
    network.disconnect()


def test_every_object_reads_back_as_the_eds_says(network: Network) -> None:
    node = network[42]
    entries = 0
    for entry in node.object_dictionary.values():
        parts = (
            [entry] if isinstance(entry, canopen.objectdictionary.ODVariable) else entry.values()
        )
        for part in parts:
            if not part.readable:
                with pytest.raises(canopen.SdoAbortedError):
                    node.sdo.upload(part.index, part.subindex)
                continue
            data = node.sdo.upload(part.index, part.subindex)
            value = part.decode_raw(data)
            entries += 1
            if part.index not in MODELLED and part.default is not None:
                assert value == part.default, f"{part.index:#x} sub {part.subindex}"
    assert entries > 60
    position, feed = node.sdo.upload(0x6064, 0), node.sdo.upload(0x6092, 1)
    assert int.from_bytes(position, "little") == 1_500_003  # nearest encoder increment
    assert int.from_bytes(feed, "little") == 9_990_265


def test_two_nodes_answer_a_sync_each(hub: LocalHub, network: Network) -> None:
    network.nmt.send_command(1)
    let_pass(network, 0.01)
    with listener(hub) as bus:
        for counter in range(1, 6):
            bus.send(can.Message(arbitration_id=0x80, data=[counter], is_extended_id=False))
            bus.clock.sleep(0.001)
            frames = list(iter(lambda: bus.recv(0), None))
            found = {frame.arbitration_id: bytes(frame.data) for frame in frames}
            assert list(found) == [0x180 + 42, 0x180 + 43, 0x280 + 42, 0x280 + 43]
            word, position = struct.unpack("<Hi", found[0x180 + 42])
            assert (word & 0x6F, position) == (0x40, 1_500_003)
            assert struct.unpack("<Hi", found[0x180 + 43])[1] == 0
            assert struct.unpack("<h", found[0x280 + 43]) == (0,)


def test_a_moved_pdo_is_received(network: Network) -> None:
    """The filters of the process follow the COB-ID; type 255 acts without SYNC."""
    sdo = network[42].sdo
    network.nmt.send_command(1)
    sdo[0x1400][1].raw = 0x80000000 | 0x22A
    sdo[0x1400][1].raw = 0x80000000 | 0x3C5
    sdo[0x1400][2].raw = 255
    sdo[0x1400][1].raw = 0x3C5
    network.send_message(0x22A, b"\x06\x00\x00\x00\x00\x00")
    assert sdo[0x6041].raw & 0x6F == 0x40
    network.send_message(0x3C5, b"\x06\x00\x00\x00\x00\x00")
    assert sdo[0x6041].raw & 0x6F == 0x21


def test_homes_by_sdo_without_sync(network: Network) -> None:
    sdo = network[43].sdo
    sdo[0x6060].raw = 6
    assert sdo[0x6061].raw == 6
    sdo[0x6098].raw = 17
    for word in (0x06, 0x07, 0x0F, 0x1F):
        sdo[0x6040].raw = word
    begun_s = network.clock.now_s()
    while sdo[0x6041].raw & 0x3400 == 0:
        assert network.clock.now_s() - begun_s < 20.0
        network.clock.sleep(0.01)
    assert sdo[0x6041].raw & 0x3400 == 0x1400
    assert sdo[0x60FD].raw == 0  # the switch is off again
    assert abs(sdo[0x6064].raw) <= 1  # back at home


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT])
def test_ends_cleanly(clock: VirtualClock, drives: Process, end: signal.Signals) -> None:
    begun_s = clock.now_s()
    clock.signal(drives.name, drives.child, end)
    assert clock.await_end(drives.name, drives.child, 5.0) == 0
    assert clock.now_s() == begun_s
    assert drives.text() == ""
