# SPDX-License-Identifier: MIT
"""Programs of the same motion share their stops in these tests. Loaded by pytest; no I/O."""

import pytest

from shared_programs import stops_planned_once

__all__ = ["stops_planned_once"]


@pytest.fixture(autouse=True, scope="module")
def _stops(stops_planned_once: None) -> None:
    """Programs of the same motion share their stops."""
