# SPDX-License-Identifier: MIT
"""From the moves of a toolpath to curves of continuous curvature within a certified tolerance. Used by many modules of
host_tools: jobs, streaming and the pipeline of sections. No I/O.

Theory: docs/theory/toolpath-fitting.md. `sections` divides a toolpath at its stops. `fitting` makes a curve of each
section from `corners` and smoothed `stations`. `certificate` proves its distance from the programmed path.
"""
