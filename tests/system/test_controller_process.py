# SPDX-License-Identifier: MIT
"""hodograph-controller as a process, with simulated drives: command line, a whole run, a lost drive, its end."""

from __future__ import annotations

import signal
import struct
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import canopen
import pytest

CONTROLLER = "build/bin/hodograph-controller"
DRIVE = "build/bin/hodograph-drive"
FIGURES = (
    "gain_rad_s_v=83.0089,time_constant_s=0.19936,screw_mm_rad=1.59,torque_to_volts=1.39664804469,"
    "volts_limit=5,k_pp_rad_s_mm=97.38,k_pv_nm_s_rad=1.19,k_iv_per_s=252.8,k_pf_rad_mm=0.8,k_vf=0.85"
)
BOOT, OFF, READY, RUNNING, FAULT = 0, 1, 3, 4, 6
ENABLE, START, STOP, DISABLE, RESET = 1, 2, 3, 4, 5
NOT_NOW = 0x08000022
# A Python process that reads all process data starves the rest of a small machine.
FILTERS = [{"can_id": 0x580, "can_mask": 0x780}, {"can_id": 0x700, "can_mask": 0x780}]


class Machine:
    """Two drives, each a process, and a controller at full pace."""

    def __init__(self, root: Path) -> None:
        self.root = root
        self.drives = {node: self._drive(node) for node in (2, 3)}
        words = [str(root / CONTROLLER), "--bus", "vcan0", "--pace", "fast"]
        self.controller = subprocess.Popen(words, stderr=subprocess.PIPE, text=True)
        self.network = canopen.Network()
        self.network.connect(interface="socketcan", channel="vcan0", can_filters=FILTERS)
        node: Any = self.network.add_node(1, str(root / "firmware/app/controller.eds"))
        node.nmt.wait_for_heartbeat(timeout=20)
        self.sdo = node.sdo
        self.sdo.RESPONSE_TIMEOUT = 5.0

    def _drive(self, node: int) -> subprocess.Popen[bytes]:
        words = [str(self.root / DRIVE), "--bus", "vcan0", "--axis", f"node={node},{FIGURES}"]
        return subprocess.Popen(words, stderr=subprocess.DEVNULL)

    def replace_drive(self, node: int) -> None:
        self.drives[node] = self._drive(node)

    def until(self, state: int, limit_s: float = 20.0) -> None:
        end = time.monotonic() + limit_s
        while (now := self.sdo[0x2002].raw) != state:
            assert time.monotonic() < end, f"state {now}, fault {self.fault()}"
            time.sleep(0.01)

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
        self.until(OFF)
        self.upload(image)

    def start(self) -> None:
        assert self.command(ENABLE) == 0
        self.until(READY)
        end = time.monotonic() + 20
        while (refusal := self.command(START)) != 0:
            assert refusal == 3  # has not stood still for long enough
            assert time.monotonic() < end
            time.sleep(0.02)

    def close(self) -> None:
        self.network.disconnect()
        for process in (self.controller, *self.drives.values()):
            process.kill()
            process.communicate()


@pytest.fixture
def machine(root: Path) -> Iterator[Machine]:
    machine = Machine(root)
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
        [str(root / CONTROLLER), *words], capture_output=True, text=True, timeout=20, check=False
    )
    assert done.returncode == status
    assert done.stdout == ""
    assert done.stderr.count("\n") == 1
    assert part in done.stderr


@pytest.mark.bus
def test_an_interface_that_is_no_can_bus_is_refused(root: Path) -> None:
    words = [str(root / CONTROLLER), "--bus", "lo"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=20, check=False)
    assert done.returncode == 4
    assert "not a CAN interface" in done.stderr


@pytest.mark.bus
def test_a_program_runs_to_its_end(machine: Machine, image: bytes) -> None:
    machine.prepare(image)
    program = machine.sdo[0x2000]
    ticks, end = program[9].raw, (program[14].raw, program[15].raw)
    assert program[1].open("rb", buffering=0).read() == image
    assert machine.command(START) == 4  # drives are off
    machine.start()
    assert machine.command(DISABLE) == 3  # moving
    with pytest.raises(canopen.SdoAbortedError):
        machine.upload(image)
    machine.until(READY)
    assert (machine.sdo[0x200D][1].raw, machine.sdo[0x200D][2].raw) == end
    assert abs(machine.sdo[0x200B][2].raw - end[1]) < 100
    statistics = [machine.sdo[0x2008][sub].raw for sub in range(1, 8)]
    assert statistics[1] == ticks - 1
    assert statistics[2] == statistics[5] == statistics[6] == 0
    assert machine.command(START) in (2, 3)  # away from the start, or not yet still
    assert machine.command(DISABLE) == 0
    machine.until(OFF)


@pytest.mark.bus
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


@pytest.mark.bus
def test_a_lost_drive_is_a_fault_that_a_reset_clears(machine: Machine, image: bytes) -> None:
    machine.prepare(image)
    machine.start()
    machine.drives[3].kill()
    machine.drives[3].wait()
    machine.until(FAULT)
    assert machine.fault()[:2] == [0x8250, 3]
    assert machine.command(ENABLE) == 5
    end = time.monotonic() + 20
    while machine.sdo[0x200A][1].raw & 0x6F != 0x40:  # the other one is switched off
        assert time.monotonic() < end
    assert machine.command(RESET) == 0
    machine.until(BOOT)
    machine.replace_drive(3)
    machine.until(OFF)
    assert machine.fault()[0] == 0


@pytest.mark.bus
@pytest.mark.parametrize("end", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_stops_the_axes_and_ends(
    machine: Machine, image: bytes, end: signal.Signals
) -> None:
    machine.prepare(image)
    machine.start()
    machine.controller.send_signal(end)
    assert machine.controller.wait(timeout=15) == 0
    time.sleep(0.2)
    drive: Any = machine.network.add_node(2, str(machine.root / "sim/node/drive.eds")).sdo
    drive.RESPONSE_TIMEOUT = 5.0
    assert drive[0x6041].raw & 0x6F == 0x40  # Switch on disabled
    assert machine.controller.stderr is not None
    assert machine.controller.stderr.read() == ""
