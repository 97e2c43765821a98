# SPDX-License-Identifier: MIT
"""The EDS files as python canopen reads them, against docs/reference/protocol.md. Run by pytest; starts and writes
nothing.
"""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable, datatypes

ROOT = Path(__file__).resolve().parents[3]
PDO_OFF = 1 << 31
CONTROLLER = ROOT / "firmware" / "app" / "controller.eds"
DRIVE = ROOT / "sim" / "node" / "drive.eds"
U8, U16, U32, U64 = (
    datatypes.UNSIGNED8,
    datatypes.UNSIGNED16,
    datatypes.UNSIGNED32,
    datatypes.UNSIGNED64,
)
I8, I16, I32, I64 = (
    datatypes.INTEGER8,
    datatypes.INTEGER16,
    datatypes.INTEGER32,
    datatypes.INTEGER64,
)


def variable(od: canopen.ObjectDictionary, index: int, sub: int | None) -> ODVariable:
    found = od[index] if sub is None else od[index][sub]
    assert isinstance(found, ODVariable)
    return found


@pytest.mark.parametrize("path", [CONTROLLER, DRIVE], ids=lambda path: path.stem)
@pytest.mark.parametrize("node", [1, 5, 127])
def test_loads_and_depends_on_the_node_id(path: Path, node: int) -> None:
    od = canopen.import_od(str(path), node)
    assert variable(od, 0x1200, 1).default == 0x600 + node
    assert variable(od, 0x1200, 2).default == 0x580 + node
    assert variable(od, 0x1014, None).default == 0x80 + node


@pytest.mark.parametrize("path", [CONTROLLER, DRIVE], ids=lambda path: path.stem)
def test_counts_of_records_and_arrays(path: Path) -> None:
    od = canopen.import_od(str(path), 1)
    for index in od:
        entry = od[index]
        if isinstance(entry, ODVariable):
            continue
        subs = sorted(entry)
        assert subs[0] == 0, hex(index)
        if 0x1600 <= index < 0x1800 or 0x1A00 <= index < 0x1C00:
            mapped = [sub for sub in subs[1:] if entry[sub].default]
            assert mapped == list(range(1, entry[0].default + 1)), hex(index)
            continue
        dynamic = index == 0x1003
        assert entry[0].default == (0 if dynamic else subs[-1]), hex(index)


CONTROLLER_OBJECTS = [
    (0x2000, 1, datatypes.DOMAIN, "rw"),
    (0x2000, 2, U8, "ro"),
    (0x2000, 3, I16, "ro"),
    (0x2000, 4, U32, "ro"),
    (0x2000, 5, U32, "ro"),
    (0x2000, 6, U32, "ro"),
    (0x2000, 9, U32, "ro"),
    (0x2000, 10, U64, "ro"),
    (0x2000, 11, I64, "ro"),
    (0x2000, 12, I32, "ro"),
    (0x2000, 15, I32, "ro"),
    (0x2001, None, U8, "wo"),
    (0x2002, None, U8, "ro"),
    (0x2003, 1, U16, "ro"),
    (0x2003, 3, U32, "ro"),
    (0x2003, 4, U8, "ro"),
    (0x2004, 1, U8, "rw"),
    (0x2004, 2, U32, "rw"),
    (0x2004, 5, U8, "rw"),
    (0x2004, 7, U32, "rw"),
    (0x2005, 6, U8, "rw"),
    (0x2006, 6, I32, "rw"),
    (0x2007, 6, I32, "rw"),
    (0x2008, 7, U32, "ro"),
    (0x2009, 1, I64, "ro"),
    (0x2009, 2, I32, "ro"),
    (0x2009, 3, U64, "ro"),
    (0x200A, 6, U16, "ro"),
    (0x200B, 6, I32, "ro"),
    (0x200C, 6, U16, "ro"),
    (0x200D, 6, I32, "ro"),
    (0x2004, 11, U8, "rw"),
    (0x2013, 6, I32, "rw"),
    (0x2017, 1, U8, "ro"),
    (0x201C, 6, I32, "ro"),
    (0x2025, 4, U32, "ro"),
    (0x2026, 6, U8, "ro"),
    (0x2030, 6, U32, "rw"),
    (0x2034, 6, U8, "rw"),
    (0x2032, 1, U32, "rw"),
    (0x1006, None, U32, "rw"),
    (0x1019, None, U8, "const"),
]


