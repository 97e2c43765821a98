# SPDX-License-Identifier: MIT
"""Half a minute of bus time with programs: no unexpected frame on the bus (`make soak`: an hour). Run by pytest; starts
tools/soak.py, and writes to temporary folders.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

SECONDS = 32


@pytest.mark.usefixtures("one_core")
def test_half_a_minute_of_bus_time(root: Path, tmp_path: Path) -> None:
    figures = tmp_path / "soak.json"
    command = [sys.executable, str(root / "tools/soak.py")]
    done = subprocess.run(
        [*command, "--seconds", str(SECONDS), "--json", str(figures)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    periods = json.loads(figures.read_text())
    assert [found["period_us"] for found in periods] == [1000, 2000, 4000, 8000]
    for found in periods:
        assert found["unexpected"] == 0
        assert found["bus_s"] >= SECONDS / len(periods)
        assert found["programs"] >= 2  # at 8 ms they take longer
        assert found["worst_heartbeat_ms"] < 250  # 100 and what an upload, which goes first, delays
        assert found["frames"] > 6 * found["syncs"]
