# SPDX-License-Identifier: MIT
"""Other motion planners, run on the same toolpaths under the same limits of the axes, and the measurement of each.

`make compare` (benchmarks/peers/compare.py) runs all of them side by side; docs/validation/compare.md has the results
and how each was set up. Nothing of a peer is part of this tree: LinuxCNC comes from Debian's package, the others from
PyPI.
"""
