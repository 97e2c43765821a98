# SPDX-License-Identifier: MIT
"""Writes the golden program images of tests/data/programs and their table, `manifest.txt`.

    .venv/bin/python tests/data/make_golden.py

Good images hold the alpha, the heart, the star and lines with all profiles. Broken ones each break one rule of
docs/reference/protocol.md: the table gives the code that C and Python must both answer, with its segment or piece. All
are to be checked against LIMITS (repeated in the table).

The files are committed. Run by hand when the format or the planning of stops changes:
tests/host/program/test_golden.py compares the files with what this module makes.
"""

from __future__ import annotations

import struct
import sys
import tomllib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from hodograph.events import ANALOGUE, DIGITAL, PROPORTIONAL, Event, events_of
from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed
from hodograph.feed.pieces import FeedPieces
from hodograph.program import Program, ProgramLimits, ProgramOptions, compile_program, encode
from hodograph.program.check import Fault, check_image
from hodograph.program.codes import ProgramError
from hodograph.program.image import HEADER_SIZE, PIECE_SIZE, SEGMENT_SIZE, STOP_SIZE, with_crc
from hodograph.program.stops import FAULT, HOLD, no_stops
from hodograph.spline import PHSpline, from_control_polygon, line

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "support"))

import spatial_image as space

HERE = Path(__file__).parent
PROGRAMS = HERE / "programs"
EXAMPLES = HERE.parent.parent / "examples"
MM = 1 << 40

LIMITS = ProgramLimits(1000, 500_000, 5_000_000, 200_000, (-200 * MM,) * 2, (200 * MM,) * 2, 250)
EVENTS = (
    Event(0, DIGITAL, 0, 0x8001, 0x0001),
    Event(20 * MM, ANALOGUE, 0, 0, -1000),
    Event(20 * MM + 1, PROPORTIONAL, 2, 0, 65536),
)
DENSE = Event(20 * MM, DIGITAL, 0, 1, 1)

CONTROLLER = ControllerLimits(500.0, 5000.0, 200000.0, 0.02)


def example(name: str) -> PHSpline:
    """The spline of an example file."""
    path = tomllib.loads((EXAMPLES / f"{name}.toml").read_text())["path"]
    points = np.array([complex(x, y) for x, y in path["control_points"]])
    if path["closed"] and points.size > 4 and np.array_equal(points[:3], points[-3:]):
        points = points[:-3]
    return from_control_polygon(points, path["closed"]).spline


def program(
    spline: PHSpline,
    request: FeedRequest,
    name: str,
    *,
    period_us: int = 1000,
    offset_mm: tuple[float, ...] = (),
    controller: ControllerLimits = CONTROLLER,
) -> Program:
    """A program of `request` along `spline`, checked against the format but no controller."""
    limits = Limits(None, 2000.0, 50000.0, "report")
    plan = plan_feed(spline.length_mm, request, limits, controller, period_us=period_us)
    return compile_program(spline, plan, ProgramOptions(offset_mm=offset_mm, name=name))


def good() -> dict[str, Program]:
    """Programs that every rule and LIMITS allow."""
    alpha, heart, star = example("alpha"), example("heart"), example("star")
    exponential = FeedRequest("exponential", 100.0, 0.1)
    return {
        "alpha_exponential": program(alpha, exponential, "alpha"),
        "alpha_quintic": program(alpha, FeedRequest("quintic", 100.0, 0.1), "alpha"),
        "alpha_minimax": program(alpha, FeedRequest("minimax", 100.0, 0.1, degree=7), "alpha"),
        "heart_exponential": program(heart, exponential, "heart"),
        "heart_minimax": program(heart, FeedRequest("minimax", 150.0, 0.1), "heart"),
        "star_minimax": program(star, FeedRequest("minimax", 60.0, 0.05, degree=9), "star"),
        "line": program(line(-30 + 10j, 90 - 20j), FeedRequest("quintic", 200.0, 0.2), "line"),
        "line_slow": program(line(0, 0.5 + 0.25j), FeedRequest("quintic", 0.05, 0.5), "line slow"),
        "line_tiny": program(line(5, 5.002), FeedRequest("minimax", 10.0, 0.05), "line tiny"),
        "alpha_events": replace(
            program(alpha, FeedRequest("minimax", 100.0, 0.1), "alpha"), events=events_of(EVENTS)
        ),
        "alpha_offset": program(alpha, exponential, "alpha, shifted", offset_mm=(100.0, -57.25)),
    }


