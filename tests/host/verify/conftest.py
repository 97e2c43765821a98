# SPDX-License-Identifier: MIT
"""Tests of the verifier compile the same examples: their stops are planned once. Loaded by pytest; no I/O."""

from shared_programs import all_stops_planned_once, stops_planned_once

__all__ = ["all_stops_planned_once", "stops_planned_once"]
