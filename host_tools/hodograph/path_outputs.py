# SPDX-License-Identifier: MIT
"""Outputs that a path file switches on its path, as events of a program. Used by pipeline.py and stream/. No I/O."""

from __future__ import annotations

from .config.machine_file import Machine
from .config.outputs import PathOutput
from .config.path_file import PathFile
from .errors import InputError
from .events import Event, Events, events_of, no_events
from .fixed_point import nearest_q40
from .spline.frames import Curve

END_MM = 1e-6
"""A place this little beyond the end counts as the end: a computed length is rounded."""


def events_on_path(file: PathFile, machine: Machine, curve: Curve) -> Events:
    """The events of a path file on its curve. Raises InputError: no such output or place, or a value that is wrong."""
    if not file.outputs:
        return no_events()
    points = len(file.given_path.points)
    return events_of(
        _event(file, one, machine, _place_q40(one, curve, points)) for one in file.outputs
    )


def require_output(file: PathFile, output: PathOutput, machine: Machine) -> None:
    """Raises InputError: the machine does not have an output of a path file, or its value is wrong."""
    _event(file, output, machine, 0)


def _event(file: PathFile, output: PathOutput, machine: Machine, place_q40: int) -> Event:
    if machine.outputs is None:
        raise InputError(
            f"{file.file}: has [[output]], but the machine {machine.file} has no outputs: add [outputs] to it"
        )
    return output.event(machine.outputs.channel(output.name, output.where), place_q40)


def _place_q40(output: PathOutput, curve: Curve, points: int) -> int:
    place_mm, length_mm = _place_mm(output, curve, points), curve.length_mm
    if place_mm > length_mm + END_MM:
        raise InputError(
            f"{output.where}: at_mm = {place_mm:.9g} is beyond the end of the path, {length_mm:.9g} mm"
        )
    return nearest_q40(place_mm)


def _place_mm(output: PathOutput, curve: Curve, points: int) -> float:
    if output.at_mm is not None:
        return output.at_mm
    if output.at_fraction is not None:
        return output.at_fraction * curve.length_mm
    starts = curve.segment_starts_mm
    if len(starts) != points + curve.closed:
        raise InputError(
            f"{output.where}: at_point cannot be used, since points of the path repeat: give each once, or at_mm"
        )
    return float(starts[output.at_point or 0])
