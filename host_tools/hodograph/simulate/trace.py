# SPDX-License-Identifier: MIT
"""Traces: CSV files with one row for each tick (option `--trace`). Used by cli/. Writes the file that it is given."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ..errors import InputError
from ..names import AXES
from .motion import Motion


def trace_header(
    names: Sequence[str], units: Sequence[str] | None = None, outputs: Sequence[str] = ()
) -> str:
    """The first line of a trace of axes with these names and units (default mm), and of outputs."""
    of = ("mm",) * len(names) if units is None else units
    columns = ["tick", "t_s", "arc_length_mm", "feed_mm_s"]
    columns += [f"{name}_cmd_{unit}" for name, unit in zip(names, of, strict=True)]
    columns += [f"{name}_set_counts" for name in names]
    columns += [f"{name}_act_{unit}" for name, unit in zip(names, of, strict=True)]
    errors = [f"{name}_error_{unit}" for name, unit in zip(names[3:], of[3:], strict=True)]
    columns += ["contour_error_um", *errors, *(f"{name}_volts" for name in names)]
    return ",".join([*columns, *(f"{name}_out" for name in outputs)])


TRACE_HEADER = trace_header(AXES[:2])
"""The first line of a trace in the plane."""

_CHUNK = 65536
"""Rows that are written at once, to bound the memory."""


def write_trace(motion: Motion, file: Path) -> None:
    """Writes one row for each tick of the program, of a run whose rows were kept; floats in full precision.

    t_s is tick * period; rows are aligned as in docs/reference/protocol.md section 2. Raises InputError when the
    file cannot be written.
    """
    outputs = motion.output_columns
    columns = [
        motion.rows["tick"],
        motion.t_s,
        motion.arc_length_mm,
        motion.feed_mm_s,
        *motion.cmd_mm.T,
        *motion.set_counts.T,
        *motion.act_mm.T,
        motion.contour_error_um,
        *motion.orientation_error.T,
        *motion.volts.T,
        *outputs.values(),
    ]
    try:
        with file.open("w", encoding="ascii", newline="\n") as out:
            out.write(trace_header(motion.names, motion.units, tuple(outputs)) + "\n")
            for first in range(0, motion.ticks, _CHUNK):
                part = slice(first, min(first + _CHUNK, motion.ticks))
                texts = [map(repr, column[part].tolist()) for column in columns]
                out.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None
