# SPDX-License-Identifier: MIT
"""Words that the command line, files and the bus share; no imports, so that `--help` is quick."""

KERNELS = ("fixed", "float", "double")
"""Number kernels, in the order of their codes in object 0x2004 sub 5."""

INTERPOLATIONS = ("linear", "cubic")
"""How a simulated drive goes from setpoint to setpoint, in the order of enum drive_interpolation."""

SPEEDS = ("exact", "differences")
"""Where a simulated drive's loop has its speed from, in the order of enum drive_speed."""

PACES = ("real-time", "fast")
"""How a controller process of a simulated machine may tick."""
