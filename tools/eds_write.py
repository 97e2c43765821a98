# SPDX-License-Identifier: MIT
"""From objects to the C text of a dictionary: struct, defaults, table, macros."""

from __future__ import annotations

from eds_model import (
    ARRAY,
    DOMAIN_TYPE,
    NUMBERS,
    OTHERS,
    RECORD,
    VAR,
    VISIBLE_STRING,
    EdsError,
    Entry,
    NumberType,
    Value,
    snake,
)


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
