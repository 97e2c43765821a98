# SPDX-License-Identifier: MIT
"""Names of kernels, axes, units and kinds of files that the command line, files and the bus share. Imports nothing
heavy, so that `--help` is quick. Used by many modules of host_tools. No I/O.
"""

from __future__ import annotations

from pathlib import Path

KERNELS = ("fixed", "float", "double")
"""Kernels, in the order of their codes in object 0x2004 sub 5."""

AXES = ("x", "y", "z", "a", "b", "c")
"""Names of the axes of a path where no machine names them."""

FIRST_AXIS_SHIFT = 8
"""Bit of a program header's flags from which on they hold the machine's number of the program's first axis
(core/first_axis.h).
"""

UNITS = ("mm", "deg")
"""Units of an axis; a rotary axis has degrees."""


def in_unit(name: str, unit: str) -> str:
    """The name of a key or quantity in this unit; `name` is its name in mm."""
    return "_".join(unit if word == "mm" else word for word in name.split("_"))


INTERPOLATIONS = ("linear", "cubic", "none")
"""How a simulated drive goes from setpoint to setpoint, in the order of enum drive_interpolation."""

SPEEDS = ("exact", "differences")
"""Source of the speed in a simulated drive's loop, in the order of enum drive_speed."""

INTEGRALS = ("backward", "forward")
"""Whether a simulated drive's integral includes the present sample ("backward") or not, in the order of enum
drive_integral.
"""

SHELLS = ("bash", "zsh", "fish")
"""Shells with completion."""

PACES = ("real-time", "fast")
"""How the controller process of a simulated machine ticks."""

GCODE_SUFFIXES = (".ngc", ".nc", ".gcode", ".tap")
DRAWING_SUFFIXES = (".dxf", ".svg")
POINT_SUFFIXES = (".csv", ".txt")
TOOLPATH_SUFFIXES = (*GCODE_SUFFIXES, *DRAWING_SUFFIXES, *POINT_SUFFIXES)
"""Endings of toolpath files, in upper or lower case."""

PATH_SUFFIX = ".toml"
"""Ending of path files where other files are allowed too."""

STANDARD_INPUT = "-"
"""Stands for G-code from standard input."""


def is_toolpath(file: Path) -> bool:
    """Whether a FILE of a command is a toolpath; "-" is G-code from standard input."""
    return file.suffix.lower() in TOOLPATH_SUFFIXES or str(file) == STANDARD_INPUT


LENGTH_UNITS_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "in": 25.4}
"""Units of drawings and points, by their names on the command line."""
