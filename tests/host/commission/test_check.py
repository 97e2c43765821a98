# SPDX-License-Identifier: MIT
"""`hodograph check` reads the objects that the controller writes, and `hodograph scan` writes files that can be read.
Run by pytest; writes to temporary folders.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import canopen
import pytest

from hodograph.commission import DriveProperties, Finding, check_axis, machine_text
from hodograph.commission.check import FAULT, NOTE, OK
from hodograph.commission.drive_properties import read_properties, supported_modes
from hodograph.commission.nodes import found_nodes
from hodograph.config import load_machine
from hodograph.config.machine_file import Machine

ROOT = Path(__file__).resolve().parents[3]
MACHINE = load_machine(ROOT / "examples/machines/real_drives.toml")
X = MACHINE.axes[0]
"""Has every key of an axis."""
SOURCE = (ROOT / "firmware/app/drives/drive_configuration.c").read_text(encoding="utf-8")
TABLE = SOURCE[: SOURCE.index("module_rows[] =")]
"""Without the rows of an I/O module."""
ROW = re.compile(r"\{WHEN_(\w+), ROW_(\w+), (0x[0-9A-F]{4}), (\d+), (\d+),")
Place = tuple[int, int]


class Fake:
    """A node with these objects."""

    def __init__(self, objects: dict[Place, int | bytes]) -> None:
        self.node = 2
        self.objects = objects

    def data(self, index: int, sub: int = 0) -> bytes | None:
        value = self.objects.get((index, sub))
        if isinstance(value, int):
            return (value & 0xFFFFFFFF).to_bytes(4, "little")
        return value

    def number(self, index: int, sub: int = 0, *, signed: bool = False) -> int | None:
        data = self.data(index, sub)
        return int.from_bytes(data, "little", signed=signed) if data else None

    def text(self, index: int) -> str | None:
        data = self.data(index)
        return None if data is None else data.decode()


def rows() -> list[tuple[str, str, Place]]:
    """When, kind and place of the rows of the controller's table that name an object."""
    found = [
        (when, kind, (int(index, 16), int(sub))) for when, kind, index, sub, _ in ROW.findall(TABLE)
    ]
    assert len(found) > 40
    return found


def complete() -> dict[Place, int | bytes]:
    """A drive with every object that the controller knows of, as the machine file wants it."""
    objects: dict[Place, int | bytes] = {place: 1 for _, _, place in rows()}
    for index in (0x1400, 0x1401, 0x1800):
        objects |= {(index, 1): 0x200, (index, 2): 1, (index + 0x200, 0): 2}
    objects |= {(index, 0): 0 for index in (0x6040, 0x607A, 0x60B1, 0x60B2, 0x6041, 0x60FD)}
    objects[0x1400, 5] = 0
    identity = X.identity
    objects |= {(0x1018, 1): identity.vendor, (0x1018, 2): identity.product}
    return objects | {
        (0x1018, 3): identity.revision,
        (0x1000, 0): 0x20192,
        (0x6502, 0): 0xA0,
        (0x6041, 0): 0x250,
        (0x6064, 0): 0,
    }


def check(objects: dict[Place, int | bytes], machine: Machine = MACHINE) -> list[Finding]:
    return check_axis(Fake(objects), machine.axes[0], machine)  # type: ignore[arg-type]


def at(findings: list[Finding], place: Place) -> list[str]:
    """Verdicts about an object."""
    return [one.verdict for one in findings if (one.index, one.sub) == place]


def test_a_complete_drive_is_able() -> None:
    assert [one for one in check(complete()) if one.verdict != OK] == []


MUST = sorted({place for _, kind, place in rows() if kind in ("MUST", "EXPECT", "NEED_BITS")})
MAPPED = {(0x6040, 0), (0x6064, 0)}
"""Read or tried before, but needed in the PDOs."""
MAY = sorted(
    {place for _, kind, place in rows() if kind in ("MAY", "TRY", "LEARN")} - set(MUST) - MAPPED
)


@pytest.mark.parametrize("place", MUST, ids=lambda place: f"{place[0]:04X}.{place[1]}")
def test_what_the_controller_must_have_is_a_fault(place: Place) -> None:
    objects = complete()
    del objects[place]
    assert FAULT in at(check(objects), place)


