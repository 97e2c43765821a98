# SPDX-License-Identifier: MIT
"""The command that describes the bus to other tools: dbc. Started by cli/main. Reads machine and EDS files, writes the
DBC file, and prints to stdout.
"""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

from ..config import load_machine
from ..data import DRIVE_EDS
from ..dbc import dbc_text
from .output import write_file


def dbc(options: Namespace) -> None:
    """hodograph dbc."""
    machine = load_machine(options.file)
    text = dbc_text(machine, options.eds or DRIVE_EDS)
    output = options.output or Path(machine.file.stem + ".dbc")
    write_file(output, text.encode("ascii", "replace"))
    print(f"{output}: {sum(line.startswith('BO_ ') for line in text.splitlines())} frames")


COMMANDS = {"dbc": dbc}
