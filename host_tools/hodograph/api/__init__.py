# SPDX-License-Identifier: MIT
"""The public Python API (docs/reference/python-api.md). Used by programs of users, who import its names from
`hodograph`.

Thin classes over the other packages, which are not public. Modules read and write files and use the bus; importing them
does no I/O. Lengths are in mm, times in s. Arrays of points have one row for each point: (n, A) for A path axes.
"""
