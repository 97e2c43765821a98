# SPDX-License-Identifier: MIT
"""Reads an EDS file by python canopen; a fault is an EdsError, which names the section. Used by eds/check and eds/to_c.
Reads the file that it is given.
"""

from __future__ import annotations

import io
import logging
import re
from configparser import Error as IniError
from configparser import NoOptionError, RawConfigParser
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import canopen
from canopen.objectdictionary import ODArray, ODVariable, datatypes

LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
ACCESS = ("ro", "wo", "rw", "rwr", "rww", "const")
_VAR, _DOMAIN, _ARRAY, _RECORD = 0x7, 0x2, 0x8, 0x9
_SECTION = re.compile(r"([0-9A-Fa-f]{4})(?:[Ss]ub([0-9A-Fa-f]{1,2}))?")
_NODE = 0  # canopen adds it for $NODEID; so defaults do not contain the node id


class EdsError(Exception):
    """The EDS file cannot be used; the text says where and why."""


@dataclass(frozen=True)
class NumberType:
    """An integer type of CiA 301: its name in od.h, its C type, its size in bits."""

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
    datatypes.BOOLEAN: NumberType("OD_BOOLEAN", "uint8_t", 8, False),
    datatypes.INTEGER8: NumberType("OD_INTEGER8", "int8_t", 8, True),
    datatypes.INTEGER16: NumberType("OD_INTEGER16", "int16_t", 16, True),
    datatypes.INTEGER32: NumberType("OD_INTEGER32", "int32_t", 32, True),
    datatypes.INTEGER64: NumberType("OD_INTEGER64", "int64_t", 64, True),
    datatypes.UNSIGNED8: NumberType("OD_UNSIGNED8", "uint8_t", 8, False),
    datatypes.UNSIGNED16: NumberType("OD_UNSIGNED16", "uint16_t", 16, False),
    datatypes.UNSIGNED32: NumberType("OD_UNSIGNED32", "uint32_t", 32, False),
    datatypes.UNSIGNED64: NumberType("OD_UNSIGNED64", "uint64_t", 64, False),
}
OTHERS = {
    datatypes.VISIBLE_STRING: "OD_VISIBLE_STRING",
    datatypes.OCTET_STRING: "OD_OCTET_STRING",
    datatypes.DOMAIN: "OD_DOMAIN",
}


class Ini:
    """Sections and keys of an EDS file, as they are written."""

    def __init__(self, text: str) -> None:
        self.parser = RawConfigParser(inline_comment_prefixes=(";",))
        self.parser.optionxform = str  # type: ignore[assignment,method-assign]
        try:
            self.parser.read_string(text)
        except IniError as error:
            raise EdsError(" ".join(str(error).split())) from error

    def keys(self, section: str) -> dict[str, str]:
        """Keys and values of a section; empty where there is no such section."""
        return dict(self.parser.items(section)) if self.parser.has_section(section) else {}

    def text(self, section: str, key: str, default: str | None = None) -> str:
        """The value of a key; an error when it is missing and there is no default."""
        if not self.parser.has_section(section):
            raise EdsError(f"[{section}] is missing")
        found = self.parser.get(section, key, fallback=default)
        if found is None:
            raise EdsError(f"[{section}] has no {key}")
        return found

    def number(self, section: str, key: str, default: str | None = None) -> int:
        """The value of a key as an integer (decimal or 0x...); else as `text`."""
        text = self.text(section, key, default)
        try:
            return int(text, 0)
        except ValueError:
            raise EdsError(f"[{section}] {key}={text} is not an integer") from None

    def objects(self) -> dict[str, tuple[int, int | None]]:
        """Sections of objects: index and None, or index and sub-index."""
        matches = ((name, _SECTION.fullmatch(name)) for name in self.parser.sections())
        return {
            name: (int(match[1], 16), None if match[2] is None else int(match[2], 16))
            for name, match in matches
            if match
        }

    def in_order(self) -> io.StringIO:
        """The file with each object before its sub-indices, as python canopen wants it."""
        sorted_ini = RawConfigParser()
        sorted_ini.optionxform = str  # type: ignore[assignment,method-assign]
        names = sorted(self.parser.sections(), key=lambda name: "sub" in name.lower())
        sorted_ini.read_dict({name: self.keys(name) for name in names})
        stream = io.StringIO()
        sorted_ini.write(stream)
        stream.seek(0)
        stream.name = "sorted.eds"
        return stream


@dataclass(frozen=True)
class Dictionary:
    """An EDS file: what is written, and the objects that python canopen makes of it, in rising order of index."""

    ini: Ini
    objects: dict[int, Any]  # of ODVariable, ODArray or ODRecord


def values_of(entry: Any) -> list[Any]:
    """The ODVariables of an object, in rising order of sub-index."""
    if isinstance(entry, ODVariable):
        return [entry]
    return [entry.subindices[sub] for sub in sorted(entry.subindices)]


def default_of(variable: Any) -> int | bytes:
    """DefaultValue without the node id; 0 or nothing where there is none."""
    if variable.data_type in NUMBERS:
        return int(variable.default or 0)
    if isinstance(variable.default, str):
        return variable.default.encode("ascii")
    return bytes(variable.default or b"")


def read(path: Path) -> Dictionary:
    """The dictionary in a file. Raises EdsError."""
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise EdsError(f"cannot be read: {error}") from error
    return parse(Ini(text))


