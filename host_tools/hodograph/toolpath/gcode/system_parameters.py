# SPDX-License-Identifier: MIT
"""Parameters that hold the state of the interpreter, with the numbers and names that LinuxCNC gives them. Used by
gcode/interpreter. No I/O.

#5400                  tool in the spindle
#5401 to #5406         tool offset in force, in mm and degrees
#5420 to #5425         program position, in program units
#<_x> to #<_c>         the same
#5021 to #5026         machine position, in program units
#<_abs_x> to #<_abs_c> the same
#<_line>               number of the line
#<_metric> #<_imperial> #<_absolute> #<_incremental> #<_ijk_absolute_mode> #<_inverse_time> #<_units_per_minute>
#<_units_per_rev> #<_retract_r_plane> #<_retract_old_z> #<_mist> #<_flood> #<_spindle_on> #<_spindle_cw>
#<_tool_offset> #<_feed_override> #<_speed_override>
                       1 or 0
#<_motion_mode> #<_plane> #<_coord_system>
                       ten times the number of the G code; -1 if there is none
#<_feed> #<_rpm>       F as programmed, and S
#<_current_tool> #<_selected_tool>
                       tool numbers
#<_call_level>         how many subroutines are active
#<_value> #<_value_returned>
                       what the last subroutine returned, and whether it did
#<_task>               0: nothing moves while the program is read
"""

from __future__ import annotations

from collections.abc import Callable

from ..moves import AXES, FeedMode, Plane, Rotation
from .coordinates import Coordinates
from .modes import Modes
from .parameters import Getter, Parameters

_PLANE_CODES = {Plane.XY: 170.0, Plane.ZX: 180.0, Plane.YZ: 190.0}
_SYSTEM_CODES = (540.0, 550.0, 560.0, 570.0, 580.0, 590.0, 591.0, 592.0, 593.0)


def add_system_parameters(parameters: Parameters, modes: Modes, where: Coordinates) -> None:
    """Make `parameters` read the state in `modes` and `where`."""
    numbers, names = parameters.computed_numbers, parameters.computed_names
    numbers[5400] = lambda: float(modes.tool)
    for axis, letter in enumerate(AXES):
        numbers[5401 + axis] = _tool_offset(where, axis)
        numbers[5420 + axis] = names[f"_{letter}"] = _program_coordinate(modes, where, axis)
        numbers[5021 + axis] = names[f"_abs_{letter}"] = _machine_coordinate(modes, where, axis)
    for name, is_true in _flags(modes).items():
        names[name] = _as_number(is_true)
    names["_call_level"] = lambda: float(parameters.level)
    names["_line"] = lambda: float(modes.line)
    names["_motion_mode"] = lambda: -1.0 if modes.motion is None else float(modes.motion)
    names["_plane"] = lambda: _PLANE_CODES[modes.plane]
    names["_coord_system"] = lambda: _SYSTEM_CODES[where.system - 1]
    names["_feed"] = lambda: modes.feed_word
    names["_rpm"] = lambda: modes.speed_rev_min
    names["_current_tool"] = lambda: float(modes.tool)
    names["_selected_tool"] = lambda: float(modes.selected_tool)
    names["_task"] = lambda: 0.0
    names["_value"] = lambda: modes.returned or 0.0
    names["_value_returned"] = lambda: float(modes.returned is not None)


def _flags(modes: Modes) -> dict[str, Callable[[], bool]]:
    return {
        "_metric": lambda: modes.unit_mm == 1.0,
        "_imperial": lambda: modes.unit_mm != 1.0,
        "_absolute": lambda: modes.absolute,
        "_incremental": lambda: not modes.absolute,
        "_ijk_absolute_mode": lambda: modes.absolute_centre,
        "_inverse_time": lambda: modes.feed_mode is FeedMode.INVERSE_TIME,
        "_units_per_minute": lambda: modes.feed_mode is FeedMode.PER_MINUTE,
        "_units_per_rev": lambda: modes.feed_mode is FeedMode.PER_REVOLUTION,
        "_retract_r_plane": lambda: modes.retract_to_r,
        "_retract_old_z": lambda: not modes.retract_to_r,
        "_mist": lambda: modes.mist,
        "_flood": lambda: modes.flood,
        "_spindle_on": lambda: modes.rotation is not Rotation.STOPPED,
        "_spindle_cw": lambda: modes.rotation is Rotation.CLOCKWISE,
        "_tool_offset": lambda: modes.uses_tool_offset,
        "_feed_override": lambda: modes.overrides,
        "_speed_override": lambda: modes.overrides,
    }


def _as_number(is_true: Callable[[], bool]) -> Getter:
    return lambda: float(is_true())


def _tool_offset(where: Coordinates, axis: int) -> Getter:
    return lambda: where.tool[axis]


def _program_coordinate(modes: Modes, where: Coordinates, axis: int) -> Getter:
    return lambda: modes.in_program_units(axis, where.to_program(modes.position)[axis])


def _machine_coordinate(modes: Modes, where: Coordinates, axis: int) -> Getter:
    return lambda: modes.in_program_units(axis, modes.position[axis] + where.work[axis])
