# SPDX-License-Identifier: MIT
"""Names of kernels, axes, units and kinds of files that the command line, files and the bus share. Imports nothing
heavy, so that `--help` is quick.
"""

from __future__ import annotations

from pathlib import Path

KERNELS = ("fixed", "float", "double")
"""Number kernels, in the order of their codes in object 0x2004 sub 5."""

AXES = ("x", "y", "z", "a", "b", "c")
"""What the axes of a path are called where no machine names them."""

FIRST_AXIS_SHIFT = 8
"""Where the flags of a program's header have which axis of the machine its first one is (core/first_axis.h)."""

UNITS = ("mm", "deg")
"""What an axis is measured in: an axis in degrees turns."""


def in_unit(name: str, unit: str) -> str:
    """The name in this unit of a key or a quantity that is called `name` in mm."""
    return "_".join(unit if word == "mm" else word for word in name.split("_"))


INTERPOLATIONS = ("linear", "cubic", "none")
"""How a simulated drive goes from setpoint to setpoint, in the order of enum drive_interpolation."""

SPEEDS = ("exact", "differences")
"""Where a simulated drive's loop has its speed from, in the order of enum drive_speed."""

INTEGRALS = ("backward", "forward")
"""Whether a simulated drive's integral counts the present sample, in the order of enum drive_integral."""

SHELLS = ("bash", "zsh", "fish")
"""Shells that there is completion for."""

PACES = ("real-time", "fast")
"""How a controller process of a simulated machine may tick."""

GCODE_SUFFIXES = (".ngc", ".nc", ".gcode", ".tap")
DRAWING_SUFFIXES = (".dxf", ".svg")
POINT_SUFFIXES = (".csv", ".txt")
TOOLPATH_SUFFIXES = (*GCODE_SUFFIXES, *DRAWING_SUFFIXES, *POINT_SUFFIXES)
"""Names of toolpath files end so, in any case of letters."""

PATH_SUFFIX = ".toml"
"""Names of path files end so where other files are allowed too."""

STANDARD_INPUT = "-"
"""Stands for G-code from standard input."""


def is_toolpath(file: Path) -> bool:
    """Whether a FILE of a command is a toolpath; "-" is G-code from standard input."""
    return file.suffix.lower() in TOOLPATH_SUFFIXES or str(file) == STANDARD_INPUT


LENGTH_UNITS_MM = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 0.001, "in": 25.4}
"""Units of drawings and points, as the command line has them."""
