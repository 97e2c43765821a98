# SPDX-License-Identifier: MIT
"""Rules about what the objects of an EDS say: kinds and types of the standards, counts, PDOs, identity.

Each function yields what is wrong, a line each.
"""

from __future__ import annotations

from collections.abc import Iterator

from eds_model import ARRAY, NUMBERS, RECORD, VAR, Entry, Value
from eds_read import Reader
from eds_standard import DYNAMIC_COUNTS, U8, shape_of

_MANDATORY = (0x1000, 0x1001, 0x1018)
_KINDS = {VAR: "VAR", ARRAY: "ARRAY", RECORD: "RECORD"}
_INVALID, _FRAME_29, _NO_RTR = 1 << 31, 1 << 29, 1 << 30
_PDO_BITS = 64
_RESTRICTED = (
    (0x000, 0x080),  # NMT, reserved, SYNC
    (0x101, 0x180),
    (0x581, 0x5FF),
    (0x601, 0x67F),
    (0x6E0, 0x6FF),
    (0x701, 0x7FF),
)
"""CiA 301, table 42: identifiers that no configurable object may use."""

Found = dict[int, Entry]


def rules(reader: Reader, entries: list[Entry]) -> Iterator[str]:
    """All rules of this module."""
    found = {entry.index: entry for entry in entries}
    for index in _MANDATORY:
        if index not in found:
            yield f"[{index:04X}] is mandatory and missing"
    yield from _names(entries)
    for entry in entries:
        yield from _shape(entry)
        yield from _count(entry)
        for value in entry.values:
            yield from _mappable(value)
    yield from _identity(reader, found)
    yield from _pdos(reader, found)


def _sub(entry: Entry, sub: int) -> Value | None:
    return next((value for value in entry.values if value.sub == sub), None)


def _default(found: Found, index: int, sub: int) -> int | None:
    value = _sub(found[index], sub) if index in found else None
    return value.default if value is not None and isinstance(value.default, int) else None


def _where(value: Value, entry_is_var: bool = False) -> str:
    return f"[{value.index:04X}]" if entry_is_var else f"[{value.index:04X}sub{value.sub:X}]"


def _names(entries: list[Entry]) -> Iterator[str]:
    labels = [entry.label for entry in entries]
    for entry in entries:
        if labels.count(entry.label) > 1:
            yield f"[{entry.index:04X}] ParameterName '{entry.label}' is that of another object too"
        subs = [value.label for value in entry.values]
        for label in sorted(set(subs)):
            if subs.count(label) > 1:
                yield f"[{entry.index:04X}] has two sub-indices '{label}'"


def _shape(entry: Entry) -> Iterator[str]:
    shape = shape_of(entry.index)
    if shape is None:
        if not 0x2000 <= entry.index < 0x6000:
            yield f"[{entry.index:04X}] is unknown to tools/eds_standard.py: add it there"
        return
    if entry.kind != shape.kind:
        yield f"[{entry.index:04X}] is a {_KINDS[entry.kind]}, the standard has a {_KINDS[shape.kind]}"
        return
    for value in entry.values:
        if entry.kind != VAR and value.sub == 0:
            continue
        at = value.sub - 1 if entry.kind == RECORD else 0
        if at >= len(shape.types):
            yield f"{_where(value)} is no sub-index of the standard"
        elif value.data_type != shape.types[at]:
            yield (
                f"{_where(value, entry.kind == VAR)} has DataType=0x{value.data_type:04X}, "
                f"the standard has 0x{shape.types[at]:04X}"
            )


def _count(entry: Entry) -> Iterator[str]:
    if entry.kind == VAR:
        return
    count, highest = entry.values[0], entry.values[-1].sub
    if count.data_type != U8:
        yield f"{_where(count)} is no UNSIGNED8"
    elif entry.index in DYNAMIC_COUNTS:
        if not isinstance(count.default, int) or count.default > highest:
            yield f"{_where(count)} DefaultValue={count.default!r} is above sub-index {highest}"
    else:
        if count.default != highest:
            yield f"{_where(count)} DefaultValue={count.default!r}, the highest sub-index is {highest}"
        if "OD_WRITE" in count.access:
            yield f"{_where(count)} can be written"


