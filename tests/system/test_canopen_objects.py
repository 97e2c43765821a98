# SPDX-License-Identifier: MIT
"""Each object of both EDS files on the bus: type, access, default, limits; and objects that do not exist. Run by
pytest; starts controllers and drives, each on a local bus.
"""

from __future__ import annotations

import random
from collections.abc import Iterator

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes
from canopen_bench import (
    NO_OBJECT,
    NO_SUB,
    READ_ONLY,
    STATE,
    TOO_HIGH,
    TOO_LONG,
    TOO_LOW,
    TOO_SHORT,
    VALUE,
    WRITE_ONLY,
    abort_code,
    controller_node,
    drive_node,
    let_pass,
    name_of,
    variables,
)

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub

MEASURED = {
    # state, what it waits for at boot, statistics, memory, CRC, stream
    "controller": {0x2002, 0x2003, 0x2008, 0x2025, 0x2041, 0x2050, 0x2060},
    "drive": {0x6041, 0x6062, 0x6063, 0x6064, 0x607A, 0x60FD, 0x2101},
}
"""Objects whose value depends on what happens."""
OF_THE_AXIS = {(0x1006, 0), (0x1018, 4), (0x6075, 0), (0x6076, 0), (0x608F, 1), (0x6092, 1)}
"""Defaults that follow from the figures on the drive's command line."""
PDO_OBJECTS = range(0x1400, 0x1C00)
"""Their rules depend on one another: test_canopen_pdo.py."""
NOT_ALL_VALUES = {
    "controller": {
        *((0x2058, sub) for sub in (*range(1, 6), 7)),  # only at standstill with the drives on
        (0x1003, 0),  # takes 0 only
        (0x1010, 1),  # signatures: test_power_on.py
        (0x1011, 1),
        (0x2050, 2),  # takes the CRC-32 of the configuration only
    },
    "drive": {
        (0x1003, 0),
        (0x1019, 0),  # only while 0x1006 is 0
        (0x6060, 0),  # takes the modes that there are
        (0x608F, 1),  # the encoder's own
        (0x608F, 2),
        (0x6091, 1),  # scales that the axis can have
        (0x6091, 2),
        (0x6092, 1),
        (0x6092, 2),
        (0x6098, 0),  # the methods that there are
        (0x60C2, 1),  # both together must give a period that the drive can keep
        (0x60C2, 2),
    },
}


