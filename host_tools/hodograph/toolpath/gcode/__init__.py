# SPDX-License-Identifier: MIT
"""Reads G-code: RS274/NGC as LinuxCNC 2.9 understands it. docs/reference/gcode.md lists the words. Used by
`toolpath/files`. No I/O.
"""

from .options import Options
from .reader import read_gcode

__all__ = ["Options", "read_gcode"]
