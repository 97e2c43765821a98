# SPDX-License-Identifier: MIT
"""Rules of docs/protocol.md 1.2, vectorised over the segments of a program."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..spline.bernstein import square
from .codes import ProgramError
from .exactmath import WAY_SCALE
from .image import Program
from .neighbours import brief_pairs

if TYPE_CHECKING:
    from .check import ProgramLimits

Bool = NDArray[np.bool_]
Int = NDArray[np.int64]
Big = NDArray[np.object_]

W_LIMIT_Q44 = 64 << 44
POINT_LIMIT_Q40 = 4096 << 40
ARC_LIMIT_Q40 = 1 << 62
JOIN_Q88 = WAY_SCALE << (88 - 34)
CLOSE_Q88 = WAY_SCALE << (88 - 24)
DIRECTION_RAD = 2.0**-20
TO_Q88 = WAY_SCALE << 48


def segment_faults(
    program: Program, ways: tuple[Big, Big, Big], limits: ProgramLimits | None
) -> list[tuple[Bool, int, ProgramError]]:
    """Masks of what is wrong: (mask, index of its first element, code)."""
    code = ProgramError
    count = program.segment_count
    u, v = program.u_q44, program.v_q44
    wide = _bool((_beyond(u, W_LIMIT_Q44) | _beyond(v, W_LIMIT_Q44)).any(axis=1))
    far = _beyond(program.x_q40, POINT_LIMIT_Q40) | _beyond(program.y_q40, POINT_LIMIT_Q40)
    outside = _bool((program.start_q40 < 0) | (program.start_q40 >= ARC_LIMIT_Q40))
    sigma = _sigma3(u.astype(object), v.astype(object))
    low, high = sigma.min(axis=1), sigma.max(axis=1)
    out: list[tuple[Bool, int, ProgramError]] = [
        (wide, 0, code.W_RANGE),
        (far, 0, code.POINT_RANGE),
        (outside, 0, code.ARC_RANGE),
        (_bool(low <= 0), 0, code.SIGMA),
        (_bool(high > 2 * low), 0, code.SIGMA_RATIO),
        (_bool(ways[2] > 32 * (WAY_SCALE << 88)), 0, code.SEGMENT_LONG),
        (_bool(program.start_q40[:1] != 0), 0, code.SEGMENT_FIRST),
    ]
    x, y, s = (a.astype(object) * TO_Q88 for a in (program.x_q40, program.y_q40, program.start_q40))
    gap_x, gap_y = _gap(x, ways[0]), _gap(y, ways[1])
    apart = _bool((np.abs(gap_x) > JOIN_Q88) | (np.abs(gap_y) > JOIN_Q88))
    out.append((apart, 1, code.JOIN_POINT))
    out.append((_bool(np.abs(_gap(s, ways[2])) > JOIN_Q88), 1, code.JOIN_ARC))
    out.append((_turned(u, v), 1, code.JOIN_DIRECTION))
    end = s[-1] + ways[2][-1] - program.length_q40 * TO_Q88
    out.append((np.array([abs(end) > JOIN_Q88]), count - 1, code.SEGMENT_END))
    if program.closed:
        open_x, open_y = x[-1] + ways[0][-1] - x[0], y[-1] + ways[1][-1] - y[0]
        gap = max(abs(open_x), abs(open_y)) > CLOSE_Q88
        out.append((np.array([gap]), count - 1, code.NOT_CLOSED))
    out.append((_too_short(program), 0, code.SEGMENT_SHORT))
    if limits is not None:
        out.append((_leaves(program, limits), 0, code.TRAVEL))
    return out


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


def _too_short(program: Program) -> Bool:
    joints = np.append(program.start_q40, program.length_q40)
    mask = np.zeros(program.segment_count, dtype=np.bool_)
    pieces = program.pieces
    rising = np.all(np.diff(joints) > 0) and np.all(np.diff(pieces.start_q40) >= 0)
    if rising and np.all(pieces.duration_q32_s > 0):
        mask[brief_pairs(joints, pieces, program.period_us)[0] + 1] = True
    return mask


def _leaves(program: Program, limits: ProgramLimits) -> Bool:
    """The box of the six Bezier points is not within the travel."""
    w = np.asarray((program.u_q44 + 1j * program.v_q44) * 2.0**-44, dtype=np.complex128)
    steps = np.rint(square(w).view(np.float64).reshape(-1, 5, 2) * (2.0**40 / 5.0))
    start = np.stack((program.x_q40, program.y_q40), axis=1).astype(np.float64)
    points = np.concatenate(
        (start[:, None, :], start[:, None, :] + np.cumsum(steps, axis=1)), axis=1
    )
    low = np.array(limits.min_q40_mm, dtype=np.float64)
    high = np.array(limits.max_q40_mm, dtype=np.float64)
    return np.asarray(((points.min(axis=1) < low) | (points.max(axis=1) > high)).any(axis=1))
