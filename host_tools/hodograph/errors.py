# SPDX-License-Identifier: MIT
"""Everything that can go wrong, as one tree of exceptions. Used by many modules of host_tools. No I/O.

A message is one line: what is wrong, where, and what to do. Only `hodograph.cli.main` turns an
exception into a line on stderr and an exit status; the table of statuses is docs/reference/cli.md.
"""


class HodographError(Exception):
    """Base of all errors that Hodograph reports on purpose."""

    exit_status = 1


class InputError(HodographError):
    """A file, a key, a value or the command line is wrong."""

    exit_status = 2


class ToolpathError(InputError):
    """A toolpath file cannot be read further; the message begins with FILE:LINE:COLUMN, both from 1."""

    def __init__(self, file: str, line: int, column: int, text: str) -> None:
        super().__init__(f"{file}:{line}:{column}: {text}")
        self.file = file
        self.line = line
        self.column = column


class PlanError(HodographError):
    """The input is well formed, but the path or the requested feed is not possible."""

    exit_status = 3


class SectionPlanError(PlanError):
    """A section of a toolpath cannot be planned at this line. The plan of the job, which knows the file, adds it."""

    def __init__(self, line: int, text: str) -> None:
        super().__init__(f"line {line}: {text}")
        self.line = line
        self.text = text


class BusError(HodographError):
    """No bus, no node that answers, or an answer that breaks the protocol."""

    exit_status = 4


class BusyError(BusError):
    """Another SDO client uses the node."""


class RefusedError(HodographError):
    """The controller refused a program, a command or a setting."""

    exit_status = 5


class RunError(HodographError):
    """A fault in motion, an incomplete recording, or results that disagree."""

    exit_status = 6


class LimitError(HodographError):
    """A program goes beyond the limits that it was checked with."""

    exit_status = 7


INTERRUPTED_EXIT_STATUS = 130
"""Exit status after Ctrl-C (128 + SIGINT), as shells have it."""


def brief(text: str) -> str:
    """Text of a file, to be quoted within a message: its first 40 characters, printable and on one line."""
    line = "".join(each if each.isprintable() else "?" for each in " ".join(text[:400].split()))
    return line if len(line) <= 40 else line[:37] + "..."


def one_line(error: Exception) -> str:
    """An error of another library, as one line to be quoted within a message."""
    return " ".join(str(error).split()) or type(error).__name__
