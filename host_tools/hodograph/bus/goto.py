# SPDX-License-Identifier: MIT
"""Straight, jerk-limited moves from the present position of the axes, as programs. Used by many modules of host_tools:
the commands goto, run and stream, and the Python API. Reads and writes objects of the controller by SDO, and waits by
the clock of the bus, real or virtual.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..config import PLANE_AXES, SPACE_AXES, Machine
from ..errors import InputError, RefusedError, RunError
from ..feed import FeedPlan, FeedRequest, Limits, plan_path
from ..machine_limits import axis_limits, controller_limits, plants, program_limits, stop_terms
from ..program import ProgramOptions, StopTerms, compile_path, encode
from ..program.stop_planning import LongStopError
from ..spline import PHSpline, line
from ..spline.spatial import SpatialPHSpline, spatial_through_points
from .diagnostics.texts import OUTSIDE_TRAVEL_REMEDY
from .sdo.configuration import configured_counts, configured_tolerances, configured_travel
from .sdo.controller import CommandRefusedError, Controller
from .sdo.objects import ACTUAL, OVERRIDE, REFUSED_OUTSIDE_TRAVEL

GOTO_FEED_MM_S = 100.0
GOTO_RAMP_S = 0.25
"""Time of the feed ramp of a move."""
SHORTEST_MOVE_MM = 0.002
"""Shorter moves (the format ends near 1 um) go through a point DETOUR_MM away."""
DETOUR_MM = 0.1
"""Least distance of the point through which a short move goes."""
DETOUR_SHARE, LONGEST_DETOUR_MM = 0.01, 5.0
"""Length of the move of x if only axes after z move: mm for each degree or mm of the longest of their moves."""
FOLLOWING_SHARE = 0.5
"""Share of the axis limits for moves of axes after z: at full speed they could not stop within stop_time_ms."""
QUICK_ABOVE_MM = 50.0
"""Stops of longer moves in space are searched with few trials. All trials would take up to 36 s of processor time and
make stops at most 8 % shorter.
"""

Place = tuple[float, ...]
"""A position of path axes, mm or degrees: of the two or three that draw a path, or of all."""


def line_image(start_mm: Place, end_mm: Place, machine: Machine) -> bytes:
    """The program of a straight move in machine coordinates. Raises PlanError when it leaves the travel."""
    machine = replace(machine, path_count=len(start_mm), offset_mm=(0.0,) * len(start_mm))
    machine = _along(machine, start_mm, end_mm)
    spline = _line(start_mm, end_mm)
    request = FeedRequest(
        profile="minimax",
        nominal_mm_s=min(GOTO_FEED_MM_S, machine.feed_mm_s),
        ramp_time_s=GOTO_RAMP_S,
        degree=5,
    )
    follow = start_mm[SPACE_AXES:] != end_mm[SPACE_AXES:]
    limits = Limits(
        machine=axis_limits(machine).scaled(FOLLOWING_SHARE if follow else 1.0),
        names=machine.path_names,
        units=machine.path_units,
    )
    plan = plan_path(
        spline,
        request,
        limits,
        controller_limits(machine),
        plants(machine, limits),
        period_us=machine.period_us,
    )
    terms = stop_terms(machine, limits)
    if len(start_mm) > PLANE_AXES and spline.length_mm > QUICK_ABOVE_MM:
        with suppress(LongStopError):  # all trials may find stops that are short enough
            return _image(spline, plan, machine, replace(terms, quick=True))
    return _image(spline, plan, machine, terms)


def _image(
    spline: PHSpline | SpatialPHSpline, plan: FeedPlan, machine: Machine, terms: StopTerms
) -> bytes:
    options = ProgramOptions("goto", (), program_limits(machine), machine.period_us, terms)
    return encode(compile_path(spline, plan, options).program)


def _along(machine: Machine, start_mm: Place, end_mm: Place) -> Machine:
    """The machine with limits along the straight line that keep the limits of the axes after z.

    The search for stops uses values down to a share of the limits along the path, which may be far above those of such
    axes.
    """
    distance_mm = math.dist(start_mm[:SPACE_AXES], end_mm[:SPACE_AXES])
    axes = zip(machine.path_axes, start_mm, end_mm, strict=True)
    moving = [(axis, abs(b - a) / distance_mm) for axis, a, b in axes if a != b]
    acceleration = [axis.acceleration_mm_s2 / slope for axis, slope in moving if slope > 1.0]
    jerk = [axis.jerk_mm_s3 / slope for axis, slope in moving if slope > 1.0]
    return replace(
        machine,
        acceleration_mm_s2=min([machine.acceleration_mm_s2, *acceleration]),
        jerk_mm_s3=min([machine.jerk_mm_s3, *jerk]),
    )


def _line(start_mm: Place, end_mm: Place) -> PHSpline | SpatialPHSpline:
    if len(start_mm) == PLANE_AXES:
        return line(complex(*start_mm), complex(*end_mm))
    ends = np.array([start_mm, end_mm])
    drawn, extra = ends[:, :SPACE_AXES], ends[:, SPACE_AXES:]
    return spatial_through_points(drawn, closed=False, extra=extra).spline


def legs(start_mm: Place, end_mm: Place, machine: Machine) -> list[tuple[Place, Place]]:
    """The straight moves from one point to another: none, one, or two for a tiny move of x, y, z. Axes after z move on
    the first of two.
    """
    if start_mm == end_mm:
        return []
    distance_mm = math.dist(start_mm[:SPACE_AXES], end_mm[:SPACE_AXES])
    turns = [abs(b - a) for a, b in zip(start_mm, end_mm, strict=True)][SPACE_AXES:]
    detour_mm = min(max(DETOUR_MM, DETOUR_SHARE * max(turns, default=0.0)), LONGEST_DETOUR_MM)
    if distance_mm >= (detour_mm if any(turns) else SHORTEST_MOVE_MM):
        return [(start_mm, end_mm)]
    axis = machine.path_axes[0]
    middle = (axis.travel_min_mm + axis.travel_max_mm) / 2
    beside = start_mm[0] + math.copysign(detour_mm, middle - start_mm[0])
    detour = (beside, *start_mm[1:SPACE_AXES], *end_mm[SPACE_AXES:])
    return [(start_mm, detour), (detour, end_mm)]


def switch_on(controller: Controller, machine: Machine) -> None:
    """Switches the drives on; returns at standstill, ready. Raises RefusedError, naming the axis: it stands outside of
    its travel by more than the start tolerance. The controller decides this, and does not name the axis.
    """
    try:
        controller.enable()
    except CommandRefusedError as refused:
        if refused.reason == REFUSED_OUTSIDE_TRAVEL:
            require_inside_travel(controller, machine)
        raise


def require_inside_travel(controller: Controller, machine: Machine) -> None:
    """Raises RefusedError, naming the axis that stands outside of its travel. A drive outside of its software limits
    moves to them at once, without a ramp. An axis may stand there after a limit switch.

    With the controller's own values, in counts: so the controller refuses to switch on exactly the same axes.
    """
    counts = configured_counts(controller, len(machine.axes))
    tolerances = configured_tolerances(controller, counts)
    axes = zip(machine.axes, counts, tolerances, strict=True)
    for number, (axis, per_unit, tolerance) in enumerate(axes, 1):
        at = controller.read(ACTUAL, number)
        least, most = configured_travel(controller, number)
        if not least - tolerance <= at <= most + tolerance:
            stands, low, high, allowed = (
                f"{round(value / per_unit, 6):.10g}" for value in (at, least, most, tolerance)
            )
            raise RefusedError(
                f"{controller.who()}: axis {axis.name} stands at {stands} {axis.unit}, outside of its travel {low} to "
                f"{high} {axis.unit} by more than start_tolerance_mm ({allowed} {axis.unit}), {OUTSIDE_TRAVEL_REMEDY}"
            )


def goto(
    controller: Controller,
    machine: Machine,
    end_counts: Sequence[int],
    tick: Callable[[], None] | None = None,
    *,
    unhomed: bool = False,
) -> float:
    """Moves from the present setpoint to a point in counts of the path's axes, in the order of the path. Returns the
    distance in mm, at standstill. Axes that the point does not have hold their position. If only axes after z move, x
    moves a small distance and back, since a program needs a distance.

    The drives have to be on (state ready). Each move replaces the loaded program. `unhomed`: also if axes with a homing
    method are not homed. Raises RefusedError: the feed override is 0. Raises RunError: another command has stopped the
    axes or switched the drives off.
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
    count = len(end_counts)
    if list(here[SPACE_AXES:count]) == list(end_counts[SPACE_AXES:]):
        count = min(count, SPACE_AXES)
    scales = machine.path_counts[:count]
    start_mm, end_mm = (
        tuple(place[k] / own for k, own in enumerate(scales)) for place in (here, end_counts)
    )
    distance_mm = 0.0
    moves = legs(start_mm, end_mm, machine)
    if moves and controller.read(OVERRIDE, 1) == 0:
        raise RefusedError(
            f"goto: the feed override of {controller.who()} is 0 %, nothing would move: hodograph override 100 first"
        )
    for a, b in moves:
        image = line_image(a, b, machine)
        controller.upload(image)
        controller.start(unhomed=unhomed, image=image)
        controller.wait_for_end(tick=tick)
        _require_arrival(controller, machine, b)
        distance_mm += math.dist(a[:SPACE_AXES], b[:SPACE_AXES])
    return distance_mm


def _require_arrival(controller: Controller, machine: Machine, end: Place) -> None:
    """Raises RunError: the axes stand at another place than the end of the move."""
    axes, at = machine.path_axes[: len(end)], controller.targets(len(end))
    wanted = [round(place * scale) for place, scale in zip(end, machine.path_counts, strict=False)]
    if any(abs(own - there) > 1 for own, there in zip(at, wanted, strict=True)):
        where = ", ".join(
            f"{axis.name} {counts / axis.counts_per_unit:g} {axis.unit}"
            for axis, counts in zip(axes, at, strict=True)
        )
        raise RunError(
            f"{controller.who()}: the move was stopped on its way, the axes rest at {where}: hodograph goto again"
        )
