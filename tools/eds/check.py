# SPDX-License-Identifier: MIT
"""Checks EDS files against CiA 306, 301 and 402, and that python canopen loads them. Run by `make lint`. Reads the
files, writes nothing.

    python -m eds.check FILE.eds...

A line for each fault, with file and section; exit status 1 when there is one, 2 for a file that cannot be read.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ObjectDictionary, ODVariable

from .reading import (
    ACCESS,
    LISTS,
    NUMBERS,
    Dictionary,
    EdsError,
    Ini,
    default_of,
    load,
    parse,
    values_of,
)
from .standard import DYNAMIC_COUNTS, KINDS, area_of, shape_of

# ---- CiA 306: sections and keys

_TIME = r"(0[1-9]|1[0-2]):[0-5]\d(AM|PM)"
_DATE = r"(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])-\d{4}"
_FLAG = r"[01]"
_NUMBER = r"\d+|0x[0-9A-Fa-f]+"
_FILE_INFO = {
    "FileVersion": _NUMBER,
    "FileRevision": _NUMBER,
    "EDSVersion": r"4\.0",
    "Description": r".{0,243}",
    "CreationTime": _TIME,
    "CreationDate": _DATE,
    "CreatedBy": r".{0,245}",
    "ModificationTime": _TIME,
    "ModificationDate": _DATE,
    "ModifiedBy": r".{0,244}",
}
_DEVICE_INFO = {
    "VendorName": r".{1,244}",
    "VendorNumber": _NUMBER,
    "ProductName": r".{1,243}",
    "ProductNumber": _NUMBER,
    "RevisionNumber": _NUMBER,
    "OrderCode": r".{1,245}",
    **{f"BaudRate_{rate}": _FLAG for rate in (10, 20, 50, 125, 250, 500, 800, 1000)},
    "SimpleBootUpMaster": _FLAG,
    "SimpleBootUpSlave": _FLAG,
    "Granularity": r"\d|[1-5]\d|6[0-4]",
    "DynamicChannelsSupported": r"\d+",
    "GroupMessaging": _FLAG,
    "NrOfRXPDO": r"\d+",
    "NrOfTXPDO": r"\d+",
    "LSS_Supported": _FLAG,
}
_DUMMIES = {f"Dummy{i:04}": _FLAG for i in range(1, 8)}
_GROUP_KEYS = {"ParameterName", "ObjectType", "SubNumber", "ObjFlags"}
_VALUE_KEYS = {
    *("ParameterName", "ObjectType", "DataType", "AccessType", "DefaultValue"),
    *("LowLimit", "HighLimit", "PDOMapping", "ObjFlags"),
    "Unit",  # no key of CiA 306, but one that python canopen and others read
}
_FORMULA = re.compile(r"\$NODEID\+0x[0-9A-Fa-f]+|0x[0-9A-Fa-f]+\+\$NODEID")
_OBJECT = re.compile(r"[0-9A-F]{4}(sub([0-9A-F]|[1-9A-F][0-9A-F]))?")

# ---- CiA 301: objects

_MANDATORY = (0x1000, 0x1001, 0x1018)
_INVALID, _FRAME_29 = 1 << 31, 1 << 29
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


def check(path: Path) -> list[str]:
    """The faults of an EDS file, a line each. Raises EdsError: it cannot be read."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise EdsError(f"cannot be read: {error}") from error
    found: list[str] = []
    try:
        ini = Ini(text)
        found.extend(_form(ini, path.name))
        dictionary = parse(ini)
        found.extend(_rules(dictionary))
        load(str(path), 1)  # as it is: others need an object before its sub-indices
    except EdsError as error:  # nothing after it can be checked
        found.append(str(error))
    return found


def _form(ini: Ini, file_name: str) -> Iterator[str]:
    known = {"FileInfo", "DeviceInfo", "DummyUsage", "Comments", *LISTS}
    sections = ini.parser.sections()
    for section in sections:
        if section not in known and not _OBJECT.fullmatch(section):
            yield f"[{section}] is no section of CiA 306 (objects: four capital hexadecimal digits)"
    yield from _keys(ini, "FileInfo", {"FileName": re.escape(file_name), **_FILE_INFO})
    yield from _keys(ini, "DeviceInfo", _DEVICE_INFO)
    yield from _keys(ini, "DummyUsage", _DUMMIES)
    lines = sum(key.startswith("Line") and key != "Lines" for key in ini.keys("Comments"))
    if "Comments" in sections and ini.number("Comments", "Lines") != lines:
        yield f"[Comments] Lines counts others than the {lines} that are there"
    for name in LISTS:
        yield from _list(ini, name)
    for section in filter(_OBJECT.fullmatch, sections):
        yield from _object(section, ini.keys(section))


def _keys(ini: Ini, section: str, wanted: dict[str, str]) -> Iterator[str]:
    found = ini.keys(section)
    if section not in ini.parser.sections():
        yield f"[{section}] is missing"
        return
    for key, pattern in wanted.items():
        if key not in found:
            yield f"[{section}] has no {key}"
        elif not re.fullmatch(pattern, found[key]):
            yield f"[{section}] {key}={found[key]} is not of the form {pattern}"
    for key in found:
        if key not in wanted:
            yield f"[{section}] {key} is no key of this section"


