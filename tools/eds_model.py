# SPDX-License-Identifier: MIT
"""What an EDS file says, as the generator passes it on: types, values, objects, C names."""

from __future__ import annotations

import re
from dataclasses import dataclass

VAR, DOMAIN, ARRAY, RECORD = 0x7, 0x2, 0x8, 0x9
VISIBLE_STRING, OCTET_STRING, DOMAIN_TYPE = 0x09, 0x0A, 0x0F
STRING_ROOM = 32
KEYWORDS = (
    " auto break case char const continue default do double else enum extern float for goto if inline "
    "int long register restrict return short signed sizeof static struct switch typedef union "
    "unsigned void volatile while "
)


class EdsError(Exception):
    """The EDS file cannot be used; the text says where and why."""


@dataclass(frozen=True)
class NumberType:
    """A CiA 301 integer type: its name in od.h, its C type, its size in bits."""

    name: str
    c_type: str
    bits: int
    signed: bool

    def bounds(self) -> tuple[int, int]:
        """Smallest and largest value."""
        if self.name == "OD_BOOLEAN":
            return 0, 1
        if self.signed:
            return -(1 << (self.bits - 1)), (1 << (self.bits - 1)) - 1
        return 0, (1 << self.bits) - 1


NUMBERS = {
    0x01: NumberType("OD_BOOLEAN", "uint8_t", 8, False),
    0x02: NumberType("OD_INTEGER8", "int8_t", 8, True),
    0x03: NumberType("OD_INTEGER16", "int16_t", 16, True),
    0x04: NumberType("OD_INTEGER32", "int32_t", 32, True),
    0x05: NumberType("OD_UNSIGNED8", "uint8_t", 8, False),
    0x06: NumberType("OD_UNSIGNED16", "uint16_t", 16, False),
    0x07: NumberType("OD_UNSIGNED32", "uint32_t", 32, False),
    0x15: NumberType("OD_INTEGER64", "int64_t", 64, True),
    0x1B: NumberType("OD_UNSIGNED64", "uint64_t", 64, False),
}
OTHERS = {
    VISIBLE_STRING: "OD_VISIBLE_STRING",
    OCTET_STRING: "OD_OCTET_STRING",
    DOMAIN_TYPE: "OD_DOMAIN",
}


@dataclass(frozen=True)
class Value:
    """One entry: an object, or one sub-index of an ARRAY or RECORD."""

    index: int
    sub: int
    label: str
    data_type: int
    access: str
    default: int | bytes
    uses_node_id: bool
    low: int | None
    high: int | None
    mappable: bool

    @property
    def size(self) -> int:
        """Bytes as in struct od_entry: of a string its room, of a DOMAIN 0."""
        if self.data_type in NUMBERS:
            return NUMBERS[self.data_type].bits // 8
        if isinstance(self.default, bytes) and self.data_type != DOMAIN_TYPE:
            room = 0 if "OD_WRITE" not in self.access else STRING_ROOM
            return max(len(self.default), room, 1)
        return 0


@dataclass(frozen=True)
class Entry:
    """An object of the dictionary with its values in rising order of sub-index."""

    index: int
    label: str
    kind: int
    values: tuple[Value, ...]


def snake(label: str, where: str) -> str:
    """A C identifier for a ParameterName; `where` is its section, for the error text."""
    name = re.sub(r"[^0-9a-z]+", "_", label.lower()).strip("_")
    if not name:
        raise EdsError(f"[{where}] ParameterName '{label}' gives no C name")
    if name[0].isdigit():
        name = "n_" + name
    return name + "_" if f" {name} " in KEYWORDS else name
