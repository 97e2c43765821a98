#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""list_options.py [--check]: docs/reference/options.md, the options of every command, from the command line itself.

Run by `make options`. Writes this page only.

With --check nothing is written; the exit status is 1 when the page is not the one that would be written.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator

from generated_page import REFERENCE, cell, write_or_check
from hodograph.cli.parser import EVERYWHERE, make_parser

PAGE = REFERENCE / "options.md"
HEAD = """# Options of every command

Generated from the command line by `make options`; do not edit. [cli.md](cli.md) explains the commands.
Every command also takes `-h`, and, before or after its name:

| option | meaning |
| --- | --- |
"""


def name_of(action: argparse.Action) -> str:
    """How an option or a file is written on the command line."""
    metavar = action.metavar
    if isinstance(metavar, tuple):
        value = " ".join(metavar)
    elif action.choices is not None:
        value = "{" + ",".join(str(choice) for choice in action.choices) + "}"
    else:
        value = metavar or action.dest.upper()
    if action.nargs in ("+", "*"):
        value += " …"
    if not action.option_strings:
        return value
    names = ", ".join(action.option_strings)
    return names if action.nargs == 0 else f"{names} {value}"


def help_of(action: argparse.Action, command: str) -> str:
    """The help text with its default."""
    values = dict(vars(action), prog=f"hodograph {command}")
    return (action.help or "") % values


def section(command: str, purpose: str, parser: argparse.ArgumentParser) -> Iterator[str]:
    """The lines of one command."""
    yield f"\n## {command}\n"
    yield f"{cell(purpose[:1].upper() + purpose[1:])}.\n"
    yield "| argument | meaning |"
    yield "| --- | --- |"
    for action in parser._actions:
        if action.dest != "help" and action.help != argparse.SUPPRESS:
            yield f"| `{cell(name_of(action))}` | {cell(help_of(action, command))} |"


def page() -> str:
    """The whole page."""
    lines = [HEAD.rstrip(), *(f"| `{', '.join(names)}` | {text} |" for names, text in EVERYWHERE)]
    for action in make_parser()._actions:
        if isinstance(action, argparse._SubParsersAction):
            purposes = {choice.dest: choice.help or "" for choice in action._choices_actions}
            for command, parser in action.choices.items():
                lines += section(command, purposes[command], parser)
    return "\n".join(lines) + "\n"


def main() -> int:
    """Writes or compares the page."""
    return write_or_check(PAGE, page(), __doc__)


if __name__ == "__main__":
    sys.exit(main())
