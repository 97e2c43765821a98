# SPDX-License-Identifier: MIT
"""Some seconds of bus time with programs: no unexpected frame on the bus (`make soak`: an hour). Run by pytest; starts
tools/soak.py, and writes to temporary folders.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from marks import long

SHORT = (16, (1000, 8000))
ALL = (32, (1000, 2000, 4000, 8000))
"""Seconds of bus time, and the periods in us that share them."""


@pytest.mark.usefixtures("one_core")
@pytest.mark.parametrize(("seconds", "periods_us"), [SHORT, long(*ALL)])
def test_some_seconds_of_bus_time(
    root: Path, tmp_path: Path, seconds: int, periods_us: tuple[int, ...]
) -> None:
    figures = tmp_path / "soak.json"
    given = ",".join(map(str, periods_us))
    command = [sys.executable, str(root / "tools/soak.py")]
    done = subprocess.run(
        [*command, "--seconds", str(seconds), "--periods", given, "--json", str(figures)],
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    periods = json.loads(figures.read_text())
    assert [found["period_us"] for found in periods] == list(periods_us)
    for found in periods:
        assert found["unexpected"] == 0
        assert found["bus_s"] >= seconds / len(periods)
        assert found["programs"] >= 2  # at 8 ms they take longer
        assert found["worst_heartbeat_ms"] < 250  # 100 and what an upload, which goes first, delays
        assert found["frames"] > 6 * found["syncs"]
