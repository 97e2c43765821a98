# SPDX-License-Identifier: MIT
"""The controller of a command: node, bit rate and names of axes, from `--machine`, `--node` or defaults. Used by all
commands that take a node or a machine. Reads the machine file.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import dataclass

DEFAULT_BITRATE = 1_000_000


@dataclass(frozen=True)
class Target:
    """Node number, bit rate, and names of the axes where a machine file gives them."""

    node: int
    bitrate: int
    axis_names: tuple[str, ...]


def target(options: Namespace) -> Target:
    """From --machine if it is given, else from --node and the usual bit rate. Raises InputError."""
    if options.machine is None:
        return Target(options.node or 1, DEFAULT_BITRATE, ())
    from ..config import load_machine

    machine = load_machine(options.machine)
    names = tuple(axis.name for axis in machine.axes)
    return Target(options.node or machine.node, machine.bitrate, names)