def base() -> Program:
    """What the broken images are made from: small, with enough segments and pieces for every rule."""
    return program(example("alpha"), FeedRequest("minimax", 100.0, 0.1), "broken")


def _with_event(p: Program, event: Event) -> Program:
    """A program with good events and this one, by its place after the last of them."""
    wrong = event._replace(place_q40=EVENTS[-1].place_q40 + event.place_q40)
    table = np.array([*map(tuple, EVENTS), tuple(wrong)], dtype=events_of(EVENTS).dtype)
    return replace(p, events=table)


def segments(p: Program, **change: Callable[[np.ndarray], None]) -> Program:
    """`p` with segment arrays changed in place by functions of a copy."""
    arrays = {}
    for key, function in change.items():
        arrays[key] = getattr(p, key).copy()
        function(arrays[key])
    return replace(p, **arrays)


def pieces(p: Program, **change: Callable[[np.ndarray], None]) -> Program:
    """`p` with arrays of the pieces changed in place by functions of a copy."""
    arrays = {}
    for key, function in change.items():
        arrays[key] = getattr(p.pieces, key).copy()
        function(arrays[key])
    return replace(p, pieces=replace(p.pieces, **arrays))


def put(index: object, value: int) -> Callable[[np.ndarray], None]:
    """Sets element(s) of an array."""

    def function(array: np.ndarray) -> None:
        array[index] = value

    return function


def add(index: object, value: int) -> Callable[[np.ndarray], None]:
    """Adds to element(s) of an array."""

    def function(array: np.ndarray) -> None:
        array[index] += value

    return function


def patch(image: bytes, offset: int, value: bytes) -> bytes:
    """The image with bytes replaced and the CRC made right again."""
    return with_crc(image[:offset] + value + image[offset + len(value) :])


def without_piece(p: Program, index: int) -> Program:
    """One piece left out and the time made right."""
    keep = np.arange(p.piece_count) != index
    own = p.pieces
    left = FeedPieces(
        own.duration_q32_s[keep],
        own.start_q40[keep],
        own.c_q40[keep],
        own.override_factor_q14[keep],
        own.override_rate_codes[keep],
        own.override_second_codes[keep],
    )
    return replace(p, pieces=left, stops=no_stops(len(left)), duration_q32_s=left.total_q32_s)


def longer(p: Program, index: int, by_q32: int) -> Program:
    """A piece given another duration, and the total with it."""
    changed = pieces(p, duration_q32_s=add(index, by_q32))
    return replace(changed, duration_q32_s=p.duration_q32_s + by_q32)


def split_short(p: Program, index: int) -> Program:
    """A constant-feed piece cut so that two neighbours last 1 ms each."""
    own = p.pieces
    ms = 1 << 22  # 0.977 ms
    total = int(own.duration_q32_s[index])
    cuts = [ms, ms, total - 2 * ms]
    c1 = int(own.c_q40[index, 0])
    scale = (total - 1).bit_length()
    feed = c1 / 2**scale  # q40 mm per unit of time
    start = int(own.start_q40[index])
    starts = [start + round(feed * sum(cuts[:k])) for k in range(4)]
    starts[3] = int(own.start_q40[index + 1])
    rows = np.zeros((3, 7), dtype=np.int64)
    for k, d in enumerate(cuts):
        rows[k, 0] = round((starts[k + 1] - starts[k]) * 2 ** (d - 1).bit_length() / d)

    def spread(array: np.ndarray, values: list[int] | np.ndarray) -> np.ndarray:
        middle = np.array(values, dtype=array.dtype)
        return np.concatenate((array[:index], middle, array[index + 1 :]))

    def same(array: np.ndarray) -> np.ndarray:
        return spread(array, [int(array[index])] * 3)

    def repeated(codes: np.ndarray) -> np.ndarray:
        return spread(codes, np.tile(codes[index], (3, 1)))

    return replace(
        p,
        pieces=FeedPieces(
            spread(own.duration_q32_s, cuts),
            spread(own.start_q40, starts[:3]),
            spread(own.c_q40, rows),
            same(own.override_factor_q14),
            repeated(own.override_rate_codes),
            repeated(own.override_second_codes),
        ),
        stops=no_stops(p.piece_count + 2),
    )


