# SPDX-License-Identifier: MIT
"""Rules of docs/reference/protocol.md 1.2, vectorised over the segments of a program."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..spline.bernstein import square
from .codes import ProgramError
from .exactmath import WAY_SCALE
from .image import Program
from .limits import ProgramLimits
from .neighbours import brief_pairs

Bool = NDArray[np.bool_]
Rule = tuple[Bool, int, ProgramError]
Int = NDArray[np.int64]
Real = NDArray[np.float64]
Big = NDArray[np.object_]

W_LIMIT_Q44 = 64 << 44
POINT_LIMIT_Q40 = 4096 << 40
ARC_LIMIT_Q40 = 1 << 62
JOIN_Q88 = WAY_SCALE << (88 - 34)
CLOSE_Q88 = WAY_SCALE << (88 - 24)
DIRECTION_RAD = 2.0**-20
TO_Q88 = WAY_SCALE << 48
TRAVEL_SLACK_Q40 = 2.0**16
"""A path may run along a travel limit: 2^-24 mm of rounding are allowed."""


def segment_faults(
    program: Program, ways: tuple[Big, Big, Big], limits: ProgramLimits | None
) -> list[Rule]:
    """What is wrong with the segments and their joints, in the order of the controller."""
    code = ProgramError
    u, v = program.u_q44, program.v_q44
    wide = _bool((_beyond(u, W_LIMIT_Q44) | _beyond(v, W_LIMIT_Q44)).any(axis=1))
    far = _beyond(program.x_q40, POINT_LIMIT_Q40) | _beyond(program.y_q40, POINT_LIMIT_Q40)
    outside = _bool((program.start_q40 < 0) | (program.start_q40 >= ARC_LIMIT_Q40))
    sigma = _sigma3(u.astype(object), v.astype(object))
    low, high = sigma.min(axis=1), sigma.max(axis=1)
    x, y, s = (a.astype(object) * TO_Q88 for a in (program.x_q40, program.y_q40, program.start_q40))
    gap_x, gap_y, gap_s = _gap(x, ways[0]), _gap(y, ways[1]), _gap(s, ways[2])
    apart = (np.abs(gap_x) > JOIN_Q88) | (np.abs(gap_y) > JOIN_Q88)
    arc = (np.abs(gap_s) > JOIN_Q88) | (np.diff(program.start_q40.astype(object)) <= 0)
    out: list[Rule] = [
        (wide, 0, code.W_RANGE),
        (far, 0, code.POINT_RANGE),
        (outside, 0, code.ARC_RANGE),
        (_bool(low <= 0), 0, code.SIGMA),
        (_bool(high > 2 * low), 0, code.SIGMA_RATIO),
        (_bool(ways[2] > 32 * (WAY_SCALE << 88)), 0, code.SEGMENT_LONG),
    ]
    if limits is not None:
        out.append((_leaves(program, limits), 0, code.TRAVEL))
    return [
        *out,
        (_bool(program.start_q40[:1] != 0), 0, code.SEGMENT_FIRST),
        (_bool(apart), 1, code.JOIN_POINT),
        (_bool(arc), 1, code.JOIN_ARC),
        (_turned(u, v), 1, code.JOIN_DIRECTION),
    ]


def end_faults(program: Program, ways: tuple[Big, Big, Big]) -> list[Rule]:
    """What is wrong with the end of the path."""
    last = program.segment_count - 1
    x, y = int(program.x_q40[last] - program.x_q40[0]), int(program.y_q40[last] - program.y_q40[0])
    missing = (program.length_q40 - int(program.start_q40[last])) * TO_Q88
    off = abs(missing - ways[2][last]) > JOIN_Q88 or missing <= 0
    open_by = max(abs(x * TO_Q88 + ways[0][last]), abs(y * TO_Q88 + ways[1][last]))
    return [
        (np.array([off]), last, ProgramError.SEGMENT_END),
        (np.array([program.closed and open_by > CLOSE_Q88]), last, ProgramError.NOT_CLOSED),
    ]


def too_short(program: Program) -> Bool:
    """Later segments of neighbouring pairs that a tick at 200 % could pass whole."""
    joints = np.append(program.start_q40, program.length_q40)
    mask = np.zeros(program.segment_count, dtype=np.bool_)
    mask[brief_pairs(joints, program.pieces, program.period_us)[0] + 1] = True
    return mask


def _beyond(values: Int, limit: int) -> Bool:
    return np.asarray((values >= limit) | (values <= -limit))


def _bool(values: object) -> Bool:
    return np.asarray(values, dtype=np.bool_)


def _sigma3(u: Big, v: Big) -> Big:
    """Three times the Bernstein coefficients (N, 5) of |w|^2, q88, exactly."""
    columns = (
        3 * (u[:, 0] * u[:, 0] + v[:, 0] * v[:, 0]),
        3 * (u[:, 0] * u[:, 1] + v[:, 0] * v[:, 1]),
        2 * (u[:, 1] * u[:, 1] + v[:, 1] * v[:, 1]) + u[:, 0] * u[:, 2] + v[:, 0] * v[:, 2],
        3 * (u[:, 1] * u[:, 2] + v[:, 1] * v[:, 2]),
        3 * (u[:, 2] * u[:, 2] + v[:, 2] * v[:, 2]),
    )
    return np.stack(columns, axis=1)


def _gap(start: Big, way: Big) -> Big:
    return np.asarray(start[:-1] + way[:-1] - start[1:])


def _turned(u: Int, v: Int) -> Bool:
    """Directions of w^2 at the joints differ by more than 2^-20 rad (twice the angle between the w)."""
    end = u[:-1, 2].astype(np.float64) + 1j * v[:-1, 2]
    start = u[1:, 0].astype(np.float64) + 1j * v[1:, 0]
    return np.asarray(np.abs(np.angle((np.conj(end) * start) ** 2)) > DIRECTION_RAD)


def boxes_q40(program: Program) -> tuple[Real, Real]:
    """Lowest and highest corner (N, 2) of the boxes of the segments' six Bezier points."""
    w = np.asarray((program.u_q44 + 1j * program.v_q44) * 2.0**-44, dtype=np.complex128)
    steps = np.rint(square(w).view(np.float64).reshape(-1, 5, 2) * (2.0**40 / 5.0))
    start = np.stack((program.x_q40, program.y_q40), axis=1).astype(np.float64)
    points = np.concatenate(
        (start[:, None, :], start[:, None, :] + np.cumsum(steps, axis=1)), axis=1
    )
    return points.min(axis=1), points.max(axis=1)


def _leaves(program: Program, limits: ProgramLimits) -> Bool:
    """The box is not within the travel."""
    lowest, highest = boxes_q40(program)
    low = np.array(limits.min_q40_mm, dtype=np.float64) - TRAVEL_SLACK_Q40
    high = np.array(limits.max_q40_mm, dtype=np.float64) + TRAVEL_SLACK_Q40
    return np.asarray(((lowest < low) | (highest > high)).any(axis=1))
