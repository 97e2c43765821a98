# SPDX-License-Identifier: MIT
"""The machine of the alpha and its drives, for the tests of `hodograph tune`. Loaded by pytest; reads the examples."""

from __future__ import annotations

from pathlib import Path

import pytest

from hodograph.config import Drive, Machine, load_machine
from shared_programs import all_stops_planned_once, stops_planned_once

__all__ = ["all_stops_planned_once", "stops_planned_once"]

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@pytest.fixture(scope="session")
def machine() -> Machine:
    return load_machine(EXAMPLES / "machines" / "paper_alpha.toml")


@pytest.fixture(scope="session")
def drives(machine: Machine) -> tuple[Drive, Drive]:
    x, y = machine.models(machine.path_axes)
    return x, y
