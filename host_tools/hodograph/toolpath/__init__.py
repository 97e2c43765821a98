# SPDX-License-Identifier: MIT
"""Toolpaths: moves and machine commands, read from files that other programs wrote. Used by many modules of host_tools:
jobs, streaming, the Python API, the commands import and stream. Reads the files that it is given, and stdin.

`moves` holds the moves and machine commands, which are the same for every kind of file. `gcode` reads G-code, `svg` and
`dxf` read drawings, `points` reads points. `fit` makes curves of the moves.
"""
