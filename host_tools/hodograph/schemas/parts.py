# SPDX-License-Identifier: MIT
"""Parts of JSON schemas: each function makes the schema of one kind of value, with its description. Used by schemas/.
No I/O.

Two are different. `described` completes a schema that it gets, and writes the default into it. `only_with` makes a
condition, without a description. All but `described` are pure.
"""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]


def number(text: str, low: float, high: float, default: float | None = None) -> Schema:
    """A number in a range, both ends included."""
    return described({"type": "number", "minimum": low, "maximum": high}, text, default)


def integer(text: str, low: int, high: int, default: int | None = None) -> Schema:
    """A whole number in a range, both ends included."""
    return described({"type": "integer", "minimum": low, "maximum": high}, text, default)


def choice(text: str, words: tuple[Any, ...], default: Any = None) -> Schema:
    """One of these words."""
    return described({"enum": list(words)}, text, default)


def flag(text: str, default: bool | None = None) -> Schema:
    """true or false."""
    return described({"type": "boolean"}, text, default)


def text(text: str) -> Schema:
    """A text that is not empty."""
    return {"type": "string", "pattern": r"\S", "description": text}


def either(text: str, *schemas: Schema) -> Schema:
    """A value by one of these schemas."""
    return {"anyOf": list(schemas), "description": text}


def list_of(
    text: str, item: Schema, least: int = 1, most: int | None = None, *, distinct: bool = False
) -> Schema:
    """A list of `least` to `most` items (None: any number); `distinct`: all different."""
    found = {"type": "array", "items": item, "minItems": least, "description": text}
    if most is not None:
        found["maxItems"] = most
    if distinct:
        found["uniqueItems"] = True
    return found


def vector(text: str, least: int, most: int, low: float, high: float) -> Schema:
    """A list of numbers from `low` to `high`."""
    return list_of(text, {"type": "number", "minimum": low, "maximum": high}, least, most)


def table(
    text: str,
    properties: dict[str, Schema],
    required: tuple[str, ...] = (),
    more: Schema | None = None,
) -> Schema:
    """A table with these keys only; `more`: further conditions."""
    found: Schema = {
        "type": "object",
        "description": text,
        "properties": properties,
        "additionalProperties": False,
    }
    return found | ({"required": list(required)} if required else {}) | (more or {})


def table_or_list(text: str, table: Schema, tables: Schema) -> Schema:
    """One schema in place of a choice of two, so that editors mark the wrong key and not the whole table. Conditions on
    a list and conditions on a table may stand side by side, except for those that combine other schemas.
    """
    combining = {key: table[key] for key in ("oneOf", "allOf") if key in table}
    plain = {key: each for key, each in table.items() if key not in combining}
    of_table = {"if": {"type": "object"}, "then": combining}
    return plain | tables | of_table | {"type": ["object", "array"], "description": text}


def described(found: Schema, text: str, default: Any) -> Schema:
    """A schema with its description, and its default if there is one."""
    if default is not None:
        found["default"] = default
    return found | {"description": text}


def number_or_vector(text: str, least: int, most: int, low: float, high: float) -> Schema:
    """One number, or a list of numbers, from `low` to `high`."""
    one = {"type": "number", "minimum": low, "maximum": high}
    many = {"type": "array", "items": one, "minItems": least, "maxItems": most}
    return {"anyOf": [one, many], "description": text}


def only_with(keys: tuple[str, ...], condition: Schema) -> Schema:
    """These keys need `condition`."""
    return {"if": {"anyOf": [{"required": [key]} for key in keys]}, "then": condition}
