# SPDX-License-Identifier: MIT
"""Straight moves: from count to count exactly, inside the machine's limits, however short or long. Run by pytest; opens
a virtual bus of python-can in this process, with its lock file; starts a thread.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import canopen
import pytest
from canopen import SdoAbortedError
from hypothesis import given, settings
from hypothesis import strategies as st

from canopen_server import canopen_server
from hodograph.bus.address import BusAddress
from hodograph.bus.goto import (
    SHORTEST_MOVE_MM,
    goto,
    legs,
    line_image,
    require_inside_travel,
    switch_on,
)
from hodograph.bus.sdo.controller import OFF, Controller, connect
from hodograph.config import Machine, load_machine
from hodograph.errors import PlanError, RefusedError
from hodograph.machine_limits import program_limits
from hodograph.native import NativeLimits, NativeProgram

MACHINE = load_machine(
    Path(__file__).resolve().parents[3] / "examples" / "machines" / "paper_alpha.toml"
)
COUNTS = st.integers(-200_000_000, 200_000_000)


@pytest.mark.long_examples(100)
@settings(max_examples=15, deadline=None)
@given(COUNTS, COUNTS, COUNTS, COUNTS)
def test_any_move(x0: int, y0: int, x1: int, y1: int) -> None:
    check_moves((x0, y0), (x1, y1))


@pytest.mark.long_examples(100)
@settings(max_examples=15, deadline=None)
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


@pytest.mark.long_examples(100)
@settings(max_examples=12, deadline=None)
@given(st.tuples(*[st.integers(-FAR, FAR)] * 3), st.tuples(*[st.integers(-FAR, FAR)] * 3))
def test_any_move_in_space(start: tuple[int, ...], end: tuple[int, ...]) -> None:
    check_moves(start, end, SPACE)


@pytest.mark.long_examples(100)
@settings(max_examples=12, deadline=None)
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


@contextmanager
def fake_controller() -> Iterator[tuple[Controller, canopen.LocalNode]]:
    """The server, and the client that reads it."""
    bus = BusAddress("virtual", "goto")
    with canopen_server(bus) as node, connect(bus, 1, 1_000_000) as controller:
        yield controller, node


def test_an_override_of_0_is_said() -> None:
    with fake_controller() as (controller, node):
        node.sdo[0x200D][1].raw = node.sdo[0x200D][2].raw = 0
        node.sdo[0x2010][1].raw = 0
        with pytest.raises(RefusedError, match=r"override of node 1 on .* is 0 %"):
            goto(controller, MACHINE, (1_000_000, 0))
        assert goto(controller, MACHINE, (0, 0)) == 0.0


TRAVEL = (-35_000_000, 40_000_000)
"""Counts, of both axes."""


def configure_travel(node: canopen.LocalNode, own_counts: int) -> None:
    """A start tolerance of 0.007 mm. `own_counts`: of y, as 0x2033 has them."""
    node.sdo[0x2004][6].raw, node.sdo[0x2004][7].raw = 7000, 1_000_000
    for sub, own in ((1, 0), (2, own_counts)):
        node.sdo[0x2006][sub].raw, node.sdo[0x2007][sub].raw = TRAVEL
        node.sdo[0x2033][sub].raw = own
        node.sdo[0x200B][sub].raw = 0


@pytest.mark.parametrize(
    ("sub", "own_counts", "tolerance"),
    [(1, 0, 7000), (2, 0, 7000), (2, 100_000, 700), (2, 33_333, 233)],
)
def test_an_axis_may_stand_outside_its_travel_by_the_start_tolerance(
    sub: int, own_counts: int, tolerance: int
) -> None:
    """As config_tolerance_counts of the controller: degrees as mm, rounded down."""
    with fake_controller() as (controller, node):
        configure_travel(node, own_counts)
        for edge, outwards in zip(TRAVEL, (-1, 1), strict=True):
            for beyond in (tolerance - 1, tolerance):
                node.sdo[0x200B][sub].raw = edge + outwards * beyond
                require_inside_travel(controller, MACHINE)
            node.sdo[0x200B][sub].raw = edge + outwards * (tolerance + 1)
            with pytest.raises(RefusedError, match=f"axis {'xy'[sub - 1]} stands at"):
                require_inside_travel(controller, MACHINE)


def test_the_refusal_names_axis_position_travel_and_tolerance() -> None:
    with fake_controller() as (controller, node):
        configure_travel(node, 0)
        node.sdo[0x200B][2].raw = 40_007_001
        node.sdo[0x2002].raw, node.sdo[0x2003][4].raw = OFF, 22

        def refuse(*, index: int, **_: object) -> None:
            if index == 0x2001:
                raise SdoAbortedError(0x08000022)

        node.add_write_callback(refuse)
        with pytest.raises(
            RefusedError,
            match=r"axis y stands at 40\.007001 mm, outside of its travel -35 to 40 mm by more than "
            r"start_tolerance_mm \(0\.007 mm\)",
        ):
            switch_on(controller, MACHINE)
        node.sdo[0x2003][4].raw = 6
        with pytest.raises(RefusedError, match="drives are missing"):
            switch_on(controller, MACHINE)