def shortened(p: Program) -> Program:
    """Segments 3 … 6 of a fine split of a line at full feed, too short for their tick."""
    spline = line(0, 60)
    fine = spline.split(60.0 / 400, 2.0)
    plan = plan_feed(spline.length_mm, FeedRequest("minimax", 100.0, 0.1), None, CONTROLLER)
    slow = compile_program(fine, plan, ProgramOptions(name="broken"))
    fast = plan_feed(slow.length_mm, FeedRequest("minimax", 200.0, 0.1), None, CONTROLLER)
    whole = fast.pieces_over(slow.length_q40)
    return replace(slow, pieces=whole, stops=no_stops(len(whole)), duration_q32_s=whole.total_q32_s)


def uneven() -> Program:
    """One segment whose parametric speed varies too much; otherwise in order."""
    w = np.array([[2.0, 3.0, 4.0]], dtype=complex)
    origin = np.zeros(1, dtype=complex)
    whole = PHSpline(origin, w, False)
    spline = whole.split(31.0, 2.0)
    plan = plan_feed(spline.length_mm, FeedRequest("minimax", 20.0, 0.1), None, CONTROLLER)
    p = compile_program(spline, plan, ProgramOptions(name="broken"))
    u = np.array([[2, 3, 4]], dtype=np.int64) << 44
    first = put(slice(None), 0)
    one = segments(p, start_q40=first, point_q40=first)
    return replace(
        one,
        start_q40=one.start_q40[:1],
        point_q40=one.point_q40[:, :1],
        a_q44=np.stack((u, np.zeros_like(u))),
    )


