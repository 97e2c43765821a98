# SPDX-License-Identifier: MIT
"""From the moves of a toolpath to curves of continuous curvature within a certified tolerance.

docs/theory/toolpath-fitting.md says how. `sections` divides a toolpath at its stops, `fitting` makes a curve of each
section out of `corners` and smoothed `stations`, `certificate` proves how far it is from the programmed path.
"""
