# SPDX-License-Identifier: MIT
"""The parser of the command line: one sub-command for each task, usage errors as InputError. Used by cli/main and
cli/completion. `--help` prints and ends the process; no other I/O.
"""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Sequence
from functools import cache
from typing import Any, NoReturn

from .. import __version__
from ..errors import InputError
from . import arguments

DESCRIPTION = (
    "From a control polygon to encoder counts: jerk-limited motion on PH splines over CAN."
)
EPILOG = (
    "exit status: 0 done, 1 internal or build, 2 wrong input, 3 path or feed not possible, 4 bus or node, "
    "5 refused by the controller, 6 run failed, 7 limits exceeded, 130 interrupted (docs/reference/cli.md)"
)


EVERYWHERE = (
    (("-q", "--quiet"), "nothing on stderr but errors"),
    (("--no-progress",), "no progress on stderr"),
    (("--debug",), "show tracebacks (or HODOGRAPH_DEBUG=1)"),
)
"""Options that may stand before or after the command."""


class _Parser(argparse.ArgumentParser):
    """Raises InputError with one line instead of printing usage."""

    def error(self, message: str) -> NoReturn:
        match = re.match(r"argument COMMAND: invalid choice: '(.*?)' \(choose from (.*)\)", message)
        if match:
            names = re.findall(r"[\w-]+", match[2])
            near = difflib.get_close_matches(match[1], names, n=1)
            advice = f'did you mean "{near[0]}"?' if near else "one of: " + ", ".join(names)
            message = f'there is no command "{match[1]}"; {advice}'
        raise InputError(f"{message} (see {self.prog} --help)")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """As argparse, but unknown options of a command are refused here, where its options are known."""
        found, unknown = super().parse_known_args(args, namespace)
        if unknown:
            self.error(f"unknown argument: {' '.join(unknown)}{self._advice(unknown)}")
        return found, unknown

    def _advice(self, unknown: Sequence[str]) -> str:
        """The error for unknown options, with the option most similar to the first."""
        option = next((word for word in unknown if word.startswith("-")), "").partition("=")[0]
        near = difflib.get_close_matches(option, list(self._option_string_actions), n=1)
        return f'; did you mean "{near[0]}"?' if near else ""


@cache
def make_parser() -> argparse.ArgumentParser:
    """The whole command line, made once for all calls of `main` in a process."""
    parser = _Parser(prog="hodograph", description=DESCRIPTION, epilog=EPILOG)
    parser.add_argument("--version", action="version", version=f"hodograph {__version__}")
    everywhere = _Parser(add_help=False)
    for names, text in EVERYWHERE:
        parser.add_argument(*names, action="store_true", help=text)
        everywhere.add_argument(
            *names, action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
        )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)

    def command(name: str, text: str) -> argparse.ArgumentParser:
        return commands.add_parser(
            name, help=text, description=f"{text[:1].upper()}{text[1:]}.", parents=[everywhere]
        )

    for add in arguments.ALL:
        add(command)
    return parser
