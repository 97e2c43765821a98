# SPDX-License-Identifier: MIT
"""Other motion planners, run on the same toolpaths with the same limits, and the measurement of each. Run by
`make compare` (compare.py); benchmarks/toolpaths uses its toolpaths. Starts processes and writes temporary files.

The limits are those of the axes; Klipper's act along the path. docs/validation/compare.md has the results and how each
was set up. Nothing of a peer is part of this tree: LinuxCNC comes from Debian's package, TOPP-RA and Ruckig from PyPI,
Klipper from the user's clone (`KLIPPER=`; without it Klipper is left out).
"""
