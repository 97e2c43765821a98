# SPDX-License-Identifier: MIT
"""Traces: one CSV row a tick."""

from __future__ import annotations

from pathlib import Path

from ..errors import InputError
from .motion import Motion

TRACE_HEADER = (
    "tick,t_s,arc_length_mm,feed_mm_s,x_cmd_mm,y_cmd_mm,x_set_counts,y_set_counts,"
    "x_act_mm,y_act_mm,contour_error_um,x_volts,y_volts"
)

_CHUNK = 65536


def write_trace(motion: Motion, file: Path) -> None:
    """Write the program's ticks of a run whose rows were kept; floats in full precision.

    t_s is tick * period; rows are aligned as in docs/reference/protocol.md section 2. Raises InputError when
    the file cannot
    be written.
    """
    columns = [
        motion.rows["tick"],
        motion.t_s,
        motion.arc_length_mm,
        motion.feed_mm_s,
        *motion.cmd_mm.T,
        *motion.rows["set_counts"].T,
        *motion.act_mm.T,
        motion.contour_error_um,
        *motion.volts.T,
    ]
    try:
        with file.open("w", encoding="ascii", newline="\n") as out:
            out.write(TRACE_HEADER + "\n")
            for first in range(0, motion.ticks, _CHUNK):
                part = slice(first, min(first + _CHUNK, motion.ticks))
                texts = [map(repr, column[part].tolist()) for column in columns]
                out.writelines(",".join(row) + "\n" for row in zip(*texts, strict=True))
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None
