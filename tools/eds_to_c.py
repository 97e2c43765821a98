#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Makes the C tables of an object dictionary from its EDS file (CiA 306).

    eds_to_c.py FILE.eds NAME OUTDIR    ->  OUTDIR/od_NAME.h and OUTDIR/od_NAME.c

They hold `struct od_NAME` (a typed field for each value), `od_NAME_defaults`, `od_NAME_table` (see
firmware/canopen/od.h), `od_NAME_set_node` (adds the node id where the EDS says $NODEID) and a macro
for each index and for each sub-index of a record. The output depends on the input only. A faulty EDS
gives one line on stderr and exit status 2, and no output.
"""

from __future__ import annotations

import configparser
import re
import sys
from dataclasses import dataclass
from pathlib import Path

VAR, DOMAIN, ARRAY, RECORD = 0x7, 0x2, 0x8, 0x9
VISIBLE_STRING, OCTET_STRING, DOMAIN_TYPE = 0x09, 0x0A, 0x0F
STRING_ROOM = 32
LISTS = ("MandatoryObjects", "OptionalObjects", "ManufacturerObjects")
ACCESS = {
    "ro": "OD_READ",
    "const": "OD_READ",
    "wo": "OD_WRITE",
    "rw": "OD_READ | OD_WRITE",
    "rwr": "OD_READ | OD_WRITE",
    "rww": "OD_READ | OD_WRITE",
}
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


class Writer:
    """Writes the C text for the objects of one dictionary."""

    def __init__(self, name: str, source: str, entries: list[Entry]) -> None:
        self.name = name
        self.source = source
        self.entries = entries
        self.check_names()

    def check_names(self) -> None:
        """No two C names may be the same."""
        fields: set[str] = set()
        for entry in self.entries:
            field = snake(entry.label, f"{entry.index:04X}")
            names = [field, field + "_count"] if entry.kind == ARRAY else [field]
            for each in names:
                if each in fields:
                    raise EdsError(f"[{entry.index:04X}] the C name '{each}' is taken")
                fields.add(each)
        macros = [line.split()[1] for line in self.macros()]
        for macro in macros:
            if macros.count(macro) > 1:
                raise EdsError(f"the C macro '{macro}' would be defined twice")

    def member(self, entry: Entry, value: Value) -> str:
        """Where a value lies in the struct."""
        field = snake(entry.label, f"{entry.index:04X}")
        if entry.kind == VAR:
            return field
        if entry.kind == ARRAY:
            return f"{field}_count" if value.sub == 0 else f"{field}[{value.sub - 1}]"
        return f"{field}.{self.record_member(value)}"

    @staticmethod
    def record_member(value: Value) -> str:
        """Name of a sub-index inside its record."""
        where = f"{value.index:04X}sub{value.sub:X}"
        return "count" if value.sub == 0 else snake(value.label, where)

    @staticmethod
    def declaration(value: Value, member: str) -> list[str]:
        """The field of a value; none for a DOMAIN."""
        if value.data_type == DOMAIN_TYPE:
            return []
        if value.data_type in NUMBERS:
            return [f"{NUMBERS[value.data_type].c_type} {member};"]
        if value.data_type == VISIBLE_STRING:
            return [f"char {member}[{value.size + 1}];"]
        return [f"uint8_t {member}[{value.size}];"]

    def fields(self, entry: Entry) -> list[str]:
        """The fields of an object."""
        field = snake(entry.label, f"{entry.index:04X}")
        if entry.kind == VAR:
            return self.declaration(entry.values[0], field)
        if entry.kind == ARRAY:
            c_type = NUMBERS[entry.values[1].data_type].c_type
            return [f"uint8_t {field}_count;", f"{c_type} {field}[{len(entry.values) - 1}];"]
        inner = [
            "    " + line
            for value in entry.values
            for line in self.declaration(value, self.record_member(value))
        ]
        return ["struct {", *inner, f"}} {field};"]

    def macros(self) -> list[str]:
        """Macros of indices, and of sub-indices of records."""
        lines = []
        for entry in self.entries:
            stem = f"OD_{self.name}_{snake(entry.label, f'{entry.index:04X}')}".upper()
            lines.append(f"#define {stem} 0x{entry.index:04X}u")
            if entry.kind == RECORD:
                lines += [
                    f"#define {stem}_{self.record_member(value).upper()} {value.sub}u"
                    for value in entry.values[1:]
                ]
        return lines

    def header(self) -> str:
        """Text of od_NAME.h."""
        guard = f"OD_{self.name}_H".upper()
        lines = [
            f"/* Made by tools/eds_to_c.py from {self.source}: do not edit. */",
            f"#ifndef {guard}",
            f"#define {guard}",
            "",
            "#include <stdint.h>",
            "",
            '#include "canopen/od.h"',
            "",
            f"struct od_{self.name} {{",
        ]
        for entry in self.entries:
            lines.append(f"    /* 0x{entry.index:04X} {entry.label} */")
            lines += ["    " + line for line in self.fields(entry)]
        lines += [
            "};",
            "",
            f"extern const struct od_{self.name} od_{self.name}_defaults;",
            f"extern const struct od_table od_{self.name}_table;",
            "",
            "/* Sets the values that depend on the node id (COB-IDs) to their defaults for `node`. */",
            f"void od_{self.name}_set_node(struct od_{self.name} *values, uint8_t node);",
            "",
            *self.macros(),
            "",
            "#endif",
        ]
        return "\n".join(lines) + "\n"

    @staticmethod
    def literal(value: int, kind: NumberType) -> str:
        """A C constant of the type."""
        low, _ = kind.bounds()
        if kind.bits < 32:
            return str(value)
        macro = f"{'' if kind.signed else 'U'}INT{kind.bits}_C"
        if kind.signed and value == low:
            return f"({macro}({value + 1}) - 1)"
        return f"{macro}({value})"

    def initial(self, value: Value) -> str:
        """The default as C initialiser."""
        if isinstance(value.default, int):
            return self.literal(value.default, NUMBERS[value.data_type])
        if value.data_type == VISIBLE_STRING:
            return '"' + value.default.decode("ascii") + '"'
        return "{" + ", ".join(f"0x{byte:02X}" for byte in value.default or b"\0") + "}"

    def pairs(self) -> list[tuple[Entry, Value]]:
        """All entries with their objects, in order."""
        return [(entry, value) for entry in self.entries for value in entry.values]

    def table_row(self, entry: Entry, value: Value) -> str:
        """One struct od_entry."""
        offset = "0"
        if value.data_type != DOMAIN_TYPE:
            offset = f"(uint32_t)offsetof(struct od_{self.name}, {self.member(entry, value)})"
        kind = NUMBERS.get(value.data_type)
        type_name = kind.name if kind else OTHERS[value.data_type]
        access = value.access + (" | OD_MAPPABLE" if value.mappable else "")
        return (
            f"    {{{offset}, 0x{value.index:04X}, {value.size}, "
            f"0x{value.sub:02X}, {type_name}, {access}}},"
        )

    def range_rows(self) -> list[str]:
        """struct od_range of each value that has a limit."""
        rows = []
        wide = NUMBERS[0x15]
        for _, value in self.pairs():
            if value.low is None and value.high is None:
                continue
            if value.data_type == 0x1B:
                raise EdsError(f"[{value.index:04X}] limits of UNSIGNED64 are not supported")
            low, high = NUMBERS[value.data_type].bounds()
            low = low if value.low is None else value.low
            high = high if value.high is None else value.high
            rows.append(
                f"    {{{self.literal(low, wide)}, {self.literal(high, wide)}, "
                f"0x{value.index:04X}, 0x{value.sub:02X}}},"
            )
        return rows

    def source_text(self) -> str:
        """Text of od_NAME.c."""
        rows = [self.table_row(entry, value) for entry, value in self.pairs()]
        ranges = self.range_rows()
        lines = [
            f"/* Made by tools/eds_to_c.py from {self.source}: do not edit. */",
            f'#include "od_{self.name}.h"',
            "",
            "#include <stddef.h>",
            "",
            f"const struct od_{self.name} od_{self.name}_defaults = {{",
        ]
        lines += [
            f"    .{self.member(entry, value)} = {self.initial(value)},"
            for entry, value in self.pairs()
            if value.data_type != DOMAIN_TYPE
        ]
        lines += ["};", "", "static const struct od_entry entries[] = {", *rows, "};", ""]
        if ranges:
            lines += ["static const struct od_range ranges[] = {", *ranges, "};", ""]
        lines += [
            f"const struct od_table od_{self.name}_table = {{",
            "    .entries = entries,",
            f"    .ranges = {'ranges' if ranges else 'NULL'},",
            f"    .entry_count = {len(rows)},",
            f"    .range_count = {len(ranges)},",
            f"    .storage_size = (uint32_t)sizeof(struct od_{self.name}),",
            "};",
            "",
            *self.set_node(),
        ]
        return "\n".join(lines) + "\n"

    def set_node(self) -> list[str]:
        """The function that adds the node id."""
        body = []
        for entry, value in self.pairs():
            if not value.uses_node_id:
                continue
            kind = NUMBERS[value.data_type]
            constant = self.initial(value)
            if kind.bits < 32:
                raise EdsError(f"[{value.index:04X}] $NODEID needs a 32-bit value")
            body.append(f"    values->{self.member(entry, value)} = {constant} + node;")
        if not body:
            body = ["    (void)values;", "    (void)node;"]
        head = f"void od_{self.name}_set_node(struct od_{self.name} *values, uint8_t node)"
        return [head, "{", *body, "}"]


def generate(eds: Path, name: str) -> tuple[str, str]:
    """Header and source text for the dictionary in `eds`. Raises EdsError."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise EdsError(f"'{name}' cannot be part of a C name")
    try:
        text = eds.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise EdsError(f"cannot be read: {error}") from error
    writer = Writer(name, eds.name, Reader(text).entries())
    return writer.header(), writer.source_text()


def main(arguments: list[str]) -> int:
    """Command line; returns the exit status."""
    if len(arguments) != 3:
        print("usage: eds_to_c.py FILE.eds NAME OUTDIR", file=sys.stderr)
        return 2
    eds, name, out = Path(arguments[0]), arguments[1], Path(arguments[2])
    try:
        header, source = generate(eds, name)
    except EdsError as error:
        print(f"eds_to_c: {eds}: {error}", file=sys.stderr)
        return 2
    out.mkdir(parents=True, exist_ok=True)
    (out / f"od_{name}.h").write_text(header, encoding="utf-8")
    (out / f"od_{name}.c").write_text(source, encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
