# SPDX-License-Identifier: MIT
"""A faulty or hostile node on the bus: after any of its frames the machine reports its true state, and needs no restart
to recover. Run by pytest; starts a controller, drives and `hodograph` on a local bus.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator

import pytest
from canopen_bench import BUSY, Hand, hand, object_bytes
from other_node import (
    PRE_OPERATIONAL,
    RESET_NODE,
    STOP,
    OtherNode,
    flood,
    other_node,
    runs_again,
    settled,
)

from bench import EXAMPLES, Bench, MakeAlpha, MakeBench
from commands import running
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.capture.setpoint_check import find_jumps, step_limits
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.sdo import node
from hodograph.bus.sdo.channel_lock import Turns
from hodograph.bus.sdo.controller import BOOT, FAULT_STATE, HELD, OFF, READY, RUNNING
from hodograph.bus.sdo.objects import COMMAND, FAULT, HOLD, QUICK_STOP
from hodograph.bus.sdo.objects import STOP as STOP_COMMAND
from hodograph.cli.main import main
from hodograph.pipeline import load_pipeline
from marks import long

DRIVE = 2
AWAY = 0xFF08
LOST = 0x8250
NO_SYNC = 0x8700
OFF_BIT = 0x80000000
COMMANDS = {"stop": STOP_COMMAND, "hold": HOLD, "quick-stop": QUICK_STOP}
LEADS_TO = {"stop": READY, "hold": HELD, "quick-stop": OFF}


@pytest.fixture
def other(hub: LocalHub, clock: VirtualClock) -> Iterator[OtherNode]:
    with other_node(hub) as made:
        yield made


Moving = Callable[..., tuple[Bench, str]]


@pytest.fixture
def moving(make_bench: MakeBench, alpha_at: MakeAlpha) -> Iterator[Moving]:
    """A machine so many seconds into a program of 2.6, or of 100 mm at another feed; in the end no setpoint may have
    jumped.
    """
    recorders: list[tuple[Bench, Recorder]] = []

    def begin(seconds: float, feed_mm_s: float = 40.0) -> tuple[Bench, str]:
        bench, path = make_bench(), str(alpha_at(feed_mm_s))
        recorders.append((bench, Recorder(bench.bus)))
        assert main(["goto", path]) == 0
        assert main(["start"]) == 0
        bench.clock.sleep(seconds)
        assert bench.controller.state() == RUNNING
        return bench, path

    yield begin
    for bench, recorder in recorders:
        frames = recorder.so_far()
        recorder.stop()
        assert find_jumps(frames, bench.machine.nodes, step_limits(bench.machine)) == []


@pytest.mark.parametrize("seconds", [long(0.05), 2.0, long(2.4)])
def test_setpoints_switched_off_at_a_drive(
    moving: Moving, other: OtherNode, seconds: float
) -> None:
    """0x1400 sub 1: it receives no setpoints any more, reports nothing, and stands still."""
    bench, path = moving(seconds)
    other.write(DRIVE, 0x1400, 1, OFF_BIT | 0x202, 4)
    assert settled(bench) == (FAULT_STATE, AWAY, DRIVE)
    assert bench.controller.read(FAULT, 3) > 5000
    runs_again(path)


def test_setpoints_from_another_node(
    make_bench: MakeBench, alpha_at: MakeAlpha, other: OtherNode
) -> None:
    """Some millimetres away, in between those of the controller, for 0.1 s: the recording shows them as jumps."""
    bench, path = make_bench(), str(alpha_at(20))
    recorder = Recorder(bench.bus)
    assert main(["goto", path]) == 0
    assert main(["start"]) == 0
    bench.clock.sleep(1.0005)
    for _ in range(100):
        other.send(0x200 + DRIVE, struct.pack("<Hi", 0x0F, 5_000_000))
        bench.clock.sleep(0.001)
    assert settled(bench) == (FAULT_STATE, AWAY, DRIVE)
    assert find_jumps(recorder.so_far(), bench.machine.nodes, step_limits(bench.machine))
    recorder.stop()
    runs_again(path)


def test_setpoints_switched_off_at_a_drive_that_stands(
    make_bench: MakeBench, alpha_at: MakeAlpha, other: OtherNode
) -> None:
    """What is wrong shows in the next motion; and `reset` finds it without one."""
    bench, path = make_bench(), str(alpha_at(50))
    assert main(["goto", path]) == 0
    other.write(DRIVE, 0x1400, 1, OFF_BIT | 0x202, 4)
    assert main(["reset"]) == 0
    assert bench.controller.state() == OFF
    assert main(["goto", path]) == 0
    assert main(["start", "--follow"]) == 0


@pytest.mark.parametrize("seconds", [long(0.05), 2.0, long(2.4)])
def test_a_drive_stopped_by_nmt(moving: Moving, other: OtherNode, seconds: float) -> None:
    """STOPPED, it answers no SDO: it is made pre-operational before it is asked anything."""
    bench, path = moving(seconds)
    other.nmt(STOP, DRIVE)
    state, code, _ = settled(bench)
    assert (state, code) == (FAULT_STATE, LOST)
    runs_again(path)


@pytest.mark.parametrize("node", [0, DRIVE])
@pytest.mark.parametrize("command", [PRE_OPERATIONAL, RESET_NODE, long(0x82)])
def test_nmt_to_drives_in_motion(moving: Moving, other: OtherNode, command: int, node: int) -> None:
    bench, path = moving(2.0)
    other.nmt(command, node)
    assert settled(bench)[0] == FAULT_STATE
    runs_again(path)


def remap(other: OtherNode, communication: int, entries: tuple[int, ...], cob: int) -> None:
    """A PDO with another mapping, as CiA 301 prescribes it."""
    mapping = communication + 0x200
    other.write(DRIVE, communication, 1, OFF_BIT | cob, 4)
    other.write(DRIVE, mapping, 0, 0, 1)
    for sub, entry in enumerate(entries, start=1):
        other.write(DRIVE, mapping, sub, entry, 4)
    other.write(DRIVE, mapping, 0, len(entries), 1)
    other.write(DRIVE, communication, 1, cob, 4)


STATUSWORD, POSITION, MODE, INPUTS = 0x60410010, 0x60640020, 0x60610008, 0x60FD0020
CONTROLWORD, TARGET = 0x60400010, 0x607A0020


@pytest.mark.parametrize(
    "entries", [(POSITION, STATUSWORD), (INPUTS, STATUSWORD), (STATUSWORD, INPUTS), (STATUSWORD,)]
)
def test_tpdo1_mapped_otherwise(moving: Moving, other: OtherNode, entries: tuple[int, ...]) -> None:
    """What comes under its identifier is no statusword any more, or no position; the reset writes the mapping anew."""
    bench, path = moving(2.0)
    remap(other, 0x1800, entries, 0x40000180 + DRIVE)
    assert settled(bench)[0] == FAULT_STATE
    runs_again(path)


def test_rpdo1_with_its_objects_swapped(moving: Moving, other: OtherNode) -> None:
    """Target and controlword change places: what the drive takes for a controlword is half a position."""
    bench, path = moving(2.0)
    remap(other, 0x1400, (TARGET, CONTROLWORD), 0x200 + DRIVE)
    assert settled(bench)[0] == FAULT_STATE
    runs_again(path)


def test_tpdo1_switched_off(moving: Moving, other: OtherNode) -> None:
    bench, path = moving(2.0)
    other.write(DRIVE, 0x1800, 1, OFF_BIT | 0x40000180 + DRIVE, 4)
    assert settled(bench) == (FAULT_STATE, LOST, DRIVE)
    runs_again(path)


@pytest.mark.parametrize(
    ("kind", "outcome"),
    [
        (1, (READY, 0)),
        *(long(kind, (FAULT_STATE, LOST)) for kind in (0, 2, 10, 254, 255)),
        (240, (FAULT_STATE, LOST)),
    ],
)
def test_transmission_types_of_tpdo1(
    moving: Moving, other: OtherNode, kind: int, outcome: tuple[int, int]
) -> None:
    """1 is the type that it has: an answer to every SYNC. With any other type the drive is lost."""
    bench, path = moving(2.0)
    other.write(DRIVE, 0x1800, 1, OFF_BIT | 0x40000180 + DRIVE, 4)
    other.write(DRIVE, 0x1800, 2, kind, 1)
    other.write(DRIVE, 0x1800, 1, 0x40000180 + DRIVE, 4)
    assert settled(bench)[:2] == outcome
    runs_again(path)


@pytest.mark.parametrize("period_ms", [0, 1001, 65535])
def test_the_controllers_heartbeat_cannot_be_switched_off(
    moving: Moving, other: OtherNode, period_ms: int
) -> None:
    """The drives watch it: they stop by themselves when it stays away for two seconds."""
    bench, _ = moving(1.0, 20.0)  # for four seconds more
    other.write(1, 0x1017, 0, period_ms, 2)
    bench.clock.sleep(0.1)
    assert bench.controller.read(0x1017) == 100
    assert settled(bench) == (READY, 0, 0)


def test_another_heartbeat_with_the_number_of_a_drive(moving: Moving, other: OtherNode) -> None:
    """Two that say they are node 2: a boot-up message of one is a restart."""
    bench, path = moving(1.0, 25.0)
    for _ in range(20):
        other.send(0x700 + DRIVE, b"\x05")
        bench.clock.sleep(0.05)
    assert bench.controller.state() == RUNNING
    other.send(0x700 + DRIVE, b"\x00")
    assert settled(bench)[:2] == (FAULT_STATE, 0xFF03)
    runs_again(path)


def test_another_heartbeat_with_the_number_of_the_controller(
    moving: Moving, other: OtherNode
) -> None:
    bench, path = moving(1.0)
    for state in (0x00, 0x04, 0x7F, 0x05):
        other.send(0x701, bytes([state]))
        bench.clock.sleep(0.05)
    assert settled(bench) == (READY, 0, 0)
    runs_again(path)


def asked_by_hand(other: Hand, request: bytes) -> int:
    """The abort code of the answer that names this object; 0: it is no abort."""
    other.send(request)
    while (answer := other.answer())[1:4] != request[1:4]:
        pass
    return int.from_bytes(answer[4:8], "little") if answer[0] == 0x80 else 0


def test_answers_to_another_client_and_frames_that_are_no_answers(
    moving: Moving, other: OtherNode
) -> None:
    """What the controller refuses another computer is no refusal of ours, and an SDO has eight bytes."""
    bench, path = moving(1.0)
    for index, sub, value in ((0x2004, 1, 1), (0x1010, 1, 0x65766173), (0x1011, 1, 0x64616F6C)):
        other.write(1, index, sub, value, 4)
        assert bench.controller.state() == RUNNING
    for length in range(8):
        other.send(0x581, bytes([0x80] * length))
        assert bench.controller.state() == RUNNING
    for identifier in (0x202, 0x182, 0x602, 0x582, 0x601, 0x702, 0x082, 0x000):
        other.send(identifier, b"")
    assert bench.controller.state() == RUNNING
    assert settled(bench) == (READY, 0, 0)
    runs_again(path)


def test_a_second_client_beside_an_upload(make_bench: MakeBench, hub: LocalHub) -> None:
    """Another computer, which knows nothing of the turns taken on this one, asks in the middle of a block download: it
    is refused each time, the upload goes on and is whole.
    """
    bench, image = make_bench(), load_pipeline(EXAMPLES / "alpha.toml").image
    refused: list[int] = []
    requests = (
        b"\x40" + object_bytes(0x2002, 0),
        b"\x2f" + object_bytes(0x2001, 0) + b"\x02",
        b"\xc6" + object_bytes(0x2000, 1) + b"\0\1",
    )
    with hand(hub, 1) as second_client:

        def progress(sent: int) -> None:
            if sent % 700 < 7 and (sent // 7) % 127 + 1 not in (0x40, 0x2F, 0x46):
                refused.extend(asked_by_hand(second_client, request) for request in requests)
                second_client.send(b"\x80" + object_bytes(0x2002, 0) + b"\0\0\4\5")

        bench.controller.upload(image, progress)
    assert len(refused) >= 12
    assert set(refused) == {BUSY}
    assert bench.controller.program_crc() == int.from_bytes(image[12:16], "little")


def test_a_command_beside_another_computers_upload(
    make_bench: MakeBench,
    hub: LocalHub,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It is patient for a while, then says who is in the way; a client that is gone is forgotten."""
    bench = make_bench()
    with hand(hub, 1) as second_client:
        assert second_client.ask(b"\x20" + object_bytes(0x2000, 1))[0] == 0x60
        began_s = bench.clock.now_s()
        assert bench.controller.state() in (BOOT, OFF)
        assert 1.5 < bench.clock.now_s() - began_s < 2.5  # the server's time-out
        monkeypatch.setattr(node, "BUSY_S", 1.0)
        assert second_client.ask(b"\x20" + object_bytes(0x2000, 1))[0] == 0x60
        assert main(["status"]) == 4
        assert "another SDO client" in capsys.readouterr().err


