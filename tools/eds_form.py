# SPDX-License-Identifier: MIT
"""Rules of CiA 306 about the form of an EDS: its sections and keys. Each function yields what is wrong, a line each."""

from __future__ import annotations

import re
from collections.abc import Iterator

from eds_read import LISTS, Reader
from eds_standard import area_of

_BAUD_RATES = (10, 20, 50, 125, 250, 500, 800, 1000)
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
    **{f"BaudRate_{rate}": _FLAG for rate in _BAUD_RATES},
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
_VALUE_KEYS = {
    "ParameterName",
    "ObjectType",
    "DataType",
    "AccessType",
    "DefaultValue",
    "LowLimit",
    "HighLimit",
    "PDOMapping",
    "ObjFlags",
    "Unit",  # no key of CiA 306, but one that python canopen and others read
}
_GROUP_KEYS = {"ParameterName", "ObjectType", "SubNumber", "ObjFlags"}
_ACCESS = ("ro", "wo", "rw", "rwr", "rww", "const")
_FORMULA = re.compile(r"\$NODEID(\+0x[0-9A-Fa-f]+)?|0x[0-9A-Fa-f]+\+\$NODEID")
_OBJECT = re.compile(r"[0-9A-F]{4}")
_SUB = re.compile(r"[0-9A-F]{4}sub([0-9A-F]|[1-9A-F][0-9A-F])")


def form(reader: Reader, file_name: str) -> Iterator[str]:
    """All rules of this module."""
    yield from _sections(reader)
    yield from _keys(reader, "FileInfo", {"FileName": re.escape(file_name), **_FILE_INFO})
    yield from _keys(reader, "DeviceInfo", _DEVICE_INFO)
    yield from _keys(reader, "DummyUsage", _DUMMIES)
    yield from _comments(reader)
    for name in LISTS:
        yield from _list(reader, name)
    for section in reader.ini.sections():
        if _OBJECT.fullmatch(section) or _SUB.fullmatch(section):
            yield from _object(reader, section)


def _sections(reader: Reader) -> Iterator[str]:
    known = {"FileInfo", "DeviceInfo", "DummyUsage", "Comments", *LISTS}
    for section in reader.ini.sections():
        if section not in known and not _OBJECT.fullmatch(section) and not _SUB.fullmatch(section):
            yield f"[{section}] is no section of CiA 306 (objects: four capital hexadecimal digits)"


def _keys(reader: Reader, section: str, wanted: dict[str, str]) -> Iterator[str]:
    if not reader.ini.has_section(section):
        yield f"[{section}] is missing"
        return
    found = dict(reader.ini.items(section))
    for key, pattern in wanted.items():
        if key not in found:
            yield f"[{section}] has no {key}"
        elif not re.fullmatch(pattern, found[key].strip()):
            yield f"[{section}] {key}={found[key]} is not of the form {pattern}"
    for key in found:
        if key not in wanted:
            yield f"[{section}] {key} is no key of this section"


def _comments(reader: Reader) -> Iterator[str]:
    if not reader.ini.has_section("Comments"):
        return
    lines = sum(key.startswith("Line") and key != "Lines" for key in reader.ini["Comments"])
    if reader.number("Comments", "Lines") != lines:
        yield f"[Comments] Lines counts others than the {lines} that are there"


def _list(reader: Reader, name: str) -> Iterator[str]:
    if not reader.ini.has_section(name):
        yield f"[{name}] is missing"
        return
    count = reader.number(name, "SupportedObjects")
    keys = [key for key in reader.ini[name] if key != "SupportedObjects"]
    if keys != [str(i) for i in range(1, count + 1)]:
        yield f"[{name}] SupportedObjects={count}, but its keys are not 1 to {count} in order"
        return
    indices = [reader.number(name, key) for key in keys]
    for index in sorted(set(indices)):
        if indices.count(index) > 1:
            yield f"[{name}] has 0x{index:04X} more than once"
    for index in indices:
        if area_of(index) != name:
            yield f"[{name}] 0x{index:04X} belongs in {area_of(index)}"


def _object(reader: Reader, section: str) -> Iterator[str]:
    found = dict(reader.ini.items(section))
    allowed = _GROUP_KEYS if "SubNumber" in found else _VALUE_KEYS
    for key in found:
        if key not in allowed:
            yield f"[{section}] {key} is no key of such an object"
    if len(found.get("ParameterName", "")) > 241:
        yield f"[{section}] ParameterName is longer than 241 characters"
    if "ObjectType" not in found:
        yield f"[{section}] has no ObjectType"
    if "SubNumber" not in found:
        yield from _value(section, found)


def _value(section: str, found: dict[str, str]) -> Iterator[str]:
    for key in ("DataType", "AccessType", "PDOMapping"):
        if key not in found:
            yield f"[{section}] has no {key}"
    if found.get("AccessType", "ro") not in _ACCESS:
        yield f"[{section}] AccessType={found['AccessType']} is none of {', '.join(_ACCESS)}"
    if found.get("PDOMapping", "0") not in ("0", "1"):
        yield f"[{section}] PDOMapping={found['PDOMapping']} is neither 0 nor 1"
    if not re.fullmatch(r"0x[0-9A-Fa-f]{4}", found.get("DataType", "0x0000")):
        yield f"[{section}] DataType={found['DataType']} is not of the form 0x0000"
    for key in ("DefaultValue", "LowLimit", "HighLimit"):
        text = found.get(key, "")
        if "$" in text and (key != "DefaultValue" or not _FORMULA.fullmatch(text)):
            yield f"[{section}] {key}={text} is not of the form $NODEID+0x..."
