# SPDX-License-Identifier: MIT
"""Man pages of the C programs, from what they print for --help, so that both say the same. Standard library only. Used
by dist/install. Starts each program with --help.
"""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

PURPOSE = {
    "hodograph-bridge": "join a board, emulated or real, to a CAN bus of Linux",
    "hodograph-controller": "motion controller as a CANopen node",
    "hodograph-drive": "simulated CiA 402 servo drives",
    "hodograph-hub": "CAN bus for the processes of one computer",
    "hodograph-injector": "pass frames between two CAN buses and inject faults",
}
"""One line for each program, as apropos(1) prints it."""


def program_page(program: Path, version: str) -> bytes | None:
    """The page in man(7) macros; None where the program does not run here, as one for another processor."""
    try:
        said = subprocess.run([program, "--help"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return None
    return page_of_help(program.name, said.stdout, version).encode()


def page_of_help(name: str, help_text: str, version: str) -> str:
    """A page of a help that begins with "usage:"; indented lines are options, kept as they stand."""
    usage, *blocks = re.split(r"\n\s*\n", help_text.strip("\n"))
    synopsis = re.sub(r"(?m)^(usage:|      ) ", "", usage)
    lines = [
        f'.TH {name.upper()} 1 "" "Hodograph {version}" "Hodograph"',
        *(".SH NAME", f"{_escaped(name)} \\- {_escaped(PURPOSE[name])}"),
        *(".SH SYNOPSIS", *_as_it_stands(synopsis), ".SH DESCRIPTION"),
    ]
    for k, block in enumerate(blocks):
        lines += [".PP"] if k else []
        lines += _as_it_stands(block) if block.startswith(" ") else _text(block)
    return "\n".join(lines) + "\n"


def _as_it_stands(block: str) -> list[str]:
    return [".nf", *_text(block), ".fi"]


def _text(block: str) -> list[str]:
    """No line of it is a macro."""
    lines = _escaped(block).splitlines()
    return [f"\\&{line}" if line[:1] in (".", "'") else line for line in lines]


def _escaped(text: str) -> str:
    return text.replace("\\", "\\\\").replace("-", "\\-")
