# SPDX-License-Identifier: MIT
"""Straight moves: from count to count exactly, inside the machine's limits, however short or long."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hodograph.bus.address import BusAddress
from hodograph.bus.goto import SHORTEST_MOVE_MM, goto, legs, line_image
from hodograph.bus.sdo.controller import connect
from hodograph.config import load_machine
from hodograph.data import CONTROLLER_EDS
from hodograph.errors import PlanError, RefusedError
from hodograph.native import NativeLimits, NativeProgram
from hodograph.pipeline import program_limits

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


def check_moves(start: tuple[int, int], end: tuple[int, int]) -> None:
    a, b = (complex(x / 1e6, y / 1e6) for x, y in (start, end))
    moves = legs(a, b, MACHINE)
    at = start
    limits = NativeLimits(**vars(program_limits(MACHINE)))
    for leg_start, leg_end in moves:
        program = NativeProgram(line_image(leg_start, leg_end, MACHINE))
        assert program.check(limits) is None
        _, setpoints = program.setpoints("fixed", MACHINE.counts_per_mm)
        assert tuple(setpoints[0].tolist()) == at
        at = tuple(setpoints[-1].tolist())
    assert at == end
    assert len(moves) == (0 if start == end else 1 if abs(b - a) >= SHORTEST_MOVE_MM else 2)


def test_outside_the_travel() -> None:
    with pytest.raises(PlanError, match="travel"):
        line_image(0j, 300 + 0j, MACHINE)


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
