# SPDX-License-Identifier: MIT
"""Fixtures of these tests."""

from shared_programs import stops_planned_once

__all__ = ["stops_planned_once"]
