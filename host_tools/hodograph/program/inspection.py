# SPDX-License-Identifier: MIT
"""A program as text and as plain numbers: `hodograph inspect`. Used by cli/ and stream/paths. No I/O."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..events import ANALOGUE, DIGITAL, PROPORTIONAL, Event
from ..feed.pieces import derivative_peaks
from ..fixed_point import MM_PER_Q40
from ..names import AXES
from .geometry import arc_to_q40, segment_arcs
from .image import (
    COMPACT_PIECE_BYTES,
    COMPACT_PIECE_SIZE,
    COMPACT_STOP_SIZE,
    PIECE_SIZE,
    RECORD_BYTES,
    STOP_SIZE,
    VERSION,
    Program,
    header_size,
    record_bytes,
    segment_size,
)
from .stops import FAULT, HOLD, numbers, stops_dict, stops_text

RING_BYTES = 48 * 1024
"""Memory for chunks of the small controllers (0x2060 sub 14)."""

_ROWS = 12
"""First and last rows of a table that are shown if it is not shown whole."""


def inspect_dict(program: Program) -> dict[str, Any]:
    """The content of a program as plain numbers in mm and s, for JSON.

    If `first_axis` is not 0, rotary axes move alone, and mm stands for degrees.
    """
    pieces = program.pieces
    feed, acceleration, jerk = derivative_peaks(pieces.duration_q32_s, pieces.c_q40)
    return {
        "name": program.name,
        "version": VERSION,
        "image_bytes": program.image_size,
        "record_bytes": _bytes(program),
        "period_us": program.period_us,
        "closed": program.closed,
        "first_axis": program.first_axis,
        "segments": program.segment_count,
        "pieces": program.piece_count,
        "ticks": program.ticks,
        "duration_s": program.duration_s,
        "length_mm": program.length_mm,
        "offset_mm": [one * MM_PER_Q40 for one in program.offset_q40],
        "start_mm": (program.point_q40[:, 0] * MM_PER_Q40).tolist(),
        "end_mm": (end_point_q40(program) * MM_PER_Q40).tolist(),
        "feed_limit_mm_s": program.feed_limit_um_s / 1000 or None,
        "acceleration_limit_mm_s2": program.acceleration_limit_um_s2 / 1000 or None,
        "jerk_limit_mm_s3": float(program.jerk_limit_mm_s3) or None,
        "peak_feed_mm_s": float(feed.max()),
        "peak_acceleration_mm_s2": float(acceleration.max()),
        "peak_jerk_mm_s3": float(jerk.max()),
        "override_factor_least": float(pieces.override_factor.min()),
        "override_rate_least_per_s": float(pieces.override_rate_per_s().min()),
        "override_second_least_per_s2": float(pieces.override_second_per_s2().min()),
        "stops": stops_dict(program.stops, program.piece_starts_mm),
        "events": [_event_dict(Event(*event)) for event in program.events.tolist()],
    }


def _bytes(program: Program) -> dict[str, Any]:
    """Bytes of an image, of its parts and of their coefficient records; and the motion that a ring for chunks can
    hold.
    """
    segments, pieces, seconds = ring_holds(program, RING_BYTES)
    return {
        "header": header_size(program.axis_count),
        "segment": segment_size(program.axis_count),
        "piece": PIECE_SIZE,
        "stop": STOP_SIZE,
        "compact": {
            "segment": segment_size(program.axis_count, compact=True),
            "piece": COMPACT_PIECE_SIZE,
            "stop": COMPACT_STOP_SIZE,
        },
        "coefficients": {kernel: _coefficients(program, kernel) for kernel in RECORD_BYTES},
        "image_per_s": program.image_size / program.duration_s,
        "ring": RING_BYTES,
        "segments_in_ring": segments,
        "pieces_in_ring": pieces,
        "seconds_in_ring": seconds,
    }


def _coefficients(program: Program, kernel: str) -> dict[str, int]:
    of_segment, of_piece = record_bytes(RECORD_BYTES[kernel], program.axis_count)
    return {"segment": of_segment, "piece": of_piece}


def ring_holds(program: Program, ring_bytes: int) -> tuple[int, int, float]:
    """Segments, pieces and seconds that fill `size` bytes as compact records, at the densest place of the program. For
    a smaller program, at its mean density.
    """
    size = (
        segment_size(program.axis_count, compact=True),
        COMPACT_PIECE_BYTES,
    )
    starts = np.append(program.pieces.start_q40, program.length_q40)
    times = np.concatenate((np.zeros(1), np.cumsum(program.pieces.duration_q32_s) * 2.0**-32))
    # number of segments that begin before the end of each piece
    begun = np.searchsorted(program.start_q40, starts, side="right")
    filled = begun * size[0] + np.arange(program.piece_count + 1) * size[1]
    last = np.searchsorted(filled, filled + ring_bytes, side="right") - 1
    if last[0] == program.piece_count:
        times_as_many = ring_bytes / (
            program.segment_count * size[0] + program.piece_count * size[1]
        )
        return (
            int(times_as_many * program.segment_count),
            int(times_as_many * program.piece_count),
            times_as_many * float(times[-1]),
        )
    full = np.flatnonzero(last < program.piece_count)
    least = full[np.argmin(times[last[full]] - times[full])]
    end = last[least]
    return int(begun[end] - begun[least]), int(end - least), float(times[end] - times[least])


def _bytes_text(found: dict[str, Any]) -> str:
    compact = found["compact"]
    coefficients = "; ".join(
        f"{kernel} {one['segment']} and {one['piece']}"
        for kernel, one in found["coefficients"].items()
    )
    return (
        f"bytes     header {found['header']}, segment {found['segment']}, piece {found['piece']} with stop "
        f"{found['stop']}; {found['image_per_s']:.0f} a second of motion\n"
        f"          in chunks: segment {compact['segment']}, piece {compact['piece']} with stop {compact['stop']}\n"
        f"          coefficients of a segment and a piece: {coefficients}\n"
        f"ring      {found['ring'] // 1024} KiB hold {found['segments_in_ring']} segments and "
        f"{found['pieces_in_ring']} pieces, {found['seconds_in_ring']:.3g} s, where they are densest"
    )


def end_point_q40(program: Program) -> NDArray[np.int64]:
    """The end point of a program, (A,) in 2^-40 mm or degrees."""
    *distances, _ = (
        int(arc_to_q40(distance)[0]) for distance in segment_arcs(program.a_q44[:, -1:])
    )
    distances += [int(one) for one in program.extra_q40[:, -1, -1]]
    return np.asarray(program.point_q40[:, -1] + np.array(distances, dtype=np.int64))


def inspect_text(program: Program, *, full: bool = False) -> str:
    """The contents of a program as text, with the tables of segments and pieces (their first and last rows, or all)."""
    d = inspect_dict(program)
    limits = ", ".join(
        f"{key} {d[name]:g} {unit}"
        for key, name, unit in (
            ("feed", "feed_limit_mm_s", "mm/s"),
            ("acceleration", "acceleration_limit_mm_s2", "mm/s^2"),
            ("jerk", "jerk_limit_mm_s3", "mm/s^3"),
        )
        if d[name] is not None
    )
    names = AXES[: program.axis_count]
    turning = (
        "axes      turn alone: x, y below are numbers "
        f"{program.first_axis + 1} and {program.first_axis + 2} of the machine's path; mm stands for its degrees"
    )
    lines = [
        f"program   {d['name'] or '(no name)'}, format {d['version']}, {d['image_bytes']} bytes",
        _bytes_text(d["record_bytes"]),
        *([turning] if program.first_axis else []),
        f"path      {'closed' if d['closed'] else 'open'}, {d['length_mm']:.9f} mm in {d['segments']} segments",
        f"from      ({', '.join(f'{mm:.9f}' for mm in d['start_mm'])}) mm",
        f"to        ({', '.join(f'{mm:.9f}' for mm in d['end_mm'])}) mm",
        f"offset    ({', '.join(f'{mm:g}' for mm in d['offset_mm'])}) mm, contained",
        f"time      {d['duration_s']:.9f} s in {d['pieces']} pieces, {d['ticks']} ticks of {d['period_us']} us",
        f"limits    {limits or 'none given'}",
        f"peaks     feed {d['peak_feed_mm_s']:.6g} mm/s, acceleration {d['peak_acceleration_mm_s2']:.6g} "
        f"mm/s^2, jerk {d['peak_jerk_mm_s3']:.6g} mm/s^3 (bounds of the pieces)",
        f"override  factor {d['override_factor_least']:.4g}, rate {d['override_rate_least_per_s']:.4g} /s, "
        f"second {d['override_second_least_per_s2']:.4g} /s^2 (tightest)",
        *stops_text(program.stops, program.piece_starts_mm, "deg" if program.first_axis else "mm"),
        "",
        " segment       start mm"
        + "".join(f"{one + ' mm':>15}" for one in names)
        + "      length mm",
        *_rows(_segment_rows(program), full),
        "",
        "   piece     duration s       start mm  feed mm/s  peak acc  peak jerk  factor    rate  second",
        *_rows(_piece_rows(program), full),
        "",
        "   piece     hold: mm/s^3   mm/s^2   mm/s^3  bound s    fault: mm/s^3   mm/s^2   mm/s^3  bound s",
        *_rows(_stop_rows(program), full),
        *_event_lines(program, full),
    ]
    return "\n".join(lines) + "\n"


_EVENT_KINDS = {DIGITAL: "digital", ANALOGUE: "analogue", PROPORTIONAL: "proportional"}


def _event_dict(event: Event) -> dict[str, Any]:
    return {
        "place_mm": event.place_q40 * MM_PER_Q40,
        "kind": _EVENT_KINDS.get(event.kind, f"{event.kind}"),
        "channel": event.channel,
        "mask": event.mask,
        "value": event.value / 65536 if event.kind == PROPORTIONAL else event.value,
    }


def _event_lines(program: Program, full: bool) -> list[str]:
    """The table of events; empty: there is none."""
    if not len(program.events):
        return []
    rows = [
        f"{i:8d} {d['place_mm']:14.9f} {d['kind']:>13} {d['channel']:8d}   0x{d['mask']:04X} {d['value']:12g}"
        for i, d in enumerate(_event_dict(Event(*event)) for event in program.events.tolist())
    ]
    return [
        "",
        "   event       place mm          kind  channel     mask        value",
        *_rows(rows, full),
    ]


def _segment_rows(program: Program) -> list[str]:
    joints = np.append(program.start_q40, program.length_q40) * MM_PER_Q40
    rows = np.column_stack((joints[:-1], program.point_q40.T * MM_PER_Q40, np.diff(joints)))
    return [f"{i:8d} " + " ".join(f"{mm:14.6f}" for mm in row) for i, row in enumerate(rows)]


def _piece_rows(program: Program) -> list[str]:
    pieces = program.pieces
    feed, acceleration, jerk = derivative_peaks(pieces.duration_q32_s, pieces.c_q40)
    factor = pieces.override_factor
    rate, second = pieces.override_rate_per_s(), pieces.override_second_per_s2()
    return [
        f"{i:8d} {pieces.duration_q32_s[i] * 2.0**-32:14.9f} {pieces.start_q40[i] * MM_PER_Q40:14.6f} "
        f"{feed[i]:10.4f} {acceleration[i]:9.2f} {jerk[i]:10.1f} "
        f"{factor[i]:7.4f} {rate[i]:7.4g} {second[i]:7.4g}"
        for i in range(program.piece_count)
    ]


def _stop_rows(program: Program) -> list[str]:
    given, bound = numbers(program.stops.codes), program.stops.bound_us * 1e-6
    rows = []
    for i in range(program.piece_count):
        cells = [
            f"{given[i, kind, 0]:14.6g} {given[i, kind, 1]:8.5g} {given[i, kind, 2]:8.6g} {bound[i, kind]:8.4f}"
            for kind in (HOLD, FAULT)
        ]
        rows.append(f"{i:8d} " + "   ".join(cells))
    return rows


def _rows(rows: list[str], full: bool) -> list[str]:
    if full or len(rows) <= 2 * _ROWS:
        return rows
    return [*rows[:_ROWS], f"     ... {len(rows) - 2 * _ROWS} more", *rows[-_ROWS:]]
