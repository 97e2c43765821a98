# SPDX-License-Identifier: MIT
"""`hodograph scan` and `hodograph check` with the simulated drives, and with devices of another stack (python canopen's
LocalNode) that are described by EDS files as vendors write them. Run by pytest; starts a controller and drives on a
local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import canopen
import durand
import durand.network
import pytest
from canopen_bench import let_pass

from bench import PAPER_ALPHA, MakeBench
from commands import result
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.processes import Process, drive_command, virtual_clock
from hodograph.bus.sdo.network import Network
from hodograph.cli.main import main
from hodograph.config import load_machine

U8, U16, U32, I32, TEXT = 0x05, 0x06, 0x07, 0x04, 0x09
Entry = tuple[int, str, str]
"""Data type, access, default value as in the file."""
Objects = Mapping[int, Entry | dict[int, Entry]]

COMMON: Objects = {
    0x1000: (U32, "ro", "0x00020192"),
    0x1001: (U8, "ro", "0"),
    0x1005: (U32, "rw", "0x80"),
    0x1006: (U32, "rw", "0"),
    0x1017: (U16, "rw", "0"),
    0x1016: {1: (U32, "rw", "0")},
    0x1400: {1: (U32, "rw", "$NODEID+0x200"), 2: (U8, "rw", "255")},
    0x1600: {1: (U32, "rw", "0x60400010"), 2: (U32, "rw", "0x607A0020")},
    0x1800: {1: (U32, "rw", "$NODEID+0x40000180"), 2: (U8, "rw", "255")},
    0x1A00: {1: (U32, "rw", "0x60410010"), 2: (U32, "rw", "0x60640020")},
    0x603F: (U16, "ro", "0"),
    0x6040: (U16, "wo", "0"),
    0x6041: (U16, "ro", "0x0250"),
    0x6060: (0x02, "rw", "0"),
    0x6061: (0x02, "ro", "0"),
    0x6064: (I32, "ro", "-1234"),
    0x607A: (I32, "rw", "0"),
    0x607D: {1: (I32, "rw", "-150000000"), 2: (I32, "rw", "150000000")},
    0x60C2: {1: (U8, "rw", "1"), 2: (0x02, "rw", "-3")},
}
SERVO: Objects = dict(COMMON) | {
    0x1008: (TEXT, "const", "ACME Servo 400"),
    0x1009: (TEXT, "const", "rev. C"),
    0x100A: (TEXT, "const", "2.17"),
    0x1018: {1: (U32, "ro", "0x29C"), 2: (U32, "ro", "0x402"), 3: (U32, "ro", "0x10003")},
    0x6502: (U32, "ro", "0x3AD"),
    0x6065: (U32, "rw", "20000"),
    0x6066: (U16, "rw", "10"),
    0x607F: (U32, "rw", "600000000"),
    0x6085: (U32, "rw", "3000000000"),
    0x605A: (0x03, "rw", "2"),
    0x6092: {1: (U32, "rw", "10000000"), 2: (U32, "rw", "1")},
    0x60FD: (U32, "ro", "0"),
}
STEPPER: Objects = dict(COMMON) | {
    0x1008: (TEXT, "const", "Beta stepper"),
    0x1018: {1: (U32, "ro", "0x111"), 2: (U32, "ro", "0x22")},
    0x6041: (U16, "ro", "0x0218"),
    0x603F: (U16, "ro", "0x3210"),
    0x6502: (U32, "ro", "0x25"),
}
"""Profile position, profile velocity and homing only; in fault."""
INPUTS: Objects = {
    0x1000: (U32, "ro", "0x000F0191"),
    0x1008: (TEXT, "const", "Remote I/O"),
    0x1018: {1: (U32, "ro", "0x333")},
}


def eds_text(objects: Objects) -> str:
    """An EDS file."""
    lines = ["[FileInfo]", "FileName=device.eds", "EDSVersion=4.0", "[DeviceInfo]", "Granularity=8"]
    lines += ["[OptionalObjects]", f"SupportedObjects={len(objects)}"]
    lines += [f"{number}=0x{index:04X}" for number, index in enumerate(objects, 1)]
    for index, entry in objects.items():
        if isinstance(entry, dict):
            lines += [f"[{index:04X}]", f"ParameterName=Object {index:04X}", "ObjectType=0x9"]
            lines += [f"SubNumber={len(entry) + 1}"]
            lines += variable(f"{index:04X}sub0", (U8, "rw", str(max(entry))))
            for sub, inner in entry.items():
                lines += variable(f"{index:04X}sub{sub:X}", inner)
        else:
            lines += variable(f"{index:04X}", entry)
    return "\n".join(lines) + "\n"


def variable(section: str, entry: Entry) -> list[str]:
    kind, access, value = entry
    return [
        f"[{section}]",
        f"ParameterName=Object {section}",
        "ObjectType=0x7",
        f"DataType=0x{kind:04X}",
        f"AccessType={access}",
        f"DefaultValue={value}",
        "PDOMapping=1",
    ]


class Devices:
    """Nodes of python canopen on a local bus, in a thread that takes part in its time."""

    def __init__(self, hub: LocalHub, folder: Path, nodes: Mapping[int, Objects]) -> None:
        self._channel, self._ended = hub.address.channel, threading.Event()
        self._ready = threading.Event()
        self._files: dict[int, Path] = {}
        for node, objects in nodes.items():
            self._files[node] = folder / f"node{node}.eds"
            self._files[node].write_text(eds_text(objects), encoding="utf-8")
        self._thread = threading.Thread(target=self._serve)

    def _serve(self) -> None:
        network = Network(LocalBus(self._channel))
        try:
            for node, file in self._files.items():
                network.add_node(canopen.LocalNode(node, str(file)))
            self._ready.set()
            while not self._ended.is_set():
                let_pass(network, 0.05)
        finally:
            network.disconnect()

    def __enter__(self) -> Devices:
        self._thread.start()
        assert self._ready.wait(60)
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()


@contextmanager
def simulated_drives(hub: LocalHub) -> Iterator[None]:
    """Those of the paper's machine, without a controller."""
    clock = virtual_clock(hub.address)
    process = Process("drives", drive_command(load_machine(PAPER_ALPHA), hub.address), clock)
    try:
        assert clock is not None
        clock.sleep(0.5)
        yield
    finally:
        process.end()
        clock.release()


