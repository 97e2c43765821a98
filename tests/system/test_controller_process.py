# SPDX-License-Identifier: MIT
"""hodograph-controller as a process, with simulated drives: command line, a whole run, a lost drive, its end. Run by
pytest; starts controllers and drives on a local bus.
"""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen
import pytest
from canopen_bench import CONTROLLER_EDS, DRIVE_EDS, FIGURES, until

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.processes import Process
from hodograph.bus.sdo.network import Network
from hodograph.data import object_dictionary
from hodograph.pipeline import load_pipeline
from hodograph.program import encode

HANGS_S = 600.0  # of real time: none of these takes a second
CONTROLLER = "build/bin/hodograph-controller"
DRIVE = "build/bin/hodograph-drive"
BOOT, OFF, ENABLING, READY, RUNNING, FAULT = 0, 1, 2, 3, 4, 6
ENABLE, START, STOP, DISABLE, RESET = 1, 2, 3, 4, 5
NOT_NOW = 0x08000022
NOT_AT_START, MOVING, OFF_YET, IN_FAULT = 2, 3, 4, 5
"""Reasons of a refusal."""
POSITIONS_MISSED = 2
"""In a row, when it is a fault."""
FILTERS: list[Any] = [{"can_id": 0x580, "can_mask": 0x780}, {"can_id": 0x700, "can_mask": 0x780}]


class Machine:
    """Two drives, each a process, and a controller."""

    def __init__(self, root: Path, hub: LocalHub, clock: VirtualClock) -> None:
        self.root, self.hub, self.clock = root, hub, clock
        self.network = Network(LocalBus(hub.address.channel, can_filters=FILTERS))
        node: Any = self.network.add_node(1, object_dictionary(CONTROLLER_EDS, 1))
        self.sdo = node.sdo
        self.sdo.RESPONSE_TIMEOUT = 3.0
        beats: list[int] = []
        node.nmt.add_heartbeat_callback(beats.append)
        self.drives = {number: self._drive(number) for number in (2, 3)}
        words = [str(root / CONTROLLER), "--bus", hub.address.channel]
        self.controller = Process("controller", words, clock)
        until(self.network, lambda: 0 in beats)

    def _drive(self, node: int) -> Process:
        words = [str(self.root / DRIVE), "--bus", self.hub.address.channel]
        return Process(f"drive-{node}", [*words, "--axis", f"node={node},{FIGURES}"], self.clock)

    def replace_drive(self, node: int) -> None:
        self.drives[node].end()
        self.drives[node] = self._drive(node)

    def until(self, state: int, limit_s: float = 10.0) -> float:
        """Waits for a state; seconds from now."""
        begun_s = self.clock.now_s()
        while (now := self.sdo[0x2002].raw) != state:
            spent_s = self.clock.now_s() - begun_s
            assert spent_s < limit_s, f"state {now}, fault {self.fault()}"
            self.clock.sleep(0.001)
        return self.clock.now_s() - begun_s

    def fault(self) -> list[int]:
        return [self.sdo[0x2003][sub].raw for sub in (1, 2, 3)]

    def command(self, command: int) -> int:
        """0, or the reason of the refusal."""
        try:
            self.sdo[0x2001].raw = command
        except canopen.SdoAbortedError as error:
            if error.code != NOT_NOW:
                raise
            return int(self.sdo[0x2003][4].raw)
        return 0

    def upload(self, image: bytes) -> None:
        stream = self.sdo[0x2000][1].open("wb", size=len(image), block_transfer=True, buffering=0)
        for start in range(0, len(image), 7):
            stream.write(image[start : start + 7])
        stream.close()

    def prepare(self, image: bytes) -> None:
        self.sdo[0x2004][2].raw = 500_000
        self.sdo[0x2004][3].raw = 5_000_000
        self.sdo[0x2004][4].raw = 200_000
        self.sdo[0x2050][2].raw = self.sdo[0x2050][1].raw
        self.until(OFF)
        self.upload(image)

    def start(self) -> None:
        assert self.command(ENABLE) == 0
        self.until(READY)
        assert self.commanded(START) <= {MOVING}  # has not stood still for long enough

    def commanded(self, command: int) -> set[int]:
        """Gives a command until it is taken; the reasons why it was not."""
        refusals = set()
        end_s = self.clock.now_s() + 1.0
        while (refusal := self.command(command)) != 0:
            refusals.add(refusal)
            assert self.clock.now_s() < end_s, refusals
            self.clock.sleep(0.001)
        return refusals

    def close(self) -> None:
        self.network.disconnect()
        for process in (self.controller, *self.drives.values()):
            process.kill()
            process.end()


