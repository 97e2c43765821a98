# SPDX-License-Identifier: MIT
"""Makes `stops_planned_once` of tests/support/shared_programs.py a fixture of these tests. Loaded by pytest; no I/O."""

from shared_programs import stops_planned_once

__all__ = ["stops_planned_once"]