# -- the simulated drives --------------------------------------------------------------------------------


def test_simulated_drives_are_found_and_able(
    hub: LocalHub, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "machine.toml"
    with simulated_drives(hub):
        found = result(capsys, "scan", "--json", "-o", str(file))
        nodes = {one["node"]: one for one in found["nodes"]}
        assert nodes.keys() == {2, 3}
        assert nodes[2]["is_drive"]
        assert nodes[2]["modes"] == [6, 8]
        assert nodes[2]["product"] == 2
        assert found["file"] == str(file)
        for machine in (str(file), str(PAPER_ALPHA)):
            checked = result(capsys, "check", machine, "--json")
            assert checked["able"]
            assert [axis["node"] for axis in checked["axes"]] == [2, 3]
            assert len(checked["axes"][0]["objects"]) > 30
        assert main(["scan", "-o", str(file)]) == 2
        assert "add --force" in capsys.readouterr().err


def test_a_file_that_is_there_is_refused_before_numbers_are_given(
    hub: LocalHub, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "machine.toml"
    file.touch()
    heard = LocalBus(hub.address.channel)
    assert main(["scan", "-o", str(file), "--assign", "5"]) == 2
    assert "add --force" in capsys.readouterr().err
    assert heard.recv(0) is None
    heard.shutdown()


def test_text_for_people(hub: LocalHub, capsys: pytest.CaptureFixture[str]) -> None:
    with simulated_drives(hub):
        assert main(["scan"]) == 0
        out = capsys.readouterr().out
        assert "node 2: drive, Hodograph simulated drive" in out
        assert "modes: homing, cyclic synchronous position" in out
        assert main(["check", str(PAPER_ALPHA)]) == 0
        short = capsys.readouterr().out
        assert main(["check", str(PAPER_ALPHA), "--all"]) == 0
        whole = capsys.readouterr().out
        assert "axis y, node 3: " in short
        assert "0x60C2" not in short
        assert "0x60C2 sub 1" in whole


def test_another_machine_is_recognized(hub: LocalHub, capsys: pytest.CaptureFixture[str]) -> None:
    file = str(PAPER_ALPHA.parent / "real_drives.toml")
    with simulated_drives(hub):
        assert main(["check", file]) == 4
        out, err = capsys.readouterr()
        assert "axes x, z cannot do what the machine needs" in err
        assert "vendor is 0x00000000, the machine file has 0x0000029C" in out
        assert "node 4 does not answer" in out


def test_nothing_is_written(hub: LocalHub, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither command sends a request to write, or anything but SDO."""
    heard = LocalBus(hub.address.channel)
    with simulated_drives(hub):
        assert main(["scan", "-q"]) == 0
        assert main(["check", str(PAPER_ALPHA)]) == 0
        frames = []
        while (frame := heard.recv(0)) is not None:
            frames.append(frame)
    heard.shutdown()
    requests = [one for one in frames if 0x600 < one.arbitration_id <= 0x67F]
    assert len(requests) > 150
    assert {one.data[0] >> 5 for one in requests} <= {2, 3}  # upload: initiate, segment
    others = {
        one.arbitration_id
        for one in frames
        if one.arbitration_id & 0x780 not in (0x600, 0x580, 0x700)
    }
    assert others == {0x7E5}
    assert {one.data[0] for one in frames if one.arbitration_id == 0x7E5} == {0x04, 0x51}


def test_a_running_controller_is_left_alone(
    make_bench: MakeBench, clock: VirtualClock, capsys: pytest.CaptureFixture[str]
) -> None:
    make_bench()
    for words in (["scan"], ["check", str(PAPER_ALPHA)]):
        assert main(words) == 4
        assert "a controller sends SYNC" in capsys.readouterr().err


def test_an_empty_bus(hub: LocalHub, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scan"]) == 4
    assert "no node answers in 0.5 s" in capsys.readouterr().err
    assert main(["check", str(PAPER_ALPHA)]) == 4
    assert "node 2 does not answer" in capsys.readouterr().out


# -- devices of another stack ------------------------------------------------------------------------------


@pytest.fixture
def devices(hub: LocalHub, tmp_path: Path) -> Iterator[Devices]:
    with Devices(hub, tmp_path, {2: SERVO, 9: STEPPER, 127: INPUTS}) as served:
        yield served


def test_devices_are_found(devices: Devices, capsys: pytest.CaptureFixture[str]) -> None:
    found: list[dict[str, Any]] = result(capsys, "scan", "--json")["nodes"]
    servo, stepper, inputs = found
    assert [one["node"] for one in found] == [2, 9, 127]
    assert [one["is_drive"] for one in found] == [True, True, False]
    assert (servo["name"], servo["hardware"], servo["software"]) == (
        "ACME Servo 400",
        "rev. C",
        "2.17",
    )
    assert (servo["vendor"], servo["product"], servo["revision"]) == (0x29C, 0x402, 0x10003)
    assert servo["serial"] is None
    assert servo["modes"] == [1, 3, 4, 6, 8, 9, 10]
    assert (servo["limit_min_counts"], servo["limit_max_counts"]) == (-150_000_000, 150_000_000)
    assert (servo["feed_counts"], servo["position_counts"]) == (10_000_000, -1234)
    assert stepper["modes"] == [1, 3, 6]
    assert stepper["error_code"] == 0x3210
    assert inputs["name"] == "Remote I/O"


def test_the_file_for_them_can_be_read(
    devices: Devices, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "machine.toml"
    assert main(["scan", "-o", str(file)]) == 0
    text = file.read_text(encoding="utf-8")
    assert "# Node 2: ACME Servo 400, hardware rev. C, software 2.17" in text
    assert "Hodograph cannot use this drive" in text
    machine = load_machine(file)
    assert machine.nodes == (2, 9)
    assert machine.axes[0].travel_max_mm == 150.0
    assert machine.axes[0].identity.revision == 0x10003
    assert main(["check", str(file)]) == 4
    out, err = capsys.readouterr()
    assert "axis y cannot do what the machine needs: 0x6502" in err
    assert "axis x, node 2: " in out
    assert "\n  fault" not in out.split("axis y")[0]
    assert "the drive is in fault (error code 0x3210)" in out


def test_a_servo_by_its_own_limits(
    devices: Devices, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its greatest velocity is 600 mm/s at nm counts; what it lacks is named with what to do."""
    text = (PAPER_ALPHA.parent / "real_drives.toml").read_text(encoding="utf-8")
    head, axes = text.split("[[axis]]", 1)
    one = axes.split("[[axis]]")[0]
    file = tmp_path / "machine.toml"
    head = head.replace('path = ["x", "y"]', "")
    file.write_text(f"{head}[[axis]]{one}".replace("period_us = 2000", "period_us = 4000"))
    checked = _check(capsys, file)
    verdicts = {(o["index"], o["sub"]): o["verdict"] for o in checked["axes"][0]["objects"]}
    assert verdicts[0x607F, 0] == "ok"
    assert verdicts[0x6098, 0] == "fault"
    assert verdicts[0x608F, 1] == "fault"
    assert verdicts[0x6092, 1] == "ok"
    assert verdicts[0x60B2, 0] == "note"
    assert verdicts[0x1029, 1] == "note"
    file.write_text(file.read_text().replace("velocity_mm_s = 500  ", "velocity_mm_s = 601  "))
    checked = _check(capsys, file)
    limited = [o for o in checked["axes"][0]["objects"] if o["index"] == 0x607F]
    assert limited[0]["verdict"] == "fault"
    assert "limits velocity to 600 mm" in limited[0]["text"]


# -- nodes without number: LSS, with devices of durand ---------------------------------------------------

SERVO_ID = (0x29C, 0x402, 0x10003, 0x80000001)
OTHER_ID = (0x29C, 0x402, 0x10003, 0x80000002)
THIRD_ID = (0x29C, 0x403, 0, 0xFFFFFFFF)
NO_NUMBER = 0xFF


class DurandNetwork(durand.network.NetworkABC):
    """What a node of durand sends and receives by, on a local bus.

    conforming  a node that Fastscan has found takes part no more, as CiA 305 says; durand's go on
    """

    def __init__(self, network: Network, conforming: bool) -> None:
        self._network, self._conforming = network, conforming
        self._is_found, self._sent = False, 0
        self._heard: dict[int, Callable[[int, bytearray, float], None]] = {}

    def add_subscription(self, cob_id: int, callback: Callable[[int, bytes], None]) -> None:
        def heard(cob: int, data: bytearray, time_s: float) -> None:
            is_fastscan = cob == 0x7E5 and data[0] == 0x51
            if is_fastscan and self._is_found and self._conforming:
                return
            sent = self._sent
            callback(cob, bytes(data))
            if cob == 0x7E5:
                answered_last = is_fastscan and self._sent > sent and data[7] < data[6]
                self._is_found = answered_last or (is_fastscan and self._is_found)

        self._heard[cob_id] = heard
        self._network.subscribe(cob_id, heard)

    def remove_subscription(self, cob_id: int) -> None:
        self._network.unsubscribe(cob_id, self._heard.pop(cob_id))

    def send(self, cob_id: int, msg: bytes) -> None:
        self._sent += 1
        self._network.send_message(cob_id, msg)


class DurandDevices(Devices):
    """Drives of durand, each with its node number and its identity."""

    def __init__(
        self,
        hub: LocalHub,
        nodes: Sequence[tuple[int, tuple[int, ...]]],
        *,
        conforming: bool = True,
        stores: bool = False,
    ) -> None:
        super().__init__(hub, Path(), {})
        self._nodes, self._conforming, self._stores = nodes, conforming, stores
        self.stored: list[int] = []

    def _serve(self) -> None:
        network = Network(LocalBus(self._channel))
        try:
            for number, identity in self._nodes:
                self._add(network, number, identity)
            self._ready.set()
            while not self._ended.is_set():
                let_pass(network, 0.05)
        finally:
            network.disconnect()

    def _add(self, network: Network, number: int, identity: tuple[int, ...]) -> None:
        node = durand.MinimalNode(DurandNetwork(network, self._conforming), number)
        node.object_dictionary.write(0x1000, 0, 0x20192)
        for sub, value in enumerate(identity, 1):
            node.object_dictionary.write(0x1018, sub, value)
        if self._stores:
            node.lss.set_store_configuration_callback(lambda rate, node: self.stored.append(node))


def as_json(identity: tuple[int, ...], assigned: int | None = None) -> dict[str, int | None]:
    names = ("vendor", "product", "revision", "serial")
    return dict(zip(names, identity, strict=True)) | {"assigned": assigned}


def test_nodes_without_number_are_found_and_left_alone(
    hub: LocalHub, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes = [(NO_NUMBER, OTHER_ID), (5, THIRD_ID), (NO_NUMBER, SERVO_ID)]
    with DurandDevices(hub, nodes):
        for _ in range(2):
            found = result(capsys, "scan", "--json")
            assert [one["node"] for one in found["nodes"]] == [5]
            assert found["unconfigured"] == [as_json(SERVO_ID), as_json(OTHER_ID)]
        assert result(capsys, "scan", "--no-lss", "--json")["unconfigured"] == []
        assert main(["scan"]) == 0
        assert "serial 0x80000002: no node number" in capsys.readouterr().out


def test_a_node_that_hides_others_is_reported(
    hub: LocalHub, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes = [(NO_NUMBER, OTHER_ID), (NO_NUMBER, SERVO_ID)]
    with DurandDevices(hub, nodes, conforming=False):
        assert main(["scan", "--json"]) == 0
        out, err = capsys.readouterr()
        assert json.loads(out)["unconfigured"] == [as_json(SERVO_ID)]
        assert "answers twice, and may hide nodes" in err
        first = result(capsys, "scan", "--json", "--assign", "0x80000001=7")
        assert first["unconfigured"] == [as_json(SERVO_ID, 7)]
        second = result(capsys, "scan", "--json", "--assign", "8")
        assert second["unconfigured"] == [as_json(OTHER_ID, 8)]
        assert [one["node"] for one in second["nodes"]] == [7, 8]


def test_numbers_are_given_and_stored_only_when_asked(
    hub: LocalHub, capsys: pytest.CaptureFixture[str]
) -> None:
    with DurandDevices(hub, [(NO_NUMBER, OTHER_ID), (NO_NUMBER, SERVO_ID)], stores=True) as devices:
        words = ["--assign", "2147483650=9", "--assign", "0x80000001=10", "--store"]
        found = result(capsys, "scan", "--json", *words)
        assert found["unconfigured"] == [as_json(SERVO_ID, 10), as_json(OTHER_ID, 9)]
        by_node = {one["node"]: one["serial"] for one in found["nodes"]}
        assert by_node == {9: OTHER_ID[3], 10: SERVO_ID[3]}
        assert devices.stored == [9, 10]
        assert result(capsys, "scan", "--json")["unconfigured"] == []


def exit_status(*words: str) -> int | str | None:
    try:
        return main(list(words))
    except SystemExit as ended:  # of argparse
        return ended.code


@pytest.mark.parametrize(
    ("words", "status", "text"),
    [
        (["--assign", "7"], 2, "2 unconfigured nodes: give SERIAL=NODE"),
        (["--assign", "3=7"], 2, "no unconfigured node with serial number 0x00000003"),
        (["--assign", "0x80000001=5"], 2, "node number 5 is taken"),
        (["--assign", "0x80000001=7", "--assign", "0x80000001=8"], 2, "two numbers for"),
        (["--assign", "0x80000001=7", "--store"], 4, "is node 7 now, but cannot store that"),
        (["--assign", "7", "--no-lss"], 2, "leave --no-lss out"),
        (["--store"], 2, "add --assign"),
        (["--assign", "128"], 2, "no node number from 1 to 127"),
    ],
)
def test_what_cannot_be_assigned(
    words: list[str], status: int, text: str, hub: LocalHub, capsys: pytest.CaptureFixture[str]
) -> None:
    nodes = [(NO_NUMBER, OTHER_ID), (5, THIRD_ID), (NO_NUMBER, SERVO_ID)]
    with DurandDevices(hub, nodes):
        assert exit_status("scan", *words) == status
        assert text in capsys.readouterr().err


def test_a_number_is_not_given_where_it_would_reach_two(
    hub: LocalHub, capsys: pytest.CaptureFixture[str]
) -> None:
    """LSS selects a node by its identity, whether it has a number or not."""
    with DurandDevices(hub, [(5, SERVO_ID), (NO_NUMBER, SERVO_ID)]):
        assert main(["scan", "--assign", "7"]) == 2
        assert "node 5 has the same identity" in capsys.readouterr().err


def test_two_nodes_of_one_identity(hub: LocalHub, capsys: pytest.CaptureFixture[str]) -> None:
    """They cannot be distinguished: both answer every bit alike."""
    with DurandDevices(hub, [(NO_NUMBER, SERVO_ID), (NO_NUMBER, SERVO_ID)]):
        assert result(capsys, "scan", "--json")["unconfigured"] == [as_json(SERVO_ID)]


def _check(capsys: pytest.CaptureFixture[str], file: Path) -> dict[str, Any]:
    capsys.readouterr()
    assert main(["check", str(file), "--json"]) == 4
    found: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert not found["able"]
    return found