@pytest.mark.parametrize("place", MAY, ids=lambda place: f"{place[0]:04X}.{place[1]}")
def test_what_the_controller_may_do_without_is_none(place: Place) -> None:
    objects = complete()
    del objects[place]
    assert [one for one in check(objects) if one.verdict == FAULT] == []


def test_a_drive_without_event_timer_stops_late() -> None:
    """Then only the loss of SYNC or heartbeat stops it, after other times than setpoint_timeout_ms."""
    objects = complete()
    del objects[0x1400, 5]
    (found,) = [one for one in check(objects) if one.verdict != OK]
    assert (found.index, found.sub, found.verdict) == (0x1400, 5, NOTE)
    assert "stops late" in found.text


@pytest.mark.parametrize("index", [0x1400, 0x1600, 0x1800, 0x1A00, 0x6040, 0x607A, 0x6041, 0x6064])
def test_process_data_is_needed(index: int) -> None:
    objects = {place: value for place, value in complete().items() if place[0] != index}
    assert any(one.index == index and one.verdict == FAULT for one in check(objects))


def test_an_object_that_exists_but_is_not_listed_exists() -> None:
    """Some drives do not let 0x6040 be read."""
    findings = check(complete() | {(0x6040, 0): b""})
    assert at(findings, (0x6040, 0)) == [OK]


@pytest.mark.parametrize(
    ("changed", "place", "verdict", "text"),
    [
        ({(0x1000, 0): 0x191}, (0x1000, 0), FAULT, "no drive"),
        ({(0x6502, 0): 0x20}, (0x6502, 0), FAULT, "cyclic synchronous position"),
        ({(0x6502, 0): 0x80}, (0x6502, 0), FAULT, "no mode homing"),
        ({(0x1018, 2): 5}, (0x1018, 2), FAULT, "0x00000005"),
        ({(0x607F, 0): 1000}, (0x607F, 0), FAULT, "0.001 mm/s, less than the machine file's 500"),
        ({(0x607F, 0): 2_000_000_000}, (0x607F, 0), OK, "limit of velocity"),
        ({(0x60C5, 0): 1000}, (0x60C5, 0), FAULT, "acceleration"),
        ({(0x60E3, 0): 2, (0x60E3, 1): 35, (0x60E3, 2): 37}, (0x60E3, 0), FAULT, "35, 37, not 17"),
        ({(0x60E3, 0): 1, (0x60E3, 1): 17}, (0x60E3, 0), OK, "method 17"),
        ({(0x6041, 0): 0x218, (0x603F, 0): 0x8611}, (0x6041, 0), NOTE, "0x8611"),
    ],
)
def test_values_that_do_not_fit(
    changed: dict[Place, int | bytes], place: Place, verdict: str, text: str
) -> None:
    found = [one for one in check(complete() | changed) if (one.index, one.sub) == place]
    assert any(one.verdict == verdict and text in one.text for one in found), found


def test_scaling_is_compared_with_the_drive_file() -> None:
    """A screw of 9.990 mm a turn."""
    machine = load_machine(ROOT / "examples/machines/paper_alpha.toml")
    for feed, gear, verdict, text in (
        (9_990_265, 1, OK, "as in the drive file"),
        (19_980_530, 2, OK, "a turn of the motor, with its gear of 2 to 1 (0x6091), is 9.99"),
        (9_990_265, 2, NOTE, "is 4.99513 mm by counts_per_mm, but 9.99026 in the drive file"),
        (5_000_000, 1, NOTE, "is 5 mm by counts_per_mm, but 9.99026 in the drive file"),
    ):
        drive: dict[Place, int | bytes] = {
            (0x6092, 1): feed,
            (0x6092, 2): 1,
            (0x6091, 1): gear,
            (0x6091, 2): 1,
        }
        findings = check(complete() | drive, machine)
        scaling = [one for one in findings if one.index == 0x6092]
        assert [(one.verdict, text in one.text) for one in scaling] == [(verdict, True)]


def test_supported_modes() -> None:
    assert supported_modes(0xA0) == (6, 8)
    assert supported_modes(0) == ()


# -- machine files -------------------------------------------------------------------------------------