def _mappable(value: Value) -> Iterator[str]:
    if value.mappable and value.data_type not in NUMBERS:
        yield f"{_where(value)} is mappable, but no number"
    if value.mappable and value.index < 0x2000 and value.index != 0x1001:
        yield f"{_where(value)} is mappable, but a communication object"


def _identity(reader: Reader, found: Found) -> Iterator[str]:
    for key, sub in (("VendorNumber", 1), ("ProductNumber", 2), ("RevisionNumber", 3)):
        told = reader.number("DeviceInfo", key)
        if _default(found, 0x1018, sub) != told:
            yield f"[DeviceInfo] {key}={told} is not what 0x1018 sub {sub} says"
    for index, offset in ((0x1014, 0x80),):
        value = _sub(found[index], 0) if index in found else None
        if value is not None and (value.default, value.uses_node_id) != (offset, True):
            yield f"[{index:04X}] DefaultValue is not $NODEID+0x{offset:X}"
    for sub, offset in ((1, 0x600), (2, 0x580)):
        value = _sub(found[0x1200], sub) if 0x1200 in found else None
        if value is not None and (value.default, value.uses_node_id) != (offset, True):
            yield f"[1200sub{sub}] DefaultValue is not $NODEID+0x{offset:X}"


def _pdos(reader: Reader, found: Found) -> Iterator[str]:
    cob_ids: dict[int, int] = {}
    for key, first, mapping in (("NrOfRXPDO", 0x1400, 0x1600), ("NrOfTXPDO", 0x1800, 0x1A00)):
        numbers = [i for i in range(0x200) if first + i in found]
        mapped = [i for i in range(0x200) if mapping + i in found]
        if reader.number("DeviceInfo", key) != len(numbers):
            yield f"[DeviceInfo] {key} counts others than the {len(numbers)} that are there"
        for i in sorted(set(numbers) ^ set(mapped)):
            yield f"[{first + i:04X}] and [{mapping + i:04X}] are not both there"
        for i in sorted(set(numbers) & set(mapped)):
            yield from _communication(found[first + i], key == "NrOfTXPDO", cob_ids)
            yield from _mapping(found, found[mapping + i], key == "NrOfRXPDO")


def _communication(entry: Entry, transmitted: bool, cob_ids: dict[int, int]) -> Iterator[str]:
    cob, kind = _sub(entry, 1), _sub(entry, 2)
    if cob is None or kind is None or not isinstance(cob.default, int):
        yield f"[{entry.index:04X}] lacks sub-index 1 or 2"
        return
    if cob.default & _FRAME_29:
        yield f"{_where(cob)} asks for 29-bit identifiers, which we do not use"
    identifiers = [
        (cob.default & 0x7FF) + node for node in (range(1, 128) if cob.uses_node_id else (0,))
    ]
    if any(low <= each <= high for each in identifiers for low, high in _RESTRICTED):
        yield f"{_where(cob)} may become an identifier that CiA 301 reserves"
    if not cob.default & _INVALID:
        other = cob_ids.setdefault(cob.default & 0x7FF, entry.index)
        if other != entry.index:
            yield f"{_where(cob)} is the COB-ID of [{other:04X}] too"
    reserved = range(241, 254 if not transmitted else 252)
    if kind.default in reserved:
        yield f"{_where(kind)} DefaultValue={kind.default!r} is a reserved transmission type"


def _mapping(found: Found, entry: Entry, received: bool) -> Iterator[str]:
    count = entry.values[0].default
    total = 0
    for value in entry.values[1 : 1 + (count if isinstance(count, int) else 0)]:
        word = value.default if isinstance(value.default, int) else 0
        index, sub, bits = word >> 16, word >> 8 & 0xFF, word & 0xFF
        total += bits
        if received and 1 <= index <= 7:
            continue  # a dummy of that data type
        target = _sub(found[index], sub) if index in found else None
        if target is None:
            yield f"{_where(value)} maps 0x{index:04X} sub {sub}, which does not exist"
        elif not target.mappable:
            yield f"{_where(value)} maps 0x{index:04X} sub {sub}, which is not mappable"
        elif target.size * 8 != bits:
            yield f"{_where(value)} maps {bits} bits of 0x{index:04X} sub {sub}, which has {target.size * 8}"
    if total > _PDO_BITS:
        yield f"[{entry.index:04X}] maps {total} bits; a frame has {_PDO_BITS}"