@pytest.fixture(params=["controller", "drive"])
def kind(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def node(kind: str, hub: LocalHub, clock: VirtualClock) -> Iterator[canopen.RemoteNode]:
    """A device just switched on."""
    with drive_node(hub) if kind == "drive" else controller_node(hub) as made:
        yield made


def numbers(node: canopen.RemoteNode) -> Iterator[ODVariable]:
    for variable in variables(node.object_dictionary):
        if variable.data_type in datatypes.INTEGER_TYPES:
            yield variable


def test_reads_back_with_type_access_and_default(kind: str, node: canopen.RemoteNode) -> None:
    checked = 0
    for variable in variables(node.object_dictionary):
        name = name_of(variable)
        if variable.data_type == datatypes.DOMAIN:
            continue
        if not variable.readable:
            code = abort_code(lambda v=variable: node.sdo.upload(v.index, v.subindex))
            assert code == WRITE_ONLY, name
            continue
        raw = node.sdo.upload(variable.index, variable.subindex)
        if variable.data_type == datatypes.VISIBLE_STRING:
            assert raw.decode("ascii") == variable.default, name
        else:
            assert len(raw) * 8 == len(variable), name
            key = (variable.index, variable.subindex)
            if variable.index not in MEASURED[kind] and not (
                kind == "drive" and key in OF_THE_AXIS
            ):
                assert variable.decode_raw(raw) == variable.default, name
        checked += 1
    assert checked > 200


def test_what_is_read_only_refuses_to_be_written(node: canopen.RemoteNode) -> None:
    checked = 0
    for variable in variables(node.object_dictionary):
        if variable.writable:
            continue
        raw = node.sdo.upload(variable.index, variable.subindex)
        code = abort_code(lambda v=variable, r=raw: node.sdo.download(v.index, v.subindex, r))
        assert code == READ_ONLY, name_of(variable)
        checked += 1
    assert checked > 60


def test_wrong_lengths_are_refused(node: canopen.RemoteNode) -> None:
    for variable in numbers(node):
        if not variable.writable:
            continue
        size = len(variable) // 8
        for wrong, code in ((size + 1, TOO_LONG), (size - 1, TOO_SHORT), (16, TOO_LONG)):
            if wrong == 0:
                continue
            found = abort_code(
                lambda v=variable, n=wrong: node.sdo.download(v.index, v.subindex, bytes(n))
            )
            assert found == code, f"{name_of(variable)} with {wrong} bytes"


def test_limits_hold(kind: str, node: canopen.RemoteNode) -> None:
    """Values at the limits are taken and read back, those beyond are refused, and then nothing has changed."""
    checked = 0
    for variable in numbers(node):
        if not variable.writable or variable.index in PDO_OBJECTS:
            continue
        name, size = name_of(variable), len(variable) // 8
        signed = variable.data_type in datatypes.SIGNED_TYPES
        least = -(1 << (size * 8 - 1)) if signed else 0
        most = (1 << (size * 8 - signed)) - 1
        low = least if variable.min is None else variable.min
        high = most if variable.max is None else variable.max

        def write(value: int, v: ODVariable = variable) -> int:
            return abort_code(lambda: node.sdo.download(v.index, v.subindex, v.encode_raw(value)))

        before = node.sdo.upload(variable.index, variable.subindex) if variable.readable else b""
        if low > least:
            assert write(low - 1) == TOO_LOW, name
        if high < most:
            assert write(high + 1) == TOO_HIGH, name
        if variable.readable:
            assert node.sdo.upload(variable.index, variable.subindex) == before, name
        if not variable.readable or (variable.index, variable.subindex) in NOT_ALL_VALUES[kind]:
            continue
        for value in (low, high, variable.default):
            assert write(value) == 0, f"{name} = {value}"
            raw = node.sdo.upload(variable.index, variable.subindex)
            assert variable.decode_raw(raw) == value, name
            checked += 1
    assert checked > 60


def test_commands_beyond_the_limits_are_refused(kind: str, node: canopen.RemoteNode) -> None:
    if kind == "drive":
        assert abort_code(lambda: node.sdo.download(0x6060, 0, b"\x01")) == VALUE
        assert abort_code(lambda: node.sdo.download(0x1003, 0, b"\x01")) == VALUE
        return
    for command, code in ((0, TOO_LOW), (200, TOO_HIGH), (2, STATE)):
        assert abort_code(lambda c=command: node.sdo.download(0x2001, 0, bytes([c]))) == code


def test_what_is_not_there(node: canopen.RemoteNode) -> None:
    od = node.object_dictionary
    picked = random.Random(301)
    absent = [picked.randrange(0x10000) for _ in range(150)]
    absent += [index + 1 for index in od] + [0x0000, 0x0001, 0x0FFF, 0xFFFF]
    for index in sorted(set(absent) - set(od)):
        assert abort_code(lambda i=index: node.sdo.upload(i, 0)) == NO_OBJECT, hex(index)
        assert abort_code(lambda i=index: node.sdo.download(i, 0, b"\0")) == NO_OBJECT, hex(index)
    for index, entry in od.items():
        subs = {0} if isinstance(entry, ODVariable) else set(entry)
        for sub in sorted({max(subs) + 1, 255} | (set(range(max(subs))) - subs)):
            where = f"0x{index:04X} sub {sub}"
            assert abort_code(lambda i=index, s=sub: node.sdo.upload(i, s)) == NO_SUB, where
            assert abort_code(lambda i=index, s=sub: node.sdo.download(i, s, b"\0")) == NO_SUB


def test_a_reset_brings_the_defaults_back(kind: str, node: canopen.RemoteNode) -> None:
    """Reset node: all; reset communication: objects below 0x2000."""
    changed = {"controller": ((0x1017, 0), (0x2004, 6)), "drive": ((0x1017, 0), (0x6085, 0))}[kind]
    beats: list[int] = []
    node.nmt.add_heartbeat_callback(beats.append)
    before = {key: node.sdo.upload(*key) for key in changed}
    for command, restored in (
        ("RESET COMMUNICATION", {0x1017}),
        ("RESET", {0x1017, changed[1][0]}),
    ):
        for key in changed:
            node.sdo.download(*key, (150).to_bytes(len(before[key]), "little"))
        beats.clear()
        node.nmt.state = command
        let_pass(node.network, 0.1)
        assert beats.count(0) == 1
        for key in changed:
            kept = (150).to_bytes(len(before[key]), "little")
            wanted = before[key] if key[0] in restored else kept
            assert node.sdo.upload(*key) == wanted, f"0x{key[0]:04X} after {command}"