SERVO = DriveProperties(
    node=5,
    device_type=0x20192,
    name="Servo \u00b5 1",
    vendor=0x29C,
    product=0x402,
    revision=0,
    modes=(1, 6, 8),
    feed_counts=10_000.0,
    limit_min_counts=-150_000_000,
    limit_max_counts=150_000_001,
)


@pytest.mark.parametrize(
    ("drives", "travel"),
    [
        ([SERVO], (-150.0, 150.000001)),
        ([SERVO, replace(SERVO, node=1)], (-150.0, 150.000001)),
        ([replace(SERVO, limit_min_counts=0, limit_max_counts=0)], (-10.0, 10.0)),
        ([replace(SERVO, limit_min_counts=-(2**31), limit_max_counts=2**31 - 1)], (-10.0, 10.0)),
        ([replace(SERVO, node=n) for n in range(1, 8)], (-150.0, 150.000001)),
        ([DriveProperties(7, 0x192)], (-10.0, 10.0)),
        ([replace(SERVO, name='a "name"\\ with # signs')], (-150.0, 150.000001)),
    ],
)
def test_files_can_be_read(
    drives: list[DriveProperties], travel: tuple[float, float], tmp_path: Path
) -> None:
    file = tmp_path / "machine.toml"
    file.write_text(machine_text(drives, 500_000, "socketcan:can0"), encoding="utf-8")
    machine = load_machine(file)
    assert machine.bitrate == 500_000
    assert [axis.node for axis in machine.axes] == [drive.node for drive in drives[:6]]
    assert machine.node not in machine.nodes
    assert (machine.axes[0].travel_min_mm, machine.axes[0].travel_max_mm) == travel
    assert machine.axes[0].identity.vendor == (drives[0].vendor or 0)


def test_the_controller_gets_no_number_of_another_node() -> None:
    """Also not that of an I/O module, which is no axis."""
    text = machine_text([replace(SERVO, node=2)], 500_000, "a bus", [1, 3])
    assert tomllib.loads(text)["controller"]["node"] == 4


class Bus(canopen.Network):
    """Node 2 answers; node 9 sends only heartbeats and an emergency."""

    clock = SimpleNamespace(is_virtual=False, sleep=lambda seconds: None)

    def send_message(self, can_id: int, data: bytes, remote: bool = False) -> None:
        if can_id == 0x602:
            answer = bytearray((0x43, 0, 0x10, 0, 0x92, 1, 2, 0))
            self.notify(0x582, answer, 0.0)
        if can_id == 0x609:
            self.notify(0x709, bytearray((5,)), 0.0)
            self.notify(0x089, bytearray(8), 0.0)


def test_nodes_that_only_send_are_not_found() -> None:
    """A scan of all nodes failed when it read one of them."""
    bus: Any = Bus()
    assert found_nodes(bus, 0.1) == [2]


def test_files_say_what_is_missing() -> None:
    text = machine_text([replace(SERVO, modes=(1,))], 1_000_000, "a bus")
    assert "cannot use this drive" in text
    assert "method" not in text
    assert "10000 divided by the lead of the screw in mm" in text
    assert tomllib.loads(text)


def test_properties_of_a_node_that_is_no_drive() -> None:
    properties = read_properties(Fake({(0x1000, 0): 0x191, (0x1018, 1): 9}))  # type: ignore[arg-type]
    assert not properties.is_drive
    assert (properties.vendor, properties.modes, properties.name) == (9, (), None)


@pytest.mark.parametrize("status", [0x0218, 0x021F])
def test_a_fault_is_noted_also_during_its_reaction(status: int) -> None:
    found = check(complete() | {(0x6041, 0): status})
    last = [one for one in found if one.index == 0x6041][-1]
    assert (last.verdict, last.text[:21]) == (NOTE, "the drive is in fault")


@pytest.mark.parametrize(("index", "unit"), [(0x607F, "mm/s,"), (0x60C5, "mm/s^2,")])
def test_limits_have_their_units(index: int, unit: str) -> None:
    found = check(complete() | {(index, 0): 1000})
    text = next(one.text for one in found if one.index == index)
    assert f" to {1000 / X.counts_per_unit:g} {unit}" in text
