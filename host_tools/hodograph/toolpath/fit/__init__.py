# SPDX-License-Identifier: MIT
"""From the moves of a toolpath to curves of continuous curvature within a certified tolerance. Used by all modules that
make curves of toolpaths. No I/O.

Theory: docs/theory/toolpath-fitting.md. `sections` divides a toolpath at its stops. `fitting` makes a curve of each
section from `corners` and smoothed `stations`. `certificate` proves its distance from the programmed path.
"""
