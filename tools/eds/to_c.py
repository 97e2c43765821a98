# SPDX-License-Identifier: MIT
"""Makes the C tables of an object dictionary from its EDS file (CiA 306). Run by `make build` and dist/programs.py.
Reads FILE.eds and two templates, writes both files.

    python -m eds.to_c FILE.eds NAME OUTDIR    ->  OUTDIR/od_NAME.h and OUTDIR/od_NAME.c

They hold `struct od_NAME` (a typed field for each value), `od_NAME_defaults`, `od_NAME_table` (see
firmware/canopen/od.h), `od_NAME_set_node` (adds the node id where the EDS says $NODEID) and a macro
for each index and for each sub-index of a record. The output depends on the input only. A faulty EDS
gives one line on stderr and exit status 2, and no output.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from canopen.objectdictionary import ODArray, ODRecord, datatypes
from jinja2 import Environment, FileSystemLoader, StrictUndefined

from .reading import NUMBERS, OTHERS, EdsError, NumberType, default_of, read, values_of

_STRING_ROOM = 32
"""Least bytes of a string that can be written."""
_KEYWORDS = {
    *(
        "auto",
        "break",
        "case",
        "char",
        "const",
        "continue",
        "default",
        "do",
        "double",
        "else",
        "enum",
    ),
    *(
        "extern",
        "float",
        "for",
        "goto",
        "if",
        "inline",
        "int",
        "long",
        "register",
        "restrict",
        "return",
    ),
    *(
        "short",
        "signed",
        "sizeof",
        "static",
        "struct",
        "switch",
        "typedef",
        "union",
        "unsigned",
        "void",
    ),
    *("volatile", "while"),
}


@dataclass(frozen=True)
class Value:
    """A row of the table of entries. `member`: its place in the struct, empty for a DOMAIN; `limits`: C constants."""

    index: int
    sub: int
    name: str
    member: str
    declaration: str
    initial: str
    size: int
    type: str
    access: str
    uses_node_id: bool
    limits: tuple[str, str] | None


@dataclass(frozen=True)
class Object:
    """An object of the dictionary with its field in the struct and its macro."""

    index: int
    label: str
    field: str
    macro: str
    is_record: bool
    declarations: tuple[str, ...]
    values: tuple[Value, ...]


def snake_case(label: str, where: str) -> str:
    """A C identifier for a ParameterName; `where` is its section, for the error text."""
    name = re.sub(r"[^0-9a-z]+", "_", label.lower()).strip("_")
    if not name:
        raise EdsError(f"[{where}] ParameterName '{label}' gives no C name")
    if name[0].isdigit():
        name = "n_" + name
    return name + "_" if name in _KEYWORDS else name


def literal(value: int, kind: NumberType) -> str:
    """A C constant of the type."""
    if kind.bits < 32:
        return str(value)
    macro = f"{'' if kind.signed else 'U'}INT{kind.bits}_C"
    if kind.signed and value == kind.bounds()[0]:
        return f"({macro}({value + 1}) - 1)"
    return f"{macro}({value})"


def _size(variable: Any) -> int:
    """Bytes as in struct od_entry: of a string its room, of a DOMAIN 0."""
    if variable.data_type in NUMBERS:
        return NUMBERS[variable.data_type].bits // 8
    if variable.data_type == datatypes.DOMAIN:
        return 0
    return max(len(bytes(default_of(variable))), _STRING_ROOM if variable.writable else 0, 1)


def _declaration(variable: Any, name: str) -> str:
    """The field of a value; nothing for a DOMAIN."""
    if variable.data_type == datatypes.DOMAIN:
        return ""
    if variable.data_type in NUMBERS:
        return f"{NUMBERS[variable.data_type].c_type} {name}"
    if variable.data_type == datatypes.VISIBLE_STRING:
        return f"char {name}[{_size(variable) + 1}]"
    return f"uint8_t {name}[{_size(variable)}]"


def _initial(variable: Any) -> str:
    """The default as C initialiser."""
    default = default_of(variable)
    if isinstance(default, int):
        return literal(default, NUMBERS[variable.data_type])
    if variable.data_type == datatypes.VISIBLE_STRING:
        return f'"{default.decode("ascii")}"'
    return "{" + ", ".join(f"0x{byte:02X}" for byte in default or b"\0") + "}"


def _access(variable: Any) -> str:
    flags = (
        ("OD_READ", variable.readable),
        ("OD_WRITE", variable.writable),
        ("OD_MAPPABLE", variable.pdo_mappable),
    )
    return " | ".join(flag for flag, is_set in flags if is_set)


def _limits(variable: Any) -> tuple[str, str] | None:
    if variable.min is None and variable.max is None:
        return None
    if variable.data_type == datatypes.UNSIGNED64:
        raise EdsError(f"[{variable.index:04X}] limits of UNSIGNED64 are not supported")
    low, high = NUMBERS[variable.data_type].bounds()
    wide = NUMBERS[datatypes.INTEGER64]
    return (
        literal(low if variable.min is None else variable.min, wide),
        literal(high if variable.max is None else variable.max, wide),
    )


def _value(variable: Any, name: str, member: str) -> Value:
    kind = NUMBERS.get(variable.data_type)
    if variable.relative and kind is not None and kind.bits < 32:
        raise EdsError(f"[{variable.index:04X}] $NODEID needs a 32-bit value")
    return Value(
        index=variable.index,
        sub=variable.subindex,
        name=name,
        member="" if variable.data_type == datatypes.DOMAIN else member,
        declaration=_declaration(variable, name),
        initial=_initial(variable),
        size=_size(variable),
        type=kind.name if kind else OTHERS[variable.data_type],
        access=_access(variable),
        uses_node_id=variable.relative and kind is not None,
        limits=_limits(variable) if kind else None,
    )


def _object(entry: Any, name: str) -> Object:
    """An object of the dictionary `name`."""
    field = snake_case(entry.name, f"{entry.index:04X}")
    variables = values_of(entry)
    if isinstance(entry, ODArray):
        count, first = f"{field}_count", variables[1]
        values = [_value(v, field, f"{field}[{v.subindex - 1}]") for v in variables[1:]]
        values.insert(0, _value(variables[0], count, count))
        lines = [values[0].declaration, _declaration(first, f"{field}[{len(variables) - 1}]")]
    elif isinstance(entry, ODRecord):
        names = [
            snake_case(v.name, f"{v.index:04X}sub{v.subindex:X}") if v.subindex else "count"
            for v in variables
        ]
        values = [
            _value(v, each, f"{field}.{each}") for v, each in zip(variables, names, strict=True)
        ]
        lines = [value.declaration for value in values]
    else:
        values = [_value(entry, field, field)]
        lines = [values[0].declaration]
    return Object(
        index=entry.index,
        label=entry.name,
        field=field,
        macro=f"OD_{name}_{field}".upper(),
        is_record=isinstance(entry, ODRecord),
        declarations=tuple(filter(None, lines)),
        values=tuple(values),
    )


def _check_names(objects: Sequence[Object]) -> None:
    """No two C names may be the same."""
    fields: set[str] = set()
    macros: set[str] = set()
    for each in objects:
        counts = [] if each.is_record else [value.name for value in each.values[:1]]  # of an ARRAY
        for field in dict.fromkeys([each.field, *counts]):
            if field in fields:
                raise EdsError(f"[{each.index:04X}] the C name '{field}' is taken")
            fields.add(field)
        subs = [f"{each.macro}_{value.name}".upper() for value in each.values[1:] if each.is_record]
        for macro in (each.macro, *subs):
            if macro in macros:
                raise EdsError(f"the C macro '{macro}' would be defined twice")
            macros.add(macro)


def generate(eds: Path, name: str) -> tuple[str, str]:
    """Header and source text for the dictionary in `eds`. Raises EdsError."""
    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise EdsError(f"'{name}' cannot be part of a C name")
    objects = [_object(entry, name) for entry in read(eds).objects.values()]
    _check_names(objects)
    templates = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        undefined=StrictUndefined,
    )
    header, source = (
        templates.get_template(template).render(
            name=name,
            source=eds.name,
            objects=objects,
            values=[value for each in objects for value in each.values],
        )
        for template in ("od.h.j2", "od.c.j2")
    )
    return header, source


def main(arguments: list[str]) -> int:
    """Command line; returns the exit status."""
    if len(arguments) != 3:
        print("usage: python -m eds.to_c FILE.eds NAME OUTDIR", file=sys.stderr)
        return 2
    eds, name, out = Path(arguments[0]), arguments[1], Path(arguments[2])
    try:
        header, source = generate(eds, name)
    except EdsError as error:
        print(f"eds.to_c: {eds}: {error}", file=sys.stderr)
        return 2
    try:
        out.mkdir(parents=True, exist_ok=True)
        (out / f"od_{name}.h").write_text(header, encoding="utf-8")
        (out / f"od_{name}.c").write_text(source, encoding="utf-8")
    except OSError as error:
        print(f"eds.to_c: {out}: cannot be written: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
