# SPDX-License-Identifier: MIT
"""From the text of an EDS file (CiA 306) to objects; each fault is an EdsError that names its section."""

from __future__ import annotations

import configparser
import re

from eds_model import (
    ARRAY,
    DOMAIN,
    DOMAIN_TYPE,
    NUMBERS,
    OCTET_STRING,
    OTHERS,
    RECORD,
    VAR,
    VISIBLE_STRING,
    EdsError,
    Entry,
    NumberType,
    Value,
)

LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
ACCESS = {
    "ro": "OD_READ",
    "const": "OD_READ",
    "wo": "OD_WRITE",
    "rw": "OD_READ | OD_WRITE",
    "rwr": "OD_READ | OD_WRITE",
    "rww": "OD_READ | OD_WRITE",
}


class Reader:
    """Reads the sections of one EDS file."""

    def __init__(self, text: str) -> None:
        self.ini = configparser.RawConfigParser(inline_comment_prefixes=(";",))
        self.ini.optionxform = str  # type: ignore[assignment,method-assign]
        try:
            self.ini.read_string(text)
        except configparser.Error as error:
            raise EdsError(" ".join(str(error).split())) from error

    def text(self, section: str, key: str, default: str | None = None) -> str:
        """The value of a key; an error when it is missing and there is no default."""
        if not self.ini.has_section(section):
            raise EdsError(f"[{section}] is missing")
        found = self.ini.get(section, key, fallback=default)
        if found is None:
            raise EdsError(f"[{section}] has no {key}")
        return found.strip()

    def number(self, section: str, key: str, default: str | None = None) -> int:
        """The same for an integer (decimal or 0x...)."""
        text = self.text(section, key, default)
        try:
            return int(text, 0)
        except ValueError:
            raise EdsError(f"[{section}] {key}={text} is not an integer") from None

    def limit(self, section: str, key: str, kind: NumberType) -> int | None:
        """LowLimit or HighLimit; hexadecimal limits of signed types are two's complement."""
        if not self.text(section, key, ""):
            return None
        value = self.number(section, key)
        if kind.signed and value > kind.bounds()[1]:
            value -= 1 << kind.bits
        return self.checked(section, key, value, kind)

    @staticmethod
    def checked(section: str, key: str, value: int, kind: NumberType) -> int:
        """`value`, if the type can hold it."""
        low, high = kind.bounds()
        if not low <= value <= high:
            raise EdsError(f"[{section}] {key}={value} does not fit {kind.name[3:]}")
        return value

    def default(self, section: str, data_type: int) -> tuple[int | bytes, bool]:
        """DefaultValue, and whether the node id is to be added to it."""
        text = self.text(section, "DefaultValue", "")
        if data_type == VISIBLE_STRING:
            if not (text.isascii() and text.isprintable()) or '"' in text or "\\" in text:
                raise EdsError(f"[{section}] DefaultValue is not plain printable ASCII")
            return text.encode("ascii"), False
        if data_type in (OCTET_STRING, DOMAIN_TYPE):
            try:
                return bytes.fromhex(text), False
            except ValueError:
                raise EdsError(f"[{section}] DefaultValue={text} is not hexadecimal") from None
        kind = NUMBERS[data_type]
        plain = re.sub(r"\s*\+?\s*\$NODEID\s*\+?\s*", "", text, flags=re.IGNORECASE)
        try:
            value = int(plain or "0", 0)
        except ValueError:
            raise EdsError(f"[{section}] DefaultValue={text} is not an integer") from None
        return self.checked(section, "DefaultValue", value, kind), plain != text

    def value(self, section: str, index: int, sub: int) -> Value:
        """One entry."""
        data_type = self.number(section, "DataType")
        if data_type not in NUMBERS and data_type not in OTHERS:
            raise EdsError(f"[{section}] DataType=0x{data_type:04X} is not supported")
        access = self.text(section, "AccessType").lower()
        if access not in ACCESS:
            raise EdsError(f"[{section}] AccessType={access} is none of {', '.join(ACCESS)}")
        default, uses_node_id = self.default(section, data_type)
        low = high = None
        if data_type in NUMBERS:
            low = self.limit(section, "LowLimit", NUMBERS[data_type])
            high = self.limit(section, "HighLimit", NUMBERS[data_type])
        value = Value(
            index=index,
            sub=sub,
            label=self.text(section, "ParameterName"),
            data_type=data_type,
            access=ACCESS[access],
            default=default,
            uses_node_id=uses_node_id,
            low=low,
            high=high,
            mappable=self.number(section, "PDOMapping", "0") != 0,
        )
        self.check_limits(section, value)
        return value

    @staticmethod
    def check_limits(section: str, value: Value) -> None:
        """Limits in order, default within them (a write-only value may start outside)."""
        if value.low is not None and value.high is not None and value.low > value.high:
            raise EdsError(f"[{section}] LowLimit is above HighLimit")
        if not isinstance(value.default, int) or "OD_READ" not in value.access:
            return
        if value.low is not None and value.default < value.low:
            raise EdsError(f"[{section}] DefaultValue is below LowLimit")
        if value.high is not None and value.default > value.high:
            raise EdsError(f"[{section}] DefaultValue is above HighLimit")

    def subs(self, section: str) -> list[tuple[int, str]]:
        """(sub-index, section) of an ARRAY or RECORD, sorted."""
        pattern = re.compile(re.escape(section) + r"sub([0-9A-F]{1,2})", re.IGNORECASE)
        matches = ((pattern.fullmatch(name), name) for name in self.ini.sections())
        return sorted((int(match.group(1), 16), name) for match, name in matches if match)

    def entry(self, section: str) -> Entry:
        """One object."""
        index = int(section, 16)
        kind = self.number(section, "ObjectType", "0x7")
        label = self.text(section, "ParameterName")
        if kind in (VAR, DOMAIN):
            return Entry(index, label, VAR, (self.value(section, index, 0),))
        if kind not in (ARRAY, RECORD):
            raise EdsError(f"[{section}] ObjectType=0x{kind:X} is not supported")
        subs = self.subs(section)
        declared = self.number(section, "SubNumber")
        if declared != len(subs):
            raise EdsError(
                f"[{section}] SubNumber={declared}, but there are {len(subs)} sub-indices"
            )
        values = tuple(self.value(name, index, sub) for sub, name in subs)
        self.check_shape(section, kind, values)
        return Entry(index, label, kind, values)

    @staticmethod
    def check_shape(section: str, kind: int, values: tuple[Value, ...]) -> None:
        """Sub 0 counts; an ARRAY is one type without gaps."""
        if len(values) < 2 or values[0].sub != 0 or values[0].data_type != 0x05:
            raise EdsError(f"[{section}] needs an UNSIGNED8 sub-index 0 and at least one more")
        if kind == ARRAY:
            if any(value.data_type != values[1].data_type for value in values[1:]):
                raise EdsError(f"[{section}] is an ARRAY of several data types")
            if values[1].data_type not in NUMBERS:
                raise EdsError(f"[{section}] is an ARRAY of something else than numbers")
            if [value.sub for value in values] != list(range(len(values))):
                raise EdsError(f"[{section}] is an ARRAY with gaps")

    def entries(self) -> list[Entry]:
        """All objects in rising order, checked against the lists of supported objects."""
        found = {
            int(name, 16): name
            for name in self.ini.sections()
            if re.fullmatch(r"[0-9A-Fa-f]{4}", name)
        }
        listed: set[int] = set()
        for name in LISTS:
            for i in range(1, self.number(name, "SupportedObjects") + 1):
                listed.add(self.number(name, str(i)))
        for index in sorted(listed ^ set(found)):
            what = "is listed but missing" if index in listed else "is in no list of objects"
            raise EdsError(f"[{index:04X}] {what}")
        for name in self.ini.sections():
            sub = re.fullmatch(r"([0-9A-Fa-f]{4})sub[0-9A-Fa-f]+", name)
            if sub and int(sub.group(1), 16) not in found:
                raise EdsError(f"[{name}] belongs to no object")
        return [self.entry(found[index]) for index in sorted(found)]
