# SPDX-License-Identifier: MIT
"""Straight, jerk-limited moves from where the axes stand: programs like any other."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from ..config import PLANE_AXES, SPACE_AXES, Axis, Machine
from ..errors import InputError, RefusedError
from ..feed import FeedRequest, Limits, plan_path
from ..pipeline import (
    axis_limits,
    controller_limits,
    plants,
    program_limits,
    stop_terms,
)
from ..program import ProgramOptions, compile_path, encode
from ..spline import PHSpline, line
from ..spline.spatial import SpatialPHSpline, spatial_through_points
from .sdo.controller import Controller
from .sdo.objects import OVERRIDE, READY

GOTO_FEED_MM_S = 100.0
GOTO_RAMP_S = 0.25
SHORTEST_MOVE_MM = 0.002
"""Shorter moves (the format ends near 1 um) go by way of a point DETOUR_MM away."""
DETOUR_MM = 0.1


Place = tuple[float, ...]
"""Of the axes that draw a path: two in the plane, three in space; mm."""


def line_image(start_mm: Place, end_mm: Place, machine: Machine) -> bytes:
    """The program of a straight move in machine coordinates. Raises PlanError when it leaves the travel."""
    machine = replace(machine, path_count=len(start_mm), offset_mm=(0.0,) * len(start_mm))
    spline = _line(start_mm, end_mm)
    request = FeedRequest(
        profile="minimax",
        nominal_mm_s=min(GOTO_FEED_MM_S, machine.feed_mm_s),
        ramp_time_s=GOTO_RAMP_S,
        degree=5,
    )
    limits = Limits(machine=axis_limits(machine), names=machine.path_names)
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
        (),
        program_limits(machine),
        machine.period_us,
        stop_terms(machine, limits),
    )
    return encode(compile_path(spline, plan, options).program)


def _line(start_mm: Place, end_mm: Place) -> PHSpline | SpatialPHSpline:
    if len(start_mm) == PLANE_AXES:
        return line(complex(*start_mm), complex(*end_mm))
    return spatial_through_points(np.array([start_mm, end_mm]), closed=False).spline


def legs(start_mm: Place, end_mm: Place, machine: Machine) -> list[tuple[Place, Place]]:
    """The straight moves that lead from one point to another: none, one, or two for a tiny way."""
    if start_mm == end_mm:
        return []
    if math.dist(start_mm, end_mm) >= SHORTEST_MOVE_MM:
        return [(start_mm, end_mm)]
    axis = machine.path_axes[0]
    middle = (axis.travel_min_mm + axis.travel_max_mm) / 2
    detour = (start_mm[0] + math.copysign(DETOUR_MM, middle - start_mm[0]), *start_mm[1:])
    return [(start_mm, detour), (detour, end_mm)]


def goto(
    controller: Controller,
    machine: Machine,
    end_counts: Sequence[int],
    tick: Callable[[], None] | None = None,
    *,
    unhomed: bool = False,
) -> float:
    """Moves from the present setpoint to a point in counts of the path's axes, in the order of the path; returns the
    way in mm, at standstill. Axes that it does not name hold their position.

    The drives have to be on (state ready). Each move replaces the program that is loaded. `unhomed`: also when axes
    with a homing method are not homed. Raises RefusedError when the feed override is 0, with which nothing would move.
    """
    axes = machine.path_axes
    for axis, counts in zip(axes, end_counts, strict=False):
        at = counts / axis.counts_per_unit
        if not axis.travel_min_mm <= at <= axis.travel_max_mm:
            raise InputError(
                f"goto: {axis.name} = {at:g} {axis.unit} is outside the travel "
                f"{axis.travel_min_mm:g} to {axis.travel_max_mm:g} {axis.unit}"
            )
    here = controller.targets(len(axes))
    drawn = min(len(end_counts), SPACE_AXES)
    _require_no_way(axes[drawn:], here[drawn:], end_counts[drawn:])
    start_mm, end_mm = (
        tuple(n / machine.counts_per_mm for n in place[:drawn]) for place in (here, end_counts)
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
        way_mm += math.dist(a, b)
    return way_mm


def _require_no_way(axes: Sequence[Axis], here: Sequence[int], end: Sequence[int]) -> None:
    """Raises InputError where an axis that does not draw the path would have to move."""
    for axis, at, wanted in zip(axes, here, end, strict=False):
        if at != wanted:
            scale = axis.counts_per_unit
            raise InputError(
                f"goto: moves the axes that draw the path only, and {axis.name} stands at {at / scale:g} {axis.unit}, "
                f"not at {wanted / scale:g}: bring it there first"
            )