@pytest.mark.parametrize("command", ["stop", "hold", "quick-stop"])
def test_a_command_to_stop_beside_another_computers_transfer(
    moving: Moving, hub: LocalHub, command: str
) -> None:
    """The program is being read from elsewhere, slowly: that is no reason to wait, and the transfer goes on."""
    bench, _ = moving(1.0)
    program = object_bytes(0x2000, 1)
    with hand(hub, 1) as second_client:
        assert second_client.ask(b"\x40" + program)[0] == 0x41
        begun_s = bench.clock.now_s()
        bench.controller.write_at_once(COMMAND, COMMANDS[command])
        assert bench.clock.now_s() - begun_s < 0.001
        taken = second_client.answer()  # of the command: it names another object
        assert taken == b"\x60" + object_bytes(COMMAND, 0) + bytes(4)
        assert second_client.ask(b"\x60")[0] == 0x00
        assert second_client.ask(b"\x70")[0] == 0x10
        second_client.send(b"\x80" + program + b"\0\0\4\5")
    bench.controller.wait_for((LEADS_TO[command],), 2.0)


@pytest.mark.parametrize("command", ["stop", "hold", "quick-stop"])
def test_a_command_to_stop_beside_one_that_ctrl_z_has_stopped(
    moving: Moving, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    bench, _ = moving(1.0)
    turns = Turns(bench.bus, bench.machine.node, bench.clock)

    with turns.turn():
        begun_s = bench.clock.now_s()
        assert main([command]) == 4
        taken_s = bench.clock.now_s() - begun_s
    turns.close()

    assert taken_s < 5.0
    assert (
        "has taken the command, but whether the axes stand is not known" in capsys.readouterr().err
    )
    assert bench.controller.state() == LEADS_TO[command]


@pytest.mark.parametrize("command", ["stop", "hold", "quick-stop"])
def test_the_commands_to_stop_while_another_computer_goes_on_reading(
    moving: Moving, hub: LocalHub, command: str
) -> None:
    """For seven seconds. Whether the axes stand cannot be asked meanwhile, but they do."""
    bench, _ = moving(1.0, 10.0)  # for nine seconds more
    with hand(hub, 1) as second_client, running(bench.clock, command) as process:
        assert second_client.ask(b"\x40" + object_bytes(0x2000, 1))[0] == 0x41
        for k in range(900):  # of 943 segments
            second_client.send(b"\x70" if k % 2 else b"\x60")
            bench.clock.sleep(0.008)
            if process.child.poll() is not None:
                break
        second_client.send(b"\x80" + object_bytes(0x2000, 1) + b"\0\0\4\5")
        assert (process.wait(), process.err) == (0, "")
    assert bench.controller.state() == LEADS_TO[command]


@pytest.mark.parametrize("identifier", [long(0x7FF), 0x6FF])
def test_a_bus_that_is_full_of_what_matters_less(
    moving: Moving, other: OtherNode, identifier: int
) -> None:
    """All that matters has right of way: the program runs to its end at a load of 100 %."""
    bench, path = moving(1.0)
    flood(other, identifier, 0.15)
    bench.clock.sleep(0.15)
    assert settled(bench) == (READY, 0, 0)
    runs_again(path)


@pytest.mark.parametrize("seconds", [long(0.0005), 0.002, long(0.05)])
def test_a_bus_that_is_full_of_what_matters_more(
    moving: Moving, other: OtherNode, seconds: float
) -> None:
    """Nothing else gets through: setpoints wait, and answers. Simulated drives wait too."""
    bench, path = moving(1.0)
    flood(other, 0x001, seconds)
    bench.clock.sleep(seconds)
    assert settled(bench) == (READY, 0, 0)
    runs_again(path)


@pytest.mark.parametrize("phase_us", [0, long(250), long(500), long(750)])
def test_simulated_drives_wait_from_any_instant_on(
    moving: Moving, other: OtherNode, phase_us: int
) -> None:
    """Whether or not the drives have answered the SYNC whose setpoints wait."""
    bench, path = moving(1.0)
    bench.clock.sleep(phase_us * 1e-6)
    flood(other, 0x001, 0.05)
    bench.clock.sleep(0.05)
    assert settled(bench) == (READY, 0, 0)
    runs_again(path)


@pytest.mark.parametrize(
    ("seconds", "outcome"), [(0.15, (READY, 0)), (0.25, (FAULT_STATE, NO_SYNC))]
)
def test_a_bus_that_is_full_for_longer_than_simulated_drives_are_waited_for(
    make_bench: MakeBench,
    alpha_at: MakeAlpha,
    other: OtherNode,
    seconds: float,
    outcome: tuple[int, int],
) -> None:
    """After 100 ms a tick comes, and sends no SYNC before the setpoints that still wait. After 200 ms the drives stop
    by themselves.
    """
    bench, path = make_bench(), str(alpha_at(40))
    recorder = Recorder(bench.bus)
    assert main(["goto", path]) == 0
    assert main(["start"]) == 0
    bench.clock.sleep(1.0)
    flood(other, 0x001, seconds)
    bench.clock.sleep(seconds)
    assert settled(bench)[:2] == outcome
    found = find_jumps(recorder.so_far(), bench.machine.nodes, step_limits(bench.machine))
    recorder.stop()
    assert found == []
    runs_again(path)
