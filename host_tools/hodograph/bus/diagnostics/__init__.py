# SPDX-License-Identifier: MIT
"""Diagnostics texts: states, faults and refusals in words, with remedies. Pure functions."""