def broken() -> dict[str, tuple[bytes, str, int]]:
    """name -> (image, code, index)."""
    p = base()
    image = encode(p)
    n, m = p.segment_count, p.piece_count
    after = HEADER_SIZE + SEGMENT_SIZE * n
    table = after + PIECE_SIZE * m
    over = 1 << 8  # 2^-32 mm, four times the tolerance of joints
    straight = line(0, 80)
    fast = FeedRequest("quintic", 600.0, 0.3)
    wild = ControllerLimits(1000.0, 1e5, 1e7, 0.0)
    middle = int(np.flatnonzero(~p.pieces.c_q40[:, 1:].any(axis=1))[1])
    hard = FeedRequest("minimax", 250.0, 0.04)
    harder = FeedRequest("minimax", 400.0, 0.1, degree=3)
    out: dict[str, tuple[bytes, str, int]] = {
        "truncated": (image[:-1], "SIZE", 0),
        "short_header": (image[:100], "SIZE", 0),
        "empty": (b"", "SIZE", 0),
        "size_field": (patch(image, 8, struct.pack("<I", len(image) - 8)), "SIZE", 0),
        "count_too_many": (patch(image, 20, struct.pack("<I", 0xFFFFFFFF)), "SIZE", 0),
        "magic": (patch(image, 0, b"HDGX"), "MAGIC", 0),
        "version": (patch(image, 4, b"\x01\x00"), "VERSION", 0),
        "header_size": (patch(image, 6, b"\x00\x01"), "VERSION", 0),
        "crc": (image[:200] + bytes([image[200] ^ 1]) + image[201:], "CRC", 0),
        "no_pieces": (_no_pieces(image, n), "COUNT", 0),
        "period": (patch(image, 16, struct.pack("<I", 1500)), "PERIOD", 0),
        "period_used": (encode(_other_period(2000)), "PERIOD_USED", 0),
        "flags": (patch(image, 28, b"\x02\x00"), "FLAGS", 0),
        "event_count": (patch(image, 76, b"\x01"), "SIZE", 0),
        "axes": (patch(image, 30, b"\x07\x00"), "AXES", 0),
        "duration": (encode(replace(p, duration_q32_s=p.duration_q32_s + 1)), "DURATION", 0),
        "length_zero": (encode(replace(p, length_q40=0)), "LENGTH", 0),
        "length_negative": (encode(replace(p, length_q40=-p.length_q40)), "LENGTH", 0),
        "name": (patch(image, 111, b"x"), "NAME", 0),
        "w_range": (encode(segments(p, a_q44=put((0, 2, 1), 64 << 44))), "W_RANGE", 2),
        "w_range_minimum": (encode(segments(p, a_q44=put((1, 1, 0), -(2**63)))), "W_RANGE", 1),
        "point_range": (encode(segments(p, point_q40=put((1, 3), 4096 * MM))), "POINT_RANGE", 3),
        "point_range_minimum": (
            encode(segments(p, point_q40=put((0, 0), -(2**63)))),
            "POINT_RANGE",
            0,
        ),
        "arc_range": (encode(segments(p, start_q40=put(4, -1))), "ARC_RANGE", 4),
        "sigma": (encode(segments(p, a_q44=put((slice(None), 0), 0))), "SIGMA", 0),
        "sigma_ratio": (encode(uneven()), "SIGMA_RATIO", 0),
        "segment_long": (encode(segments(p, a_q44=put((0, 0), 6 << 44))), "SEGMENT_LONG", 0),
        "segment_first": (encode(segments(p, start_q40=put(0, over))), "SEGMENT_FIRST", 0),
        "join_point": (encode(segments(p, point_q40=add((0, 5), over))), "JOIN_POINT", 5),
        "join_point_y": (
            encode(segments(p, point_q40=add((1, n - 1), -over))),
            "JOIN_POINT",
            n - 1,
        ),
        "join_arc": (encode(segments(p, start_q40=add(2, over))), "JOIN_ARC", 2),
        "join_direction": (encode(_turned(p)), "JOIN_DIRECTION", 1),
        "segment_end": (encode(replace(p, length_q40=p.length_q40 + over)), "SEGMENT_END", n - 1),
        "not_closed": (patch(image, 28, b"\x01\x00"), "NOT_CLOSED", n - 1),
        "travel": (encode(_moved(p, 170 * MM)), "TRAVEL", 3),
        "piece_duration": (
            encode(longer(p, 3, -int(p.pieces.duration_q32_s[3]))),
            "PIECE_DURATION",
            3,
        ),
        "coefficient": (encode(pieces(p, c_q40=put((6, 6), (1 << 54) + 1))), "COEFFICIENT", 6),
        "coefficient_minimum": (encode(pieces(p, c_q40=put((6, 0), -(2**63)))), "COEFFICIENT", 6),
        "piece_long": (encode(_merged(p, middle)), "PIECE_LONG", middle),
        "piece_first": (encode(pieces(p, start_q40=put(0, over))), "PIECE_FIRST", 0),
        "join_length": (encode(pieces(p, start_q40=add(4, over))), "JOIN_LENGTH", 4),
        "join_feed": (encode(_bent(p, 4, 1)), "JOIN_FEED", 5),
        "join_acceleration": (encode(_bent(p, 4, 2)), "JOIN_ACCELERATION", 5),
        "start_moving": (encode(_cut_front(p)), "START_MOVING", 0),
        "end_moving": (encode(_bent(p, m - 1, 1)), "END_MOVING", m - 1),
        "piece_end": (encode(_piece_end(p)), "PIECE_END", m - 1),
        "piece_short": (encode(split_short(p, middle)), "PIECE_SHORT", middle + 1),
        "backwards": (encode(_backwards(p, 1)), "BACKWARDS", 1),
        "override_low": (
            encode(pieces(p, override_factor_q14=put(2, (1 << 14) - 1))),
            "OVERRIDE",
            2,
        ),
        "override_high": (
            encode(pieces(p, override_factor_q14=put(2, (2 << 14) + 1))),
            "OVERRIDE",
            2,
        ),
        "override_rate": (encode(pieces(p, override_rate_codes=put((7, 3), 0))), "OVERRIDE", 7),
        "override_second": (
            encode(pieces(p, override_second_codes=put((0, 6), 0))),
            "OVERRIDE",
            0,
        ),
        "segment_short": (encode(shortened(p)), "SEGMENT_SHORT", -1),
        "feed": (encode(program(line(-120, 160), fast, "broken", controller=wild)), "FEED", -1),
        "acceleration": (
            encode(program(straight, harder, "broken", controller=wild)),
            "ACCELERATION",
            -1,
        ),
        "stop_entry": (patch(image, table + STOP_SIZE * 4, b"\0"), "STOP_ENTRY", 4),
        "stop_reserved": (patch(image, table + STOP_SIZE * 5 + 7, b"\1"), "STOP_ENTRY", 5),
        "stop_numbers": (patch(image, table + STOP_SIZE * 2 + 4, b"\xa3"), "STOP_NUMBERS", 2),
        "stop_jerk": (patch(image, table + STOP_SIZE * 2, b"\x9d"), "STOP_NUMBERS", 2),
        "stop_hold_bound": (encode(_said(p, 6, HOLD, -100)), "STOP_BOUND", 6),
        "stop_fault_bound": (encode(_said(p, 7, FAULT, -100)), "STOP_BOUND", 7),
        "stop_long": (encode(_said(p, 3, FAULT, 300_000)), "STOP_LONG", 3),
        "stop_worst": (patch(image, 112, b"\0"), "STOP_WORST", 0),
        "event_kind": (encode(_with_event(p, Event(0, 4, 0, 0, 0))), "EVENT_KIND", 3),
        "event_channel": (encode(_with_event(p, Event(0, 2, 3, 0, 0))), "EVENT_KIND", 3),
        "event_value": (encode(_with_event(p, Event(0, 1, 0, 1, 2))), "EVENT_VALUE", 3),
        "event_order": (encode(_with_event(p, Event(-1, 1, 0, 1, 1))), "EVENT_PLACE", 3),
        "event_beyond": (encode(_with_event(p, Event(200 * MM, 1, 0, 1, 1))), "EVENT_PLACE", 3),
        "event_dense": (encode(replace(p, events=events_of([DENSE] * 17))), "EVENT_DENSE", 16),
        "stop_worst_way": (patch(image, 124, bytes(4)), "STOP_WORST", 0),
        "stop_none": (encode(replace(p, stops=no_stops(m))), "STOP_BOUND", m - 1),
        "jerk": (encode(program(straight, hard, "broken", controller=wild)), "JERK", -1),
    }
    return out