@pytest.fixture
def machine(root: Path, hub: LocalHub, clock: VirtualClock) -> Iterator[Machine]:
    machine = Machine(root, hub, clock)
    yield machine
    machine.close()


@pytest.fixture(scope="module")
def image(root: Path) -> bytes:
    return (root / "tests/data/programs/alpha_quintic.hdgp").read_bytes()


@pytest.mark.parametrize(
    ("words", "status", "part"),
    [
        ((), 2, "--bus"),
        (("--bus",), 2, "missing"),
        (("--bus", "vcan0", "--node", "0"), 2, "1 to 127"),
        (("--bus", "vcan0", "--pace", "slow"), 2, "slow"),
        (("--speed",), 2, "--speed"),
        (("--bus", "nobus9"), 4, "nobus9"),
    ],
)
def test_faults_are_one_line_and_a_status(
    root: Path, words: tuple[str, ...], status: int, part: str
) -> None:
    done = subprocess.run(
        [str(root / CONTROLLER), *words],
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == status
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert part in done.stderr


def ended_by(root: Path, end: signal.Signals, stderr: int) -> int:
    """The status of a controller that gets a signal when it has booted, in real time."""
    with LocalHub(virtual=False) as hub, LocalBus(hub.address.channel) as bus:
        words = [str(root / CONTROLLER), "--bus", hub.address.channel, "--verbose"]
        with subprocess.Popen(words, stderr=stderr) as controller:
            while (frame := bus.recv(HANGS_S)) is None or frame.arbitration_id != 0x701:
                assert frame is not None
            time.sleep(1.2)  # it has written the first notes: no drive answers
            controller.send_signal(end)
            return controller.wait(HANGS_S)


def test_messages_that_nobody_reads_do_not_end_it(root: Path) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    assert ended_by(root, signal.SIGTERM, writer) == 0
    os.close(writer)


def test_a_closed_terminal_ends_it_like_sigterm(root: Path) -> None:
    assert ended_by(root, signal.SIGHUP, subprocess.DEVNULL) == 0


def test_a_program_runs_to_its_end(machine: Machine, image: bytes) -> None:
    machine.prepare(image)
    program = machine.sdo[0x2000]
    ticks, end = program[9].raw, (program[14].raw, program[15].raw)
    assert program[1].open("rb", buffering=0).read() == image
    assert machine.command(START) == OFF_YET
    machine.start()
    assert machine.command(DISABLE) == MOVING
    with pytest.raises(canopen.SdoAbortedError):
        machine.upload(image)
    machine.until(READY)
    assert (machine.sdo[0x200D][1].raw, machine.sdo[0x200D][2].raw) == end
    assert all(abs(machine.sdo[0x200B][axis + 1].raw - end[axis]) <= 1 for axis in (0, 1))
    statistics = [machine.sdo[0x2008][sub].raw for sub in range(1, 8)]
    assert statistics[1] == ticks - 1
    assert statistics[2] == statistics[5] == statistics[6] == 0
    assert machine.command(START) == NOT_AT_START
    assert machine.command(DISABLE) == 0
    machine.until(OFF)


def test_a_refused_program_leaves_the_old_one(machine: Machine, image: bytes) -> None:
    machine.prepare(image)
    crc = machine.sdo[0x2000][5].raw
    broken = bytearray(image)
    broken[300] ^= 1
    with pytest.raises(canopen.SdoAbortedError) as refused:
        machine.upload(bytes(broken))
    assert refused.value.code == 0x06090030
    assert machine.sdo[0x2000][3].raw == -4
    assert machine.sdo[0x2000][5].raw == crc == struct.unpack_from("<I", image, 12)[0]
    assert machine.sdo[0x2000][2].raw == 2


@pytest.mark.parametrize(
    ("index", "low", "high"),
    [(0x2030, 50_000, 10**6), (0x2031, 10**5, 10**8), (0x2032, 1000, 10**7)],
)
def test_a_program_beyond_the_limits_of_an_axis_is_refused(
    machine: Machine, image: bytes, index: int, low: int, high: int
) -> None:
    """Whatever the host has planned it for: the controller has limits of its own, and proves them."""
    machine.prepare(image)
    crc = machine.sdo[0x2000][5].raw
    machine.command(DISABLE)
    machine.until(OFF)
    machine.sdo[index][2].raw = low
    with pytest.raises(canopen.SdoAbortedError) as refused:
        machine.upload(image)
    assert refused.value.code == 0x06090030
    assert machine.sdo[0x2000][3].raw == {0x2030: -70, 0x2031: -71, 0x2032: -72}[index]
    assert machine.sdo[0x2000][5].raw == crc
    machine.sdo[index][2].raw = high
    machine.upload(image)
    assert machine.sdo[0x2000][3].raw == 0


@pytest.mark.parametrize("after_s", [0.0, 0.0005, 0.1, 0.3, 0.8])
def test_a_lost_drive_is_a_fault_that_a_reset_clears(
    machine: Machine, image: bytes, after_s: float
) -> None:
    machine.prepare(image)
    machine.start()
    machine.clock.sleep(after_s)
    machine.drives[3].kill()
    assert machine.until(FAULT) < 0.21  # at standstill
    assert machine.fault() == [0x8250, 3, POSITIONS_MISSED]
    assert machine.command(ENABLE) == IN_FAULT
    begun_s = machine.clock.now_s()
    while machine.sdo[0x200A][1].raw & 0x6F != 0x40:  # the other one is switched off
        machine.clock.sleep(0.001)
    assert machine.commanded(RESET) <= {MOVING}
    assert machine.clock.now_s() - begun_s < 0.2
    machine.until(BOOT)
    machine.replace_drive(3)
    machine.until(OFF)
    assert machine.fault()[0] == 0


@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
@pytest.mark.parametrize("after_s", [0.0, 0.0005, 0.1, 0.3, 0.8])
def test_a_signal_stops_the_axes_and_ends(
    machine: Machine, image: bytes, end: signal.Signals, after_s: float
) -> None:
    machine.prepare(image)
    machine.start()
    machine.clock.sleep(after_s)
    controller = machine.controller
    begun_s = machine.clock.now_s()
    machine.clock.signal(controller.name, controller.child, end)
    assert machine.clock.await_end(controller.name, controller.child, 15.0) == 0
    assert machine.clock.now_s() - begun_s < 0.35
    assert controller.text() == ""
    drive: Any = machine.network.add_node(2, object_dictionary(DRIVE_EDS, 2)).sdo
    assert drive[0x6041].raw & 0x6F == 0x40  # Switch on disabled


@pytest.fixture(scope="module")
def optimal(root: Path) -> bytes:
    return encode(load_pipeline(root / "examples/alpha_optimal.toml").program)


@pytest.mark.parametrize("after_s", [0.003, 0.09, 0.2, 0.35, 0.456, 0.6, 0.73])
@pytest.mark.parametrize("again", [False, True])
def test_a_signal_stops_an_optimal_program(
    machine: Machine, optimal: bytes, after_s: float, again: bool
) -> None:
    machine.prepare(optimal)
    machine.start()
    machine.clock.sleep(after_s)
    controller = machine.controller
    begun_s = machine.clock.now_s()
    machine.clock.signal(controller.name, controller.child, signal.SIGTERM)
    if again:
        machine.clock.sleep(0.002)
        machine.clock.signal(controller.name, controller.child, signal.SIGTERM)
    assert machine.clock.await_end(controller.name, controller.child, 15.0) == 0
    assert machine.clock.now_s() - begun_s < 0.8
    for node in (2, 3):
        drive: Any = machine.network.add_node(node, object_dictionary(DRIVE_EDS, node)).sdo
        assert drive[0x6041].raw & 0x6F == 0x40  # Switch on disabled


def test_a_controller_without_configuration_pauses_its_heartbeats(machine: Machine) -> None:
    """For an I/O module that it does not know any more; drives that it configures meanwhile report no error."""
    machine.until(OFF)
    machine.clock.sleep(5.0)
    assert (machine.sdo[0x2002].raw, machine.fault()) == (OFF, [0, 0, 0])
    assert [machine.sdo[0x200C][axis].raw for axis in (1, 2)] == [0, 0]
