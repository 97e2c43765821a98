# SPDX-License-Identifier: MIT
"""The arguments of all commands, in the order of `hodograph --help`. Used by cli/parser. No I/O."""

from __future__ import annotations

from .bus_arguments import MOVING, OPERATING, WATCHING
from .offline_arguments import BEGINNING, OFFLINE

ALL = (*BEGINNING, *OFFLINE, *MOVING, *OPERATING, *WATCHING)
"""Functions that add a command."""
