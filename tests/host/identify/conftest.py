# SPDX-License-Identifier: MIT
"""Programs of the same motion share their stops in these tests. Loaded by pytest; no I/O."""

from shared_programs import all_stops_planned_once, stops_planned_once

__all__ = ["all_stops_planned_once", "stops_planned_once"]