@pytest.mark.parametrize(("index", "sub", "data_type", "access"), CONTROLLER_OBJECTS)
def test_controller_objects(index: int, sub: int | None, data_type: int, access: str) -> None:
    found = variable(canopen.import_od(str(CONTROLLER), 1), index, sub)
    assert (found.data_type, found.access_type) == (data_type, access)


DRIVE_OBJECTS = [
    (0x603F, None, U16, "ro"),
    (0x6040, None, U16, "rw"),
    (0x6041, None, U16, "ro"),
    (0x605A, None, I16, "rw"),
    (0x605E, None, I16, "rw"),
    (0x6060, None, I8, "rw"),
    (0x6061, None, I8, "ro"),
    (0x6064, None, I32, "ro"),
    (0x6065, None, U32, "rw"),
    (0x6066, None, U16, "rw"),
    (0x607A, None, I32, "rw"),
    (0x607D, 1, I32, "rw"),
    (0x607D, 2, I32, "rw"),
    (0x6085, None, U32, "rw"),
    (0x608F, 1, U32, "rw"),
    (0x6091, 2, U32, "rw"),
    (0x6092, 1, U32, "rw"),
    (0x60B1, None, I32, "rw"),
    (0x60B2, None, I16, "rw"),
    (0x60C2, 1, U8, "rw"),
    (0x60C2, 2, I8, "rw"),
    (0x60F4, None, I32, "ro"),
    (0x6502, None, U32, "const"),
    (0x2100, None, I16, "ro"),
]


@pytest.mark.parametrize(("index", "sub", "data_type", "access"), DRIVE_OBJECTS)
def test_drive_objects(index: int, sub: int | None, data_type: int, access: str) -> None:
    found = variable(canopen.import_od(str(DRIVE), 2), index, sub)
    assert (found.data_type, found.access_type) == (data_type, access)


def mapping(od: canopen.ObjectDictionary, index: int) -> list[tuple[int, int, int]]:
    count = od[index][0].default
    words = [od[index][i].default for i in range(1, count + 1)]
    return [(word >> 16, word >> 8 & 0xFF, word & 0xFF) for word in words]


def test_pdos_of_the_drive() -> None:
    od = canopen.import_od(str(DRIVE), 3)
    assert od[0x1400][1].default == 0x203
    assert od[0x1800][1].default == 0x183
    assert od[0x1801][1].default == 0x283
    assert mapping(od, 0x1600) == [(0x6040, 0, 16), (0x607A, 0, 32)]
    assert mapping(od, 0x1A00) == [(0x6041, 0, 16), (0x6064, 0, 32)]
    assert mapping(od, 0x1A01) == [(0x2100, 0, 16)]


def test_pdos_of_the_controller_mirror_those_of_the_drives() -> None:
    """Those of two axes, the default, are on; RPDO2 of the drives is on with velocity feedforward only."""
    od = canopen.import_od(str(CONTROLLER), 1)
    for axis in range(6):
        off = PDO_OFF if axis >= 2 else 0
        assert od[0x1400 + axis][1].default == off | 0x180 + axis + 2
        assert od[0x1800 + axis][1].default == off | 0x200 + axis + 2
        assert od[0x1806 + axis][1].default == PDO_OFF | 0x300 + axis + 2
        assert mapping(od, 0x1600 + axis) == [(0x200A, axis + 1, 16), (0x200B, axis + 1, 32)]
        assert mapping(od, 0x1A00 + axis) == [(0x200E, axis + 1, 16), (0x200D, axis + 1, 32)]


@pytest.mark.parametrize("path", [CONTROLLER, DRIVE], ids=lambda path: path.stem)
def test_whatever_is_mapped_is_mappable_and_of_that_length(path: Path) -> None:
    od = canopen.import_od(str(path), 1)
    mapped = [
        entry
        for i in od
        if 0x1600 <= i < 0x1C00 and not 0x1800 <= i < 0x1A00
        for entry in mapping(od, i)
    ]
    assert mapped
    for index, sub, bits in mapped:
        found = variable(od, index, sub if not isinstance(od[index], ODVariable) else None)
        assert found.pdo_mappable, hex(index)
        assert len(found) == bits, hex(index)
