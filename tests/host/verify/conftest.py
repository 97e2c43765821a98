# SPDX-License-Identifier: MIT
"""Tests of the verifier compile the same examples: their stops are planned once. Loaded by pytest; no I/O."""

import pytest

from shared_programs import stops_planned_once

__all__ = ["stops_planned_once"]


@pytest.fixture(autouse=True, scope="module")
def _stops(stops_planned_once: None) -> None:
    """Many tests here compile the same paths."""
