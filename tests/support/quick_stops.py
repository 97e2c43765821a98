# SPDX-License-Identifier: MIT
"""Compiles programs for tests of their motion: their stops are searched with few trials. Used by the tests of feed
plans. No I/O.
"""

from hodograph.program import ProgramOptions, StopTerms

QUICK_STOPS = ProgramOptions(stops=StopTerms(quick=True))
"""Stops are searched with few trials: most of the time that a program takes is that of the search."""
