# SPDX-License-Identifier: MIT
"""Hodograph: jerk-limited motion on Pythagorean-hodograph splines over CAN servo drives."""

__version__ = "0.1.0"
