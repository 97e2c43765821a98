# SPDX-License-Identifier: MIT
"""What CiA 301 and CiA 402 fix about the objects that our dictionaries may have: kind and data types."""

from __future__ import annotations

from dataclasses import dataclass

from eds_model import ARRAY, RECORD, VAR, VISIBLE_STRING

BOOL, I8, I16, I32, U8, U16, U32 = 0x01, 0x02, 0x03, 0x04, 0x05, 0x06, 0x07
I64, U64 = 0x15, 0x1B

DYNAMIC_COUNTS = (0x1003, *range(0x1600, 0x1800), *range(0x1A00, 0x1C00))
"""Sub 0 of these counts what is in use, not what exists."""


@dataclass(frozen=True)
class Shape:
    """Kind of an object; `types` are those of a VAR, of all elements of an ARRAY, of subs 1, 2, ... of a RECORD."""

    kind: int
    types: tuple[int, ...]


def _var(data_type: int) -> Shape:
    return Shape(VAR, (data_type,))


def _array(data_type: int) -> Shape:
    return Shape(ARRAY, (data_type,))


_PDO = Shape(RECORD, (U32, U8, U16, U8, U16, U8))
_MAPPING = Shape(RECORD, (U32,) * 64)
_SDO = Shape(RECORD, (U32, U32, U8))

_COMMUNICATION = {
    0x1000: _var(U32),
    0x1001: _var(U8),
    0x1002: _var(U32),
    0x1003: _array(U32),
    0x1005: _var(U32),
    0x1006: _var(U32),
    0x1007: _var(U32),
    0x1008: _var(VISIBLE_STRING),
    0x1009: _var(VISIBLE_STRING),
    0x100A: _var(VISIBLE_STRING),
    0x1010: _array(U32),
    0x1011: _array(U32),
    0x1012: _var(U32),
    0x1014: _var(U32),
    0x1015: _var(U16),
    0x1016: _array(U32),
    0x1017: _var(U16),
    0x1018: Shape(RECORD, (U32,) * 4),
    0x1019: _var(U8),
    0x1029: _array(U8),
}

_DRIVE = {
    0x6007: _var(I16),
    0x603F: _var(U16),
    0x6040: _var(U16),
    0x6041: _var(U16),
    0x605A: _var(I16),
    0x605B: _var(I16),
    0x605C: _var(I16),
    0x605D: _var(I16),
    0x605E: _var(I16),
    0x6060: _var(I8),
    0x6061: _var(I8),
    0x6062: _var(I32),
    0x6063: _var(I32),
    0x6064: _var(I32),
    0x6065: _var(U32),
    0x6066: _var(U16),
    0x6067: _var(U32),
    0x6068: _var(U16),
    0x606B: _var(I32),
    0x606C: _var(I32),
    0x6071: _var(I16),
    0x6072: _var(U16),
    0x6073: _var(U16),
    0x6074: _var(I16),
    0x6075: _var(U32),
    0x6076: _var(U32),
    0x6077: _var(I16),
    0x6078: _var(I16),
    0x6079: _var(U32),
    0x607A: _var(I32),
    0x607B: _array(I32),
    0x607C: _var(I32),
    0x607D: _array(I32),
    0x607E: _var(U8),
    0x607F: _var(U32),
    0x6080: _var(U32),
    0x6081: _var(U32),
    0x6083: _var(U32),
    0x6084: _var(U32),
    0x6085: _var(U32),
    0x608F: _array(U32),
    0x6090: _array(U32),
    0x6091: _array(U32),
    0x6092: _array(U32),
    0x6098: _var(I8),
    0x6099: _array(U32),
    0x609A: _var(U32),
    0x60B0: _var(I32),
    0x60B1: _var(I32),
    0x60B2: _var(I16),
    0x60C2: Shape(RECORD, (U8, I8)),
    0x60C5: _var(U32),
    0x60C6: _var(U32),
    0x60E0: _var(U16),
    0x60E1: _var(U16),
    0x60E3: _array(I8),
    0x60F4: _var(I32),
    0x60FC: _var(I32),
    0x60FD: _var(U32),
    0x60FE: _array(U32),
    0x60FF: _var(I32),
    0x6402: _var(U16),
    0x6403: _var(VISIBLE_STRING),
    0x6502: _var(U32),
    0x6503: _var(VISIBLE_STRING),
    0x6505: _var(VISIBLE_STRING),
}


def shape_of(index: int) -> Shape | None:
    """The standard's shape of an object; None for one that the tables do not know."""
    for first, last, shape in (
        (0x1200, 0x12FF, _SDO),
        (0x1400, 0x15FF, _PDO),
        (0x1600, 0x17FF, _MAPPING),
        (0x1800, 0x19FF, _PDO),
        (0x1A00, 0x1BFF, _MAPPING),
    ):
        if first <= index <= last:
            return shape
    return _COMMUNICATION.get(index) or _DRIVE.get(index)


def area_of(index: int) -> str:
    """The list of the EDS that an object belongs in."""
    if index in (0x1000, 0x1001, 0x1018):
        return "MandatoryObjects"
    return "ManufacturerObjects" if 0x2000 <= index < 0x6000 else "OptionalObjects"