def _said(p: Program, index: int, kind: int, by_us: int) -> Program:
    """A stop's bound changed."""
    bound_us = p.stops.bound_us.astype(np.int64)
    bound_us[index, kind] += by_us
    return replace(p, stops=replace(p.stops, bound_us=bound_us.astype(np.uint32)))


def _no_pieces(image: bytes, n: int) -> bytes:
    size = HEADER_SIZE + SEGMENT_SIZE * n
    head = (
        image[:8] + struct.pack("<I", size) + image[12:24] + struct.pack("<I", 0) + image[28:size]
    )
    return with_crc(head)


def _other_period(period_us: int) -> Program:
    request = FeedRequest("minimax", 100.0, 0.1)
    return program(example("alpha"), request, "broken", period_us=period_us)


def _turned(p: Program) -> Program:
    """Everything meets, but the second segment sets off 2^-18 rad to the left."""
    spline = PHSpline(
        np.array([0, 9], dtype=complex),
        np.array([[3, 3, 3], [3 * np.exp(1j * 2.0**-19)] * 3]),
        False,
    )
    plan = plan_feed(spline.length_mm, FeedRequest("minimax", 50.0, 0.1), None, CONTROLLER)
    straight = compile_program(line(0, 18), plan, ProgramOptions(name="broken"))
    u = np.rint(spline.w.real * 2.0**44).astype(np.int64)
    v = np.rint(spline.w.imag * 2.0**44).astype(np.int64)
    two = np.array([0, 9 * MM])
    return replace(
        straight, start_q40=two, point_q40=np.stack((two, 0 * two)), a_q44=np.stack((u, v))
    )


def _moved(p: Program, by: int) -> Program:
    """Shifted in x so that only the farthest stretch leaves the travel."""
    return segments(p, point_q40=add(0, by))


def _merged(p: Program, index: int) -> Program:
    """Two constant pieces in one, longer than 32 mm."""
    total = int(p.pieces.duration_q32_s[index : index + 2].sum())
    way = int(p.pieces.start_q40[index + 2] - p.pieces.start_q40[index])
    c1 = round(way * 2 ** (total - 1).bit_length() / total)
    changed = pieces(p, duration_q32_s=put(index, total), c_q40=put((index, 0), c1))
    return without_piece(changed, index + 1)


