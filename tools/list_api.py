#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""list_api.py [--check]: docs/reference/python-api.md, the public Python names, from their docstrings.

Run by `make options`. Writes this page only.

With --check nothing is written; the exit status is 1 when the page is not the one that would be written.
"""

from __future__ import annotations

import dataclasses
import inspect
import sys
from collections.abc import Iterator

import hodograph
from generated_page import REFERENCE, cell, write_or_check

PAGE = REFERENCE / "python-api.md"
HEAD = """# Python API

Generated from the docstrings by `make options`; do not edit. The [tutorial](../start/tutorial.md) shows how the names
work together.

    import hodograph as hg

**Public** are the names on this page, as attributes of the package `hodograph`, with their members and parameters.
Everything else is private, also where its name has no underscore: modules below `hodograph`, and what they hold.

**Stability.** Versions are MAJOR.MINOR.PATCH. Before 1.0 a new MINOR may change a public name, and CHANGELOG.md says
so. From 1.0 on only a new MAJOR removes or changes one, after a MINOR in which it gave a DeprecationWarning. New names,
new parameters with a default, and new keys of dictionaries may come with every MINOR. Texts of messages may change at
any time. A new version may make another program of the same input; its limits are kept as before.

**Conventions.** Lengths are in mm, times in s; other units are in the names. Arrays are NumPy's, of float64 unless said
otherwise. Points have one row each: (n, A) for A path axes. A `kernel` is "fixed", "float" or "double". Objects are
immutable. Importing the package takes some milliseconds; a module is loaded when one of its names is first used.
Objects on a bus belong to the thread that made them; the rest may be shared.
"""


def body(subject: object) -> str:
    """A docstring, its examples fenced, its tables kept in their columns."""
    lines: list[str] = []
    for paragraph in inspect.cleandoc(subject.__doc__ or "").split("\n\n"):
        if paragraph.startswith(">>>"):
            lines += ["```python", *paragraph.splitlines(), "```", ""]
        elif "  " in paragraph:
            lines += ["```text", *paragraph.splitlines(), "```", ""]
        else:
            lines += [paragraph, ""]
    return "\n".join(lines)


def first(subject: object) -> str:
    """The first paragraph of a docstring."""
    return cell(inspect.cleandoc(subject.__doc__ or "").split("\n\n")[0])


def parameters(subject: object, *, bound: bool) -> str:
    """The signature without annotations."""
    signature = inspect.signature(subject)  # type: ignore[arg-type]
    kept = [
        one.replace(annotation=inspect.Parameter.empty)
        for one in signature.parameters.values()
        if not (bound and one.name in ("self", "cls"))
    ]
    return str(signature.replace(parameters=kept, return_annotation=inspect.Signature.empty))


def members(owner: type) -> Iterator[tuple[str, str, object]]:
    """Public members: how they are written, and what they are, the object with the docstring."""
    for name, found in vars(owner).items():
        if name.startswith("_"):
            continue
        if isinstance(found, classmethod):
            written = f"{owner.__name__}.{name}{parameters(found.__func__, bound=True)}"
            yield written, "function", found.__func__
        elif isinstance(found, property):
            yield name, "attribute", found
        elif inspect.isfunction(found):
            yield f"{name}{parameters(found, bound=True)}", "method", found


def fields(owner: type) -> Iterator[str]:
    """Public fields of a dataclass."""
    if dataclasses.is_dataclass(owner):
        for one in dataclasses.fields(owner):
            if not one.name.startswith("_"):
                yield one.name


def section(name: str) -> Iterator[str]:
    """The lines of one public name."""
    subject = getattr(hodograph, name)
    if not inspect.isclass(subject):
        yield f"\n## hg.{name}\n"
        yield f"`{name}{parameters(subject, bound=False)}`\n"
        yield body(subject)
        return
    yield f"\n## hg.{name}\n"
    yield body(subject)
    given = list(fields(subject))
    if given:
        yield "Fields: " + ", ".join(f"`{one}`" for one in given) + ".\n"
    found = list(members(subject))
    if found:
        yield "| member | meaning |"
        yield "| --- | --- |"
        for written, _, member in found:
            yield f"| `{cell(written)}` | {first(member)} |"
    for written, kind, member in found:
        if kind != "attribute" and "\n\n" in inspect.cleandoc(member.__doc__ or ""):
            yield f"\n### {written.split('(')[0].split('.')[-1]}\n"
            yield body(member)


def page() -> str:
    """The whole page."""
    names = [name for name in hodograph.__all__ if not name.startswith("__")]
    errors = [name for name in names if name.endswith("Error")]
    lines = [HEAD.rstrip()]
    for name in names:
        if name not in errors:
            lines += section(name)
    lines.append("\n## Errors\n")
    lines.append(
        "All are below `hg.HodographError`. Their text is one line: what, where, what to do.\n"
    )
    lines += ["| error | meaning |", "| --- | --- |"]
    lines += [f"| `hg.{name}` | {first(getattr(hodograph, name))} |" for name in errors]
    text = "\n".join(line.rstrip() for line in "\n".join(lines).splitlines())
    while "\n\n\n" in text:
        text = text.replace("\n\n\n", "\n\n")
    return text + "\n"


def main() -> int:
    """Writes or compares the page."""
    return write_or_check(PAGE, page(), __doc__)


if __name__ == "__main__":
    sys.exit(main())
