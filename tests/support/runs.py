# SPDX-License-Identifier: MIT
"""Compares the output of `run --json` on a bus with that of `simulate --json`, for the same motion. Used by
tests/system, which makes both outputs. No I/O.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

SIMULATE_ONLY = frozenset({"stops"})
"""Runs that are stopped on purpose: `simulate` alone makes them."""


def same_motion(recorded: Mapping[str, Any], simulated: Mapping[str, Any]) -> bool:
    """Whether every key of `simulate`, which was not stopped, has the same value in `run`, but for SIMULATE_ONLY."""
    assert simulated["stops"] == []
    expected = {key: simulated[key] for key in simulated.keys() - SIMULATE_ONLY}
    assert {key: recorded[key] for key in expected} == expected
    return True
