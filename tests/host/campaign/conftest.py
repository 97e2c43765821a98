# SPDX-License-Identifier: MIT
"""Campaign files in a temporary folder, over a short path; stops are planned once. Loaded by pytest; writes to
temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest
from campaign_files import EXAMPLES, PATH, Write

from shared_programs import all_stops_planned_once, stops_planned_once

__all__ = ["all_stops_planned_once", "stops_planned_once"]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Writes path.toml and a campaign file with this text, which may use {path} and {examples}."""

    def made(text: str, name: str = "campaign.toml", path: str = PATH) -> Path:
        (tmp_path / "path.toml").write_text(path)
        file = tmp_path / name
        file.write_text(text.replace("{examples}", str(EXAMPLES)))
        return file

    return made
