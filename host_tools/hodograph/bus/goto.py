# SPDX-License-Identifier: MIT
"""Straight, jerk-limited moves from where the axes stand: programs like any other."""

from __future__ import annotations

import math
from collections.abc import Callable

from ..config import Machine
from ..errors import InputError, RefusedError
from ..feed import FeedRequest, Limits, plan_path
from ..pipeline import axis_limits, controller_limits, plants, program_limits, stop_terms
from ..program import ProgramOptions, compile_path, encode
from ..spline import line
from .sdo.controller import Controller
from .sdo.objects import OVERRIDE, READY

GOTO_FEED_MM_S = 100.0
GOTO_RAMP_S = 0.25
SHORTEST_MOVE_MM = 0.002
"""Shorter moves (the format ends near 1 um) go by way of a point DETOUR_MM away."""
DETOUR_MM = 0.1


def line_image(start_mm: complex, end_mm: complex, machine: Machine) -> bytes:
    """The program of a straight move in machine coordinates. Raises PlanError when it leaves the travel."""
    spline = line(start_mm, end_mm)
    request = FeedRequest(
        profile="minimax",
        nominal_mm_s=min(GOTO_FEED_MM_S, machine.feed_mm_s),
        ramp_time_s=GOTO_RAMP_S,
        degree=5,
    )
    limits = Limits(machine=axis_limits(machine))
    plan = plan_path(
        spline,
        request,
        limits,
        controller_limits(machine),
        plants(machine, limits),
        period_us=machine.period_us,
    )
    options = ProgramOptions(
        "goto",
        0j,
        program_limits(machine),
        machine.period_us,
        stop_terms(machine, limits),
    )
    return encode(compile_path(spline, plan, options).program)


def legs(start_mm: complex, end_mm: complex, machine: Machine) -> list[tuple[complex, complex]]:
    """The straight moves that lead from one point to another: none, one, or two for a tiny way."""
    if start_mm == end_mm:
        return []
    if abs(end_mm - start_mm) >= SHORTEST_MOVE_MM:
        return [(start_mm, end_mm)]
    axis = machine.plane[0]
    middle = (axis.travel_min_mm + axis.travel_max_mm) / 2
    detour = start_mm + math.copysign(DETOUR_MM, middle - start_mm.real)
    return [(start_mm, detour), (detour, end_mm)]


def goto(
    controller: Controller,
    machine: Machine,
    end_counts: tuple[int, int],
    tick: Callable[[], None] | None = None,
    *,
    unhomed: bool = False,
) -> float:
    """Moves from the present setpoint to a point in counts; returns the way in mm, at standstill.

    The drives have to be on (state ready). Each move replaces the program that is loaded. `unhomed`: also when axes
    with a homing method are not homed. Raises RefusedError when the feed override is 0, with which nothing would move.
    """
    for axis, counts in zip(machine.plane, end_counts, strict=True):
        at_mm = counts / machine.counts_per_mm
        if not axis.travel_min_mm <= at_mm <= axis.travel_max_mm:
            raise InputError(
                f"goto: {axis.name} = {at_mm:g} mm is outside the travel "
                f"{axis.travel_min_mm:g} to {axis.travel_max_mm:g} mm"
            )
    here = controller.targets(len(machine.plane))
    start_mm, end_mm = (
        complex(x / machine.counts_per_mm, y / machine.counts_per_mm) for x, y in (here, end_counts)
    )
    way_mm = 0.0
    moves = legs(start_mm, end_mm, machine)
    if moves and controller.read(OVERRIDE, 1) == 0:
        raise RefusedError(
            f"goto: the feed override of {controller.who()} is 0 %, nothing would move: hodograph override 100 first"
        )
    for a, b in moves:
        controller.upload(line_image(a, b, machine))
        controller.start(unhomed=unhomed)
        controller.wait_for((READY,), math.inf, tick)
        way_mm += abs(b - a)
    return way_mm
