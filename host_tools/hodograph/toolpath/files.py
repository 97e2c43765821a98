# SPDX-License-Identifier: MIT
"""Reads toolpath files of every kind: G-code, drawings (DXF, SVG) and points. The ending of the name gives the kind.
The name "-" is G-code from stdin. Used by many modules of host_tools: jobs, streaming, the Python API, the command
import. Reads the file that it is given, or stdin.

for command in read_toolpath(Path("part.dxf"), ReadOptions(feed_mm_s=20.0)):
    ...
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import InputError
from ..names import (
    DRAWING_SUFFIXES,
    GCODE_SUFFIXES,
    POINT_SUFFIXES,
    STANDARD_INPUT,
)
from .moves import Command, WorkFrame

# A reader is imported when a file of its kind is read, since the readers load modules that other commands do not need.
if TYPE_CHECKING:
    from .drawing import DrawingOptions
    from .points import PointOptions


@dataclass(frozen=True)
class ReadOptions:
    """Options for what a file itself does not define. None and empty: not given.

    feed_mm_s  feed: required for drawings, and for points without a column of feeds; in G-code it replaces F
    feeds      drawings: layers or colours, each with its feed in place of `feed_mm_s`
    layers     drawings: only these layers, in this order
    ids        drawings: only elements with these identities (SVG: id, DXF: handle)
    gap_mm     drawings: ends of contours at this distance or less are joined
    lift_mm    drawings: height of rapid moves above the drawing
    scale      drawings and points: factor on lengths
    unit_mm    drawings and points: length of a unit of the file
    columns    points: names of the columns
    noise_mm   points: greatest distance of points from the curve that they sample, which is the tolerance then
    closed     points: the path returns to the first point
    block_delete         G-code: lines that begin with "/" are left out
    skip_optional_stops  G-code: M1 is left out
    """

    feed_mm_s: float | None = None
    feeds: tuple[tuple[str, float], ...] = ()
    layers: tuple[str, ...] = ()
    ids: tuple[str, ...] = ()
    gap_mm: float | None = None
    lift_mm: float | None = None
    scale: float | None = None
    unit_mm: float | None = None
    columns: tuple[str, ...] = ()
    noise_mm: float | None = None
    closed: bool = False
    block_delete: bool = False
    skip_optional_stops: bool = False


_OPTIONS_OF = {
    "--feed-of": ("feeds", DRAWING_SUFFIXES),
    "--layer": ("layers", DRAWING_SUFFIXES),
    "--id": ("ids", DRAWING_SUFFIXES),
    "--gap": ("gap_mm", DRAWING_SUFFIXES),
    "--lift": ("lift_mm", DRAWING_SUFFIXES),
    "--scale": ("scale", (*DRAWING_SUFFIXES, *POINT_SUFFIXES)),
    "--unit": ("unit_mm", (*DRAWING_SUFFIXES, *POINT_SUFFIXES)),
    "--columns": ("columns", POINT_SUFFIXES),
    "--noise": ("noise_mm", POINT_SUFFIXES),
    "--closed": ("closed", POINT_SUFFIXES),
    "--block-delete": ("block_delete", GCODE_SUFFIXES),
    "--skip-optional-stops": ("skip_optional_stops", GCODE_SUFFIXES),
}
"""Options of the command line, each with its field of ReadOptions and the endings of the files that accept it."""


def is_gcode(file: Path) -> bool:
    """Whether a toolpath is G-code.

    A Message of G-code is for the operator. A Message of another file reports what the reader left out.
    """
    return file.suffix.lower() in GCODE_SUFFIXES or str(file) == STANDARD_INPUT


def replaced_feed_mm_s(file: Path, options: ReadOptions) -> float | None:
    """The feed that replaces those of a file; None: they stay. Contours of a drawing have got theirs by the options."""
    return None if file.suffix.lower() in DRAWING_SUFFIXES else options.feed_mm_s


def asked_tolerance_mm(tolerance_mm: float, options: ReadOptions) -> float:
    """The tolerance of a toolpath: that of the user, or the noise of points where this is more."""
    return max(tolerance_mm, options.noise_mm or 0.0)


def read_toolpath(
    file: Path, options: ReadOptions, frame: WorkFrame | None = None
) -> Iterator[Command]:
    """The commands of a file; the last one is ProgramEnd. A file with an unknown ending is read as points.

    frame  where the toolpath lies in the machine; None: at machine position 0, and starts there

    The iterator raises all errors, the call raises none. InputError: the file cannot be read, a drawing has no feed, or
    files of this kind do not accept an option. ToolpathError: the reader cannot read the file further.
    """
    _check_options(file, options)
    frame = frame or WorkFrame()
    suffix = file.suffix.lower()
    if suffix == ".dxf":
        from .dxf import read_dxf

        yield from read_dxf(file, _drawing_options(file, options, frame))
    elif suffix in DRAWING_SUFFIXES:
        from .svg import read_svg

        yield from read_svg(file, _drawing_options(file, options, frame))
    else:
        yield from _read_lines(file, options, frame)


def _check_options(file: Path, options: ReadOptions) -> None:
    """Raises InputError: an option is not for files of this kind."""
    suffix = GCODE_SUFFIXES[0] if is_gcode(file) else file.suffix.lower()
    for option, (name, suffixes) in _OPTIONS_OF.items():
        if getattr(options, name) not in (None, (), False) and suffix not in suffixes:
            raise InputError(f"{file}: {option} is for {', '.join(suffixes)}: leave it out")


def _drawing_options(file: Path, options: ReadOptions, frame: WorkFrame) -> DrawingOptions:
    from .drawing import DrawingOptions

    if options.feed_mm_s is None:
        raise InputError(f"{file}: a drawing has no feed: add --feed MM/S")
    given = {
        name: value
        for name in ("gap_mm", "lift_mm", "scale")
        if (value := getattr(options, name)) is not None
    }
    return DrawingOptions(
        options.feed_mm_s,
        feeds=dict(options.feeds),
        unit_mm=options.unit_mm,
        layers=options.layers,
        ids=options.ids,
        start=frame.start,
        **given,
    )


def _read_lines(file: Path, options: ReadOptions, frame: WorkFrame) -> Iterator[Command]:
    """The commands of G-code or points, read line by line from a file or from stdin."""
    from_input = str(file) == STANDARD_INPUT
    place: Path | int = 0 if from_input else file
    try:
        with open(
            place, encoding="utf-8", errors="surrogateescape", closefd=not from_input
        ) as lines:
            if is_gcode(file):
                from .gcode import Options, read_gcode

                own = Options(
                    work=frame.offset,
                    start=frame.start,
                    feed_mm_s=options.feed_mm_s,
                    block_delete=options.block_delete,
                    optional_stops=not options.skip_optional_stops,
                )
                yield from read_gcode(lines, str(file), own)
            else:
                from .points import read_points

                yield from read_points(lines, str(file), _point_options(options, frame))
    except FileNotFoundError:
        raise InputError(f"{file}: no such file") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be read: {error.strerror or error}") from None


def _point_options(options: ReadOptions, frame: WorkFrame) -> PointOptions:
    from .points import PointOptions

    return PointOptions(
        feed_mm_s=options.feed_mm_s,
        unit_mm=1.0 if options.unit_mm is None else options.unit_mm,
        scale=1.0 if options.scale is None else options.scale,
        columns=options.columns,
        noise_mm=0.0 if options.noise_mm is None else options.noise_mm,
        closed=options.closed,
        start=frame.start,
    )