def parse(ini: Ini) -> Dictionary:
    """The dictionary of sections that have been read. Raises EdsError."""
    sections = ini.objects()
    _check_lists(ini, sections)
    for name, (_, sub) in sections.items():
        _check_keys(ini, name, sub)
    found = load(ini.in_order(), _NODE)
    for name, (index, sub) in sections.items():
        if isinstance(found[index], ODVariable):
            _check_value(ini, name, found[index])
        elif sub is None:
            _check_group(ini, name, found[index])
        else:
            _check_value(ini, name, found[index].subindices[sub])
    return Dictionary(
        ini, {index: found[index] for index in sorted(i for i, _ in sections.values())}
    )


def load(source: Any, node: int) -> Any:
    """The ObjectDictionary that python canopen makes of a path or stream. Raises EdsError."""
    logging.getLogger("canopen").setLevel(logging.ERROR)  # warns of files without DeviceInfo
    try:
        return canopen.import_od(source, node)
    except NoOptionError as error:
        raise EdsError(f"[{error.section}] has no {error.option}") from error
    except Exception as error:  # canopen lets pass what its parser and int() raise
        text = " ".join(str(error).split())
        raise EdsError(
            f"python canopen does not load it: {type(error).__name__}: {text}"
        ) from error


def _check_lists(ini: Ini, sections: dict[str, tuple[int, int | None]]) -> None:
    """Every object is in a list, every listed object is there, every sub-index has an object."""
    found = {index for index, sub in sections.values() if sub is None}
    listed = {
        ini.number(name, str(i))
        for name in LISTS
        for i in range(1, ini.number(name, "SupportedObjects") + 1)
    }
    for index in sorted(listed ^ found):
        what = "is listed but missing" if index in listed else "is in no list of objects"
        raise EdsError(f"[{index:04X}] {what}")
    for name, (index, _) in sections.items():
        if index not in found:
            raise EdsError(f"[{name}] belongs to no object")


def _check_keys(ini: Ini, section: str, sub: int | None) -> None:
    """The keys that an object needs, of kinds that the C tables know."""
    ini.text(section, "ParameterName")
    kind = _VAR if sub is not None else ini.number(section, "ObjectType", "0x7")
    if kind in (_ARRAY, _RECORD):
        ini.number(section, "SubNumber")
        return
    if kind not in (_VAR, _DOMAIN):
        raise EdsError(f"[{section}] ObjectType=0x{kind:X} is not supported")
    data_type = ini.number(section, "DataType")
    if data_type not in NUMBERS and data_type not in OTHERS:
        raise EdsError(f"[{section}] DataType=0x{data_type:04X} is not supported")
    access = ini.text(section, "AccessType")
    if access.lower() not in ACCESS:
        raise EdsError(f"[{section}] AccessType={access} is none of {', '.join(ACCESS)}")
    ini.number(section, "PDOMapping", "0")


def _check_value(ini: Ini, section: str, variable: Any) -> None:
    """Default and limits are of the value's type, and in order."""
    text = ini.text(section, "DefaultValue", "")
    if variable.data_type == datatypes.VISIBLE_STRING:
        if not (text.isascii() and text.isprintable()) or '"' in text or "\\" in text:
            raise EdsError(f"[{section}] DefaultValue is not plain printable ASCII")
        return
    if text and variable.default is None:
        kind = "an integer" if variable.data_type in NUMBERS else "hexadecimal"
        raise EdsError(f"[{section}] DefaultValue={text} is not {kind}")
    if variable.data_type not in NUMBERS:
        return
    if "$" in text and not variable.relative:
        raise EdsError(f"[{section}] DefaultValue={text} is not of the form $NODEID+0x...")
    number = NUMBERS[variable.data_type]
    limits = (("LowLimit", variable.min), ("HighLimit", variable.max))
    for key, value in (("DefaultValue", variable.default), *limits):
        if value is None and ini.text(section, key, ""):
            raise EdsError(f"[{section}] {key}={ini.text(section, key)} is not an integer")
        if value is not None and not number.bounds()[0] <= value <= number.bounds()[1]:
            raise EdsError(f"[{section}] {key}={value} does not fit {number.name[3:]}")
    _check_order(section, variable)


def _check_order(section: str, variable: Any) -> None:
    """Limits in order, the default within them (a write-only value may start outside)."""
    low, high, default = variable.min, variable.max, default_of(variable)
    if low is not None and high is not None and low > high:
        raise EdsError(f"[{section}] LowLimit is above HighLimit")
    if variable.readable and low is not None and default < low:
        raise EdsError(f"[{section}] DefaultValue is below LowLimit")
    if variable.readable and high is not None and default > high:
        raise EdsError(f"[{section}] DefaultValue is above HighLimit")


def _check_group(ini: Ini, section: str, entry: Any) -> None:
    """Sub-index 0 counts; an ARRAY is of one type without gaps."""
    values = values_of(entry)
    declared = ini.number(section, "SubNumber")
    if declared != len(values):
        raise EdsError(f"[{section}] SubNumber={declared}, but there are {len(values)} sub-indices")
    starts = [(value.subindex, value.data_type) for value in values[:1]]
    if len(values) < 2 or starts != [(0, datatypes.UNSIGNED8)]:
        raise EdsError(f"[{section}] needs an UNSIGNED8 sub-index 0 and at least one more")
    if not isinstance(entry, ODArray):
        return
    if any(value.data_type != values[1].data_type for value in values[1:]):
        raise EdsError(f"[{section}] is an ARRAY of several data types")
    if values[1].data_type not in NUMBERS:
        raise EdsError(f"[{section}] is an ARRAY of something else than numbers")
    if [value.subindex for value in values] != list(range(len(values))):
        raise EdsError(f"[{section}] is an ARRAY with gaps")