def _list(ini: Ini, name: str) -> Iterator[str]:
    if name not in ini.parser.sections():
        yield f"[{name}] is missing"
        return
    count = ini.number(name, "SupportedObjects")
    keys = [key for key in ini.keys(name) if key != "SupportedObjects"]
    if keys != [str(i) for i in range(1, count + 1)]:
        yield f"[{name}] SupportedObjects={count}, but its keys are not 1 to {count} in order"
        return
    indices = [ini.number(name, key) for key in keys]
    for index in sorted(set(indices)):
        if indices.count(index) > 1:
            yield f"[{name}] has 0x{index:04X} more than once"
    for index in indices:
        if area_of(index) != name:
            yield f"[{name}] 0x{index:04X} belongs in {area_of(index)}"


def _object(section: str, found: dict[str, str]) -> Iterator[str]:
    allowed = _GROUP_KEYS if "SubNumber" in found else _VALUE_KEYS
    for key in found:
        if key not in allowed:
            yield f"[{section}] {key} is no key of such an object"
    if len(found.get("ParameterName", "")) > 241:
        yield f"[{section}] ParameterName is longer than 241 characters"
    if "ObjectType" not in found:
        yield f"[{section}] has no ObjectType"
    if "SubNumber" not in found:
        yield from _value_keys(section, found)


def _value_keys(section: str, found: dict[str, str]) -> Iterator[str]:
    for key in ("DataType", "AccessType", "PDOMapping"):
        if key not in found:
            yield f"[{section}] has no {key}"
    if found.get("AccessType", "ro") not in ACCESS:
        yield f"[{section}] AccessType={found['AccessType']} is none of {', '.join(ACCESS)}"
    if found.get("PDOMapping", "0") not in ("0", "1"):
        yield f"[{section}] PDOMapping={found['PDOMapping']} is neither 0 nor 1"
    if not re.fullmatch(r"0x[0-9A-Fa-f]{4}", found.get("DataType", "0x0000")):
        yield f"[{section}] DataType={found['DataType']} is not of the form 0x0000"
    for key in ("DefaultValue", "LowLimit", "HighLimit"):
        text = found.get(key, "")
        if "$" in text and (key != "DefaultValue" or not _FORMULA.fullmatch(text)):
            yield f"[{section}] {key}={text} is not of the form $NODEID+0x..."


def _rules(dictionary: Dictionary) -> Iterator[str]:
    objects = dictionary.objects
    for index in _MANDATORY:
        if index not in objects:
            yield f"[{index:04X}] is mandatory and missing"
    labels = [entry.name for entry in objects.values()]
    for index, entry in objects.items():
        if labels.count(entry.name) > 1:
            yield f"[{index:04X}] ParameterName '{entry.name}' is that of another object too"
        yield from _shape(entry)
        if not isinstance(entry, ODVariable):
            yield from _group(entry)
        for value in values_of(entry):
            yield from _mappable(value)
            if value.data_type in NUMBERS and value.default is None:
                yield f"{_where(value)} has no DefaultValue"
    yield from _identity(dictionary)
    yield from _pdos(dictionary)


def _where(value: Any) -> str:
    is_object = isinstance(value.parent, ObjectDictionary)
    return f"[{value.index:04X}]" if is_object else f"[{value.index:04X}sub{value.subindex:X}]"


def _value(dictionary: Dictionary, index: int, sub: int) -> Any:
    """The ODVariable of an index and sub-index; None where there is none."""
    values = values_of(dictionary.objects[index]) if index in dictionary.objects else []
    return next((value for value in values if value.subindex == sub), None)


def _shape(entry: Any) -> Iterator[str]:
    shape, kind = shape_of(entry.index), KINDS[type(entry)]
    if shape is None:
        if not 0x2000 <= entry.index < 0x6000:
            yield f"[{entry.index:04X}] is unknown to tools/eds/standard.py: add it there"
        return
    if kind != shape.kind:
        yield f"[{entry.index:04X}] is a {kind}, the standard has a {shape.kind}"
        return
    for value in values_of(entry)[0 if kind == "VAR" else 1 :]:
        at = value.subindex - 1 if kind == "RECORD" else 0
        if at >= len(shape.types):
            yield f"{_where(value)} is no sub-index of the standard"
        elif value.data_type != shape.types[at]:
            yield (
                f"{_where(value)} has DataType=0x{value.data_type:04X}, "
                f"the standard has 0x{shape.types[at]:04X}"
            )


def _group(entry: Any) -> Iterator[str]:
    values = values_of(entry)
    count, highest = values[0], values[-1].subindex
    labels = [value.name for value in values]
    for label in sorted({label for label in labels if labels.count(label) > 1}):
        yield f"[{entry.index:04X}] has two sub-indices '{label}'"
    if entry.index in DYNAMIC_COUNTS:
        if default_of(count) > highest:
            yield f"{_where(count)} DefaultValue={count.default} is above sub-index {highest}"
        return
    if default_of(count) != highest:
        yield f"{_where(count)} DefaultValue={count.default}, the highest sub-index is {highest}"
    if count.writable:
        yield f"{_where(count)} can be written"


