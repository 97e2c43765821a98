# SPDX-License-Identifier: MIT
"""Lateness of ticks from the times of SYNC frames, and the command that measures it. Run by pytest; starts a bus."""

from __future__ import annotations

import numpy as np
import pytest

from commands import result
from hodograph.bus.hub import LocalHub
from hodograph.cli.main import main
from hodograph.latency import EDGES_US, Latency, Load, lateness

LOAD = Load(2, 50.0, 1.0, 1.5)


def test_ticks_in_time_are_not_late() -> None:
    found, missed = lateness(1000.0 * np.arange(3000), 1000)
    assert (found == 0).all()
    assert missed == 0


def test_each_late_tick_is_found() -> None:
    late = np.zeros(3000)
    late[[10, 700, 2999]] = 40.0, 990.0, 7.0
    found, missed = lateness(1000.0 * np.arange(3000) + late, 1000)
    assert np.array_equal(found, late)
    assert missed == 0


def test_ticks_that_catch_up_are_late_until_then() -> None:
    """After a late tick the next ones come three quarters of a period apart."""
    late = np.array([0, 0, 600, 350, 100, 0, 0], dtype=float)
    found, _ = lateness(2000.0 * np.arange(7) + late, 2000)
    assert found.tolist() == late.tolist()


def test_clocks_that_drift_apart_make_nothing_late() -> None:
    """Half a microsecond a second, and 20 ppm."""
    ticks = np.arange(20_000)
    found, _ = lateness(1000.02 * ticks, 1000)
    assert found.max() <= 0.02 * 1001


def test_a_gap_begins_a_new_grid() -> None:
    times = 1000.0 * np.arange(100)
    times[50:] += 3400.0
    found, missed = lateness(times, 1000)
    assert missed == 3
    assert found.size == 100
    assert (found == 0).all()


def test_figures_and_histogram() -> None:
    values = np.array([0.0] * 90 + [15.0] * 9 + [6000.0])
    found = Latency("a bus", 1000, values, 2, LOAD)
    rows = found.histogram()
    assert [row[0] for row in rows] == list(EDGES_US)
    assert sum(row[2] for row in rows) == 100
    assert (0, 1, 90) in rows
    assert (10, 20, 9) in rows
    assert rows[-1] == (5000, None, 1)
    reported = found.json()
    assert reported["lateness_us"]["median"] == 0
    assert reported["lateness_us"]["greatest"] == 6000
    assert reported["missed"] == 2
    assert reported["load"]["load_average_end"] == 1.5


def test_a_controller_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    found = result(capsys, "latency", "--seconds", "0.3", "--json")
    assert found["period_us"] == 1000
    assert found["ticks"] == sum(row[2] for row in found["histogram"]) > 1
    assert 0 <= found["lateness_us"]["median"] <= found["lateness_us"]["greatest"]
    assert 0 <= found["load"]["busy_percent"] <= 100


def test_text_for_people(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["latency", "--seconds", "0.2"]) == 0
    out = capsys.readouterr().out
    assert "processor load: " in out
    assert "lateness: median " in out


def test_a_bus_without_a_controller(capsys: pytest.CaptureFixture[str]) -> None:
    with LocalHub(virtual=False) as hub:
        assert main(["latency", "--bus", str(hub.address), "--seconds", "0.1"]) == 4
    assert "no SYNC within 0.1 s" in capsys.readouterr().err
    assert main(["latency", "--bus", "local:/nowhere"]) == 4
    assert main(["latency", "--bus", "virtual:x"]) == 4
