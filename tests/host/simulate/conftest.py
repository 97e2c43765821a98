# SPDX-License-Identifier: MIT
"""Examples as images, drives, splines and simulated runs, for the tests of the simulation. Loaded by pytest; reads the
examples.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pytest

from hodograph.config import Drive, load_machine, load_path_file
from hodograph.feed import ControllerLimits, plan_feed
from hodograph.program import ProgramOptions, compile_program, encode
from hodograph.simulate import Motion, simulate
from hodograph.spline import PHSpline, from_control_polygon
from shared_programs import all_stops_planned_once, stops_planned_once

__all__ = ["all_stops_planned_once", "stops_planned_once"]

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


@dataclass(frozen=True)
class Case:
    image: bytes
    drives: tuple[Drive, Drive]
    spline: PHSpline
    motion: Motion


def make_case(name: str) -> Case:
    path = load_path_file(EXAMPLES / f"{name}.toml")
    assert path.machine_file is not None
    machine = load_machine(path.machine_file)
    spline = from_control_polygon(path.path.points, path.path.closed).spline
    limits = ControllerLimits(
        machine.feed_mm_s, machine.acceleration_mm_s2, machine.jerk_mm_s3, machine.reserve
    )
    plan = plan_feed(spline.length_mm, path.feed, path.limits, limits)
    image = encode(compile_program(spline, plan, ProgramOptions(name=name)))
    x, y = machine.models(machine.path_axes)
    drives = (x, y)
    return Case(image, drives, spline, simulate(image, drives))


@pytest.fixture(scope="session")
def alpha() -> Case:
    return make_case("alpha")


@pytest.fixture(scope="session")
def heart() -> Case:
    return make_case("heart")