def _mappable(value: Any) -> Iterator[str]:
    if value.pdo_mappable and value.data_type not in NUMBERS:
        yield f"{_where(value)} is mappable, but no number"
    if value.pdo_mappable and value.index < 0x2000 and value.index != 0x1001:
        yield f"{_where(value)} is mappable, but a communication object"


def _identity(dictionary: Dictionary) -> Iterator[str]:
    for key, sub in (("VendorNumber", 1), ("ProductNumber", 2), ("RevisionNumber", 3)):
        declared, value = dictionary.ini.number("DeviceInfo", key), _value(dictionary, 0x1018, sub)
        if value is None or default_of(value) != declared:
            yield f"[DeviceInfo] {key}={declared} is not what 0x1018 sub {sub} says"
    for index, sub, offset in ((0x1014, 0, 0x80), (0x1200, 1, 0x600), (0x1200, 2, 0x580)):
        value = _value(dictionary, index, sub)
        if value is not None and (default_of(value), value.relative) != (offset, True):
            yield f"{_where(value)} DefaultValue is not $NODEID+0x{offset:X}"


def _pdos(dictionary: Dictionary) -> Iterator[str]:
    cob_ids: dict[int, int] = {}
    objects = dictionary.objects
    for key, first, mapping in (("NrOfRXPDO", 0x1400, 0x1600), ("NrOfTXPDO", 0x1800, 0x1A00)):
        numbers = {i for i in range(0x200) if first + i in objects}
        mapped = {i for i in range(0x200) if mapping + i in objects}
        if dictionary.ini.number("DeviceInfo", key) != len(numbers):
            yield f"[DeviceInfo] {key} counts others than the {len(numbers)} that are there"
        for i in sorted(numbers ^ mapped):
            yield f"[{first + i:04X}] and [{mapping + i:04X}] are not both there"
        for i in sorted(numbers & mapped):
            yield from _communication(dictionary, first + i, key == "NrOfTXPDO", cob_ids)
            yield from _mapping(dictionary, mapping + i, key == "NrOfRXPDO")


def _communication(
    dictionary: Dictionary, index: int, transmitted: bool, cob_ids: dict[int, int]
) -> Iterator[str]:
    cob, kind = _value(dictionary, index, 1), _value(dictionary, index, 2)
    if cob is None or kind is None or cob.data_type not in NUMBERS or kind.data_type not in NUMBERS:
        yield f"[{index:04X}] lacks sub-index 1 or 2"
        return
    cob_id = int(default_of(cob))
    if cob_id & _FRAME_29:
        yield f"{_where(cob)} asks for 29-bit identifiers, which we do not use"
    nodes = range(1, 128) if cob.relative else (0,)
    identifiers = [(cob_id & 0x7FF) + node for node in nodes]
    if any(low <= each <= high for each in identifiers for low, high in _RESTRICTED):
        yield f"{_where(cob)} may become an identifier that CiA 301 reserves"
    if not cob_id & _INVALID:
        other = cob_ids.setdefault(cob_id & 0x7FF, index)
        if other != index:
            yield f"{_where(cob)} is the COB-ID of [{other:04X}] too"
    if default_of(kind) in range(241, 252 if transmitted else 254):
        yield f"{_where(kind)} DefaultValue={kind.default} is a reserved transmission type"


def _mapping(dictionary: Dictionary, index: int, received: bool) -> Iterator[str]:
    values = values_of(dictionary.objects[index])
    total = 0
    for value in values[1 : 1 + int(default_of(values[0]))]:
        word = int(default_of(value)) if value.data_type in NUMBERS else 0
        mapped, sub, bits = word >> 16, word >> 8 & 0xFF, word & 0xFF
        total += bits
        if received and 1 <= mapped <= 7:
            continue  # a dummy of that data type
        target = _value(dictionary, mapped, sub)
        size = NUMBERS[target.data_type].bits if target and target.data_type in NUMBERS else 0
        if target is None:
            yield f"{_where(value)} maps 0x{mapped:04X} sub {sub}, which does not exist"
        elif not target.pdo_mappable:
            yield f"{_where(value)} maps 0x{mapped:04X} sub {sub}, which is not mappable"
        elif size != bits:
            yield f"{_where(value)} maps {bits} bits of 0x{mapped:04X} sub {sub}, which has {size}"
    if total > _PDO_BITS:
        yield f"[{index:04X}] maps {total} bits; a frame has {_PDO_BITS}"


def main(arguments: list[str]) -> int:
    """Command line; returns the exit status."""
    if not arguments:
        print("usage: python -m eds.check FILE.eds...", file=sys.stderr)
        return 2
    status = 0
    for name in arguments:
        try:
            faults = check(Path(name))
        except EdsError as error:
            print(f"eds.check: {name}: {error}", file=sys.stderr)
            return 2
        for fault in faults:
            print(f"{name}: {fault}")
            status = 1
    return status


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
