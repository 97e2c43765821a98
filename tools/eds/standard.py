# SPDX-License-Identifier: MIT
"""What CiA 301 and CiA 402 fix about the objects that our dictionaries may have: kind and data types. Used by
eds/check. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

from canopen.objectdictionary import ODArray, ODRecord, ODVariable
from canopen.objectdictionary.datatypes import (
    INTEGER8,
    INTEGER16,
    INTEGER32,
    UNSIGNED8,
    UNSIGNED16,
    UNSIGNED32,
    VISIBLE_STRING,
)

DYNAMIC_COUNTS = (0x1003, *range(0x1600, 0x1800), *range(0x1A00, 0x1C00))
"""Sub 0 of these counts what is in use, not what exists."""

KINDS = {ODVariable: "VAR", ODArray: "ARRAY", ODRecord: "RECORD"}


@dataclass(frozen=True)
class Shape:
    """Kind of an object; `types` are those of a VAR, of all elements of an ARRAY, of subs 1, 2, ... of a RECORD."""

    kind: str
    types: tuple[int, ...]


_VARIABLES = {
    INTEGER8: "6060 6061 6098",
    INTEGER16: "6007 605A 605B 605C 605D 605E 6071 6074 6077 6078 60B2",
    INTEGER32: "6062 6063 6064 606B 606C 607A 607C 60B0 60B1 60F4 60FC 60FF",
    UNSIGNED8: "1001 1019 607E",
    UNSIGNED16: "1015 1017 603F 6040 6041 6066 6068 6072 6073 60E0 60E1 6402",
    UNSIGNED32: "1000 1002 1005 1006 1007 1012 1014 6065 6067 6075 6076 6079 607F 6080 6081 6083 6084 6085 609A "
    "60C5 60C6 60FD 6502",
    VISIBLE_STRING: "1008 1009 100A 6403 6503 6505",
}
_ARRAYS = {
    INTEGER8: "60E3",
    INTEGER32: "607B 607D 6444",
    INTEGER16: "6411",
    UNSIGNED8: "1029 6200 6206 6207 6443",
    UNSIGNED32: "1003 1010 1011 1016 608F 6090 6091 6092 6099 60FE",
}
_PDO = (UNSIGNED32, UNSIGNED8, UNSIGNED16, UNSIGNED8, UNSIGNED16, UNSIGNED8)
_RECORDS = (
    (range(0x1018, 0x1019), (UNSIGNED32,) * 4),
    (range(0x1200, 0x1300), (UNSIGNED32, UNSIGNED32, UNSIGNED8)),
    (range(0x1400, 0x1600), _PDO),
    (range(0x1600, 0x1800), (UNSIGNED32,) * 64),
    (range(0x1800, 0x1A00), _PDO),
    (range(0x1A00, 0x1C00), (UNSIGNED32,) * 64),
    (range(0x60C2, 0x60C3), (UNSIGNED8, INTEGER8)),
)
_SHAPES = {
    int(index, 16): Shape(kind, (data_type,))
    for kind, table in (("VAR", _VARIABLES), ("ARRAY", _ARRAYS))
    for data_type, indices in table.items()
    for index in indices.split()
}


def shape_of(index: int) -> Shape | None:
    """The standard's shape of an object; None for one that the tables do not know."""
    for indices, types in _RECORDS:
        if index in indices:
            return Shape("RECORD", types)
    return _SHAPES.get(index)


def area_of(index: int) -> str:
    """The list of the EDS that an object belongs in."""
    if index in (0x1000, 0x1001, 0x1018):
        return "MandatoryObjects"
    return "ManufacturerObjects" if 0x2000 <= index < 0x6000 else "OptionalObjects"
