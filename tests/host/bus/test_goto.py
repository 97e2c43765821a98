# SPDX-License-Identifier: MIT
"""Straight moves: from count to count exactly, inside the machine's limits, however short or long. Run by pytest; opens
a virtual bus of python-can in this process, with its lock file; starts a thread.
"""

from __future__ import annotations

import math
from pathlib import Path

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.bus.address import BusAddress
from hodograph.bus.goto import SHORTEST_MOVE_MM, goto, legs, line_image
from hodograph.bus.sdo.controller import connect
from hodograph.config import Machine, load_machine
from hodograph.data import CONTROLLER_EDS
from hodograph.errors import PlanError, RefusedError
from hodograph.machine_limits import program_limits
from hodograph.native import NativeLimits, NativeProgram

MACHINE = load_machine(
    Path(__file__).resolve().parents[3] / "examples" / "machines" / "paper_alpha.toml"
)
COUNTS = st.integers(-200_000_000, 200_000_000)


@settings(max_examples=40, deadline=None)
@given(COUNTS, COUNTS, COUNTS, COUNTS)
def test_any_move(x0: int, y0: int, x1: int, y1: int) -> None:
    check_moves((x0, y0), (x1, y1))


@settings(max_examples=40, deadline=None)
@given(COUNTS, COUNTS, st.integers(-3000, 3000), st.integers(-3000, 3000))
def test_short_moves(x: int, y: int, dx: int, dy: int) -> None:
    check_moves(
        (x, y),
        (min(max(x + dx, -200_000_000), 200_000_000), min(max(y + dy, -200_000_000), 200_000_000)),
    )


def check_moves(start: tuple[int, ...], end: tuple[int, ...], machine: Machine = MACHINE) -> None:
    a, b = (tuple(n / 1e6 for n in place) for place in (start, end))
    moves = legs(a, b, machine)
    at = start
    limits = NativeLimits(**vars(program_limits(machine)))
    for leg_start, leg_end in moves:
        program = NativeProgram(line_image(leg_start, leg_end, machine))
        assert program.check(limits) is None
        _, setpoints = program.setpoints("fixed", machine.counts_per_mm)
        assert tuple(setpoints[0].tolist()) == at
        at = tuple(setpoints[-1].tolist())
    assert at == end
    assert len(moves) == (0 if start == end else 1 if math.dist(a, b) >= SHORTEST_MOVE_MM else 2)


SPACE = load_machine(MACHINE.file.with_name("mill.toml"))
FAR = 2_000_000_000


@settings(max_examples=25, deadline=None)
@given(st.tuples(*[st.integers(-FAR, FAR)] * 3), st.tuples(*[st.integers(-FAR, FAR)] * 3))
def test_any_move_in_space(start: tuple[int, ...], end: tuple[int, ...]) -> None:
    check_moves(start, end, SPACE)


@settings(max_examples=25, deadline=None)
@given(
    st.tuples(*[st.integers(-1_900_000_000, 1_900_000_000)] * 3),
    st.tuples(*[st.sampled_from([0, 1, -1, 1999, -2500, 60_000_000])] * 3),
)
def test_short_moves_and_moves_along_an_axis(
    start: tuple[int, ...], distance: tuple[int, ...]
) -> None:
    check_moves(start, tuple(a + b for a, b in zip(start, distance, strict=True)), SPACE)


def test_outside_the_travel() -> None:
    with pytest.raises(PlanError, match="travel"):
        line_image((0.0, 0.0), (300.0, 0.0), MACHINE)


def test_an_override_of_0_is_said() -> None:
    bus = BusAddress("virtual", "goto")
    network = canopen.Network()
    network.connect(interface=bus.interface, channel=bus.channel)
    node = network.create_node(1, str(CONTROLLER_EDS))
    node.sdo[0x200D][1].raw = node.sdo[0x200D][2].raw = 0
    node.sdo[0x2010][1].raw = 0
    try:
        with connect(bus, 1, 1_000_000) as controller:
            with pytest.raises(RefusedError, match=r"override of node 1 on .* is 0 %"):
                goto(controller, MACHINE, (1_000_000, 0))
            assert goto(controller, MACHINE, (0, 0)) == 0.0
    finally:
        network.disconnect()