def _bent(p: Program, index: int, order: int) -> Program:
    """Feed (1) or acceleration (2) of a piece ends wrong, its length right."""
    d = int(p.pieces.duration_q32_s[index])
    theta = d / 2 ** (d - 1).bit_length()
    seconds = d / 2**32
    # c7 s^5 (s - 1)^2 … changes what the order asks for and leaves the way alone.
    size = {1: 1e-3 * seconds, 2: 0.5 * seconds**2}[order]
    s = {1: [0, 0, 0, 0, 0, -1, 1], 2: [0, 0, 0, 0, 0.5, -1, 0.5]}[order]
    c = [round(size * v * 2**40 / theta ** (k + 1)) for k, v in enumerate(s)]
    return pieces(p, c_q40=lambda a: a.__setitem__(index, a[index] + np.array(c)))


def _cut_front(p: Program) -> Program:
    """The first piece left out: the program begins in motion."""
    cut = without_piece(p, 0)
    first = int(p.pieces.start_q40[1])
    return pieces(cut, start_q40=lambda a: a.__isub__(first))


def _piece_end(p: Program) -> Program:
    """Everything 2^-32 mm further along but the first piece's start; the end is missed by 2^-32 mm."""
    m = p.piece_count
    return pieces(p, c_q40=add((m - 1, 0), 1 << 9))


def _backwards(p: Program, index: int) -> Program:
    """A piece of the ramp (8 mm/s in its middle) with a dip below zero feed there."""
    d = int(p.pieces.duration_q32_s[index])
    seconds, theta = d / 2**32, d / 2 ** (d - 1).bit_length()
    # Plus k s^3 (1 - s)^3 (1 - 2 s), which takes k / 32 off the feed in the middle and leaves the ends.
    k = 32.0 * 12.0 * seconds
    s = np.array([0, 0, 1, -5, 9, -7, 2]) * k
    c = np.rint(s * 2.0**40 / theta ** np.arange(1, 8)).astype(np.int64)
    return pieces(p, c_q40=lambda a: a.__setitem__(index, a[index] + c))


def spatial(extras: int) -> bytes:
    """A spatial program: a curve that turns in all directions, with so many extra axes."""
    own = space.chain(space.wandering(12, 8.0), [30 * MM, -20 * MM, 5 * MM])
    for k in range(extras):
        space.add_extra(own, 40.0 + 10 * k, 25.0 - 5 * k, 0.3 + k)
    return space.image(own, space.feed_along(own, 80.0, 0.1, CONTROLLER))


def golden() -> tuple[dict[str, bytes], str]:
    """The images by file name, and the table. Raises SystemExit where the Python check disagrees with it."""
    low, high = LIMITS.min_q40_mm, LIMITS.max_q40_mm
    images: dict[str, bytes] = {}
    rows = [
        "# Golden programs: file, code it is refused with (OK: none), its number, index of the segment or piece.",
        "# Written by make_golden.py. All are to be checked against these limits:",
        f"limits {LIMITS.period_us} us {LIMITS.feed_um_s} um/s {LIMITS.acceleration_um_s2} um/s^2 "
        f"{LIMITS.jerk_mm_s3} mm/s^3 {low[0]} {low[1]} {high[0]} {high[1]} q40_mm "
        f"{LIMITS.stop_time_ms} ms",
    ]
    for name, p in good().items():
        image = encode(p)
        fault = check_image(image, LIMITS)
        if fault is not None:
            raise SystemExit(f"{name}: {fault}")
        images[f"{name}.hdgp"] = image
        rows.append(f"{name}.hdgp OK 0 0")
    for name, (image, code, index) in broken().items():
        fault = check_image(image, LIMITS)
        expected = Fault(ProgramError[code], index if index >= 0 or fault is None else fault.index)
        if fault != expected:
            raise SystemExit(f"broken_{name}: expected {expected}, the check says {fault}")
        images[f"broken_{name}.hdgp"] = image
        rows.append(f"broken_{name}.hdgp {code} {int(expected.code)} {expected.index}")
    for extras in (0, 3):
        images[f"space{3 + extras}.hdgp"] = spatial(extras)
    return images, "\n".join(rows) + "\n"


def main() -> None:
    """Writes everything."""
    images, table = golden()
    PROGRAMS.mkdir(exist_ok=True)
    for old in PROGRAMS.glob("*.hdgp"):
        old.unlink()
    for name, image in images.items():
        (PROGRAMS / name).write_bytes(image)
    (HERE / "manifest.txt").write_text(table)


if __name__ == "__main__":
    main()
