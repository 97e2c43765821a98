# SPDX-License-Identifier: MIT
"""The nodes on the CAN of the kernel, in real time: their sockets, its filters, and python canopen's own thread. Run by
pytest on vcan0; starts controllers and drives.
"""

from __future__ import annotations

import struct
import subprocess
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import can
import canopen
import pytest
from canopen_bench import (
    CONTROLLER,
    CONTROLLER_EDS,
    DRIVE,
    DRIVE_EDS,
    FIGURES,
    frames_of,
    program,
)

from hodograph.bus.processes import Process
from hodograph.data import object_dictionary

pytestmark = pytest.mark.bus

LIMIT_S = 60.0
"""Of real time, for what takes milliseconds: only a machine that stands still takes so long."""


@contextmanager
def device(root: Path, node: int, *words: str) -> Iterator[Process]:
    """A process on vcan0, from its boot-up frame to its end."""
    filters = frames_of(0x700, node=node)
    with can.Bus(interface="socketcan", channel="vcan0", can_filters=filters) as bus:
        command = [str(root / "build/bin" / words[0]), "--bus", "vcan0", *words[1:]]
        made = Process(f"node-{node}", command)
        try:
            frame = bus.recv(LIMIT_S)
            assert frame is not None, made.text()
            assert bytes(frame.data) == b"\0"
            yield made
        finally:
            made.kill()
            made.end()


@pytest.fixture
def nodes(root: Path) -> Iterator[canopen.Network]:
    """A drive and a controller, as python canopen has them by itself."""
    with ExitStack() as stack:
        stack.enter_context(
            device(root, DRIVE, "hodograph-drive", "--axis", f"node={DRIVE},{FIGURES}")
        )
        stack.enter_context(device(root, CONTROLLER, "hodograph-controller"))
        network = canopen.Network()
        filters = [
            each
            for node in (CONTROLLER, DRIVE)
            for each in frames_of(0x580, 0x700, node=node)  # process data would fill the socket
        ]
        network.connect(interface="socketcan", channel="vcan0", can_filters=filters)
        stack.callback(network.disconnect)
        for node, eds in ((CONTROLLER, CONTROLLER_EDS), (DRIVE, DRIVE_EDS)):
            network.add_node(node, object_dictionary(eds, node)).sdo.RESPONSE_TIMEOUT = LIMIT_S
        yield network


def test_an_interface_that_is_no_can_bus_is_refused(root: Path) -> None:
    words = [str(root / "build/bin/hodograph-controller"), "--bus", "lo"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=LIMIT_S, check=False)
    assert done.returncode == 4
    assert "not a CAN interface" in done.stderr


def test_transfers(nodes: canopen.Network) -> None:
    """Expedited, segmented, block, and one that fills the queue of the interface."""
    node = nodes[CONTROLLER]
    assert node.sdo[0x1000].raw == 0
    assert node.sdo[0x1008].raw == "Hodograph controller"
    for sub, limit in ((2, 500_000), (3, 5_000_000), (4, 200_000)):
        node.sdo[0x2004][sub].raw = limit
    image = program("alpha_minimax")
    with node.sdo[0x2000][1].open(
        "wb", size=len(image), block_transfer=True, buffering=0
    ) as stream:
        for start in range(0, len(image), 7):
            stream.write(image[start : start + 7])
    assert node.sdo[0x2000][6].raw == len(image)
    with node.sdo[0x2000][1].open("rb", block_transfer=True) as stream:
        assert stream.read() == image


def test_a_moved_pdo_passes_the_filters(nodes: canopen.Network) -> None:
    """The filters of the drive's socket follow the COB-ID; what is moved away is not received."""
    sdo = nodes[DRIVE].sdo
    nodes.nmt.send_command(1)
    sdo[0x1400][1].raw = 0x80000000 | 0x200 + DRIVE
    sdo[0x1400][1].raw = 0x80000000 | 0x3C5
    sdo[0x1400][2].raw = 255
    sdo[0x1400][1].raw = 0x3C5
    for identifier, found in ((0x200 + DRIVE, 0x40), (0x3C5, 0x21)):
        nodes.send_message(identifier, b"\x06\x00\x00\x00\x00\x00")
        assert sdo[0x6041].raw & 0x6F == found, hex(identifier)


def test_extended_and_remote_frames_do_not_pass(nodes: canopen.Network) -> None:
    """They carry the identifiers and data of commands that the drive would follow."""
    node = nodes[DRIVE]
    for identifier in (0x000, 0x080, 0x200 + DRIVE, 0x600 + DRIVE):
        for extended, remote in ((True, False), (False, True)):
            message = can.Message(
                arbitration_id=identifier,
                data=None if remote else struct.pack("<BB6x", 1, DRIVE),
                dlc=8 if remote else None,
                is_extended_id=extended,
                is_remote_frame=remote,
            )
            nodes.bus.send(message)
    assert node.sdo[0x1000].raw == 0x00020192  # the frames before have been taken
    assert node.nmt.wait_for_heartbeat(LIMIT_S) == "PRE-OPERATIONAL"


def test_the_heartbeat_keeps_to_the_clock(nodes: canopen.Network) -> None:
    """In real time, judged by how late this computer wakes a sleeping thread of its own meanwhile."""
    stamps: list[float] = []
    nodes.subscribe(0x700 + DRIVE, lambda _, __, stamp: stamps.append(stamp))
    late_s = []
    while len(stamps) < 12:
        begun_s = time.monotonic()
        time.sleep(0.01)
        late_s.append(time.monotonic() - begun_s - 0.01)
    host_s = max(late_s)
    mean_s = (stamps[-1] - stamps[0]) / (len(stamps) - 1)
    drift_s = abs(mean_s - 0.1) * (len(stamps) - 1)
    assert drift_s < 0.011 + 5 * host_s, f"{drift_s:.4f} s, this computer {host_s:.4f} s"
