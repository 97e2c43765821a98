# SPDX-License-Identifier: MIT
"""How programs are compiled whose motion is looked at, and not how they stop."""

from hodograph.program import ProgramOptions, StopTerms

QUICK_STOPS = ProgramOptions(stops=StopTerms(quick=True))
"""Stops are searched with few trials: most of the time that a program takes is that of the search."""
