# SPDX-License-Identifier: MIT
"""Files for the tests of campaigns: a short path on the machine of the alpha. Used by the tests of this folder. Writes
files.
"""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
MACHINE = EXAMPLES / "machines" / "paper_alpha.toml"

PATH = f"""
[path]
closed = false
control_points = [[0, 0], [4, 6], [8, 9], [12, 3], [8, -3]]
[feed]
profile = "quintic"
nominal_mm_s = 100
ramp_time_s = 0.05
[machine]
file = "{MACHINE}"
"""

Write = Callable[..., Path]
"""Writes path.toml and a campaign file with a text, which may use {examples}."""


def table(folder: Path) -> list[dict[str, str]]:
    """The rows of a campaign's table, by column."""
    with (folder / "runs.csv").open(encoding="utf-8", newline="") as source:
        return list(csv.DictReader(source))
