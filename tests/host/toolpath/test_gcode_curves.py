# SPDX-License-Identifier: MIT
"""Arcs, splines and canned cycles of G-code. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from gcode import commands_of, error_of, last, moves_of, place_of, xyz_of
from hodograph.toolpath.gcode.splines import knots_of
from hodograph.toolpath.moves import ArcMove, Blending, Dwell, PathMode, Plane, SplineMove

HEAD = "G21 G90 F600\n"


def arc_of(text: str) -> ArcMove:
    move = moves_of(HEAD + text)[-1]
    assert isinstance(move, ArcMove)
    return move


def spline_of(text: str) -> SplineMove:
    move = moves_of(HEAD + text)[-1]
    assert isinstance(move, SplineMove)
    return move


@pytest.mark.parametrize(
    ("text", "plane", "end", "centre", "turns"),
    [
        ("G2 X10 I5", Plane.XY, (10, 0, 0), (5, 0), -1),
        ("G3 X10 I5 Z3", Plane.XY, (10, 0, 3), (5, 0), 1),
        ("G3 I5", Plane.XY, (0, 0, 0), (5, 0), 1),
        ("G3 J5 P3", Plane.XY, (0, 0, 0), (0, 5), 3),
        ("G90.1 G2 X10 I5 J0", Plane.XY, (10, 0, 0), (5, 0), -1),
        ("G90.1\nG91.1 G2 X10 I5 J0", Plane.XY, (10, 0, 0), (5, 0), -1),
        ("G2 X10 R5", Plane.XY, (10, 0, 0), (5, 0), -1),
        ("G2 X6 Y6 R6", Plane.XY, (6, 6, 0), (6, 0), -1),
        ("G2 X6 Y6 R-6", Plane.XY, (6, 6, 0), (0, 6), -1),
        ("G3 X6 Y6 R6", Plane.XY, (6, 6, 0), (0, 6), 1),
        ("G3 X6 Y6 R-6", Plane.XY, (6, 6, 0), (6, 0), 1),
        ("G18 G2 X10 I5", Plane.ZX, (10, 0, 0), (0, 5), -1),
        ("G18 G3 Z4 X4 K4", Plane.ZX, (4, 0, 4), (4, 0), 1),
        ("G19 G2 Y10 J5 X1", Plane.YZ, (1, 10, 0), (5, 0), -1),
        ("G19 G3 Z4 Y4 K4", Plane.YZ, (0, 4, 4), (0, 4), 1),
        ("G20 G2 X1 I.5", Plane.XY, (25.4, 0, 0), (12.7, 0), -1),
        ("G91 G2 X4 I2\nX4 I2", Plane.XY, (8, 0, 0), (6, 0), -1),
        ("G92 X100\nG2 X110 I5", Plane.XY, (10, 0, 0), (5, 0), -1),
        ("G2 X10 I5\nI-5", Plane.XY, (10, 0, 0), (5, 0), -1),  # the motion is modal
    ],
)
def test_arcs(
    text: str, plane: Plane, end: tuple[float, ...], centre: tuple[float, ...], turns: int
) -> None:
    move = arc_of(text)
    assert move.plane is plane
    assert move.end[:3] == pytest.approx(end)
    assert move.centre == pytest.approx(centre)
    assert move.turns == turns


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("G2 X10", 1),
        ("G2 X10 K5", 8),
        ("G18 G2 X10 J5", 12),
        ("G19 G2 Y10 I5", 12),
        ("G90.1 G2 X10 I5", 7),
        ("G2 X10 I5 R5", 11),
        ("G2 X10 I4.9", 1),  # the end is 0.2 mm too far
        ("G2 X10 I10", 1),  # the centre is the end
        ("G2 X10 R4.99", 8),
        ("G2 R5", 4),
        ("G2 X0 R5", 7),
        ("G2 X10 R0", 8),
        ("G2 X10 I5 P0", 11),
        ("G2 X10 I5 P1.5", 11),
    ],
)
def test_refused_arcs(text: str, column: int) -> None:
    assert place_of(HEAD + text) == (2, column)


def test_the_bounds_of_the_radii_are_those_of_the_standard() -> None:
    assert arc_of("G2 X10.02 I5").turns == -1  # 0.02 mm: within the absolute bound
    assert arc_of("G2 X1000.5 I500").turns == -1  # 0.5 mm, but less than 0.1 %
    assert "from its end" in str(error_of(HEAD + "G2 X1005 I500"))
    assert arc_of("G20 G2 X1.002 I.5").turns == -1
    assert "correct the end or the centre" in str(error_of(HEAD + "G20 G2 X1.006 I.5"))


@given(st.floats(0.5, 50), st.floats(0, 2 * math.pi), st.floats(0.2, 6.0), st.booleans())
def test_radius_and_centre_mean_the_same_arc(
    radius: float, begin: float, angle: float, is_left: bool
) -> None:
    assume(abs(angle - math.pi) > 0.01)
    sign = 1 if is_left else -1
    centre = (-radius * math.cos(begin), -radius * math.sin(begin))
    end = (
        centre[0] + radius * math.cos(begin + sign * angle),
        centre[1] + radius * math.sin(begin + sign * angle),
    )
    code = "G3" if is_left else "G2"
    by_radius = arc_of(
        f"{code} X{end[0]:.12f} Y{end[1]:.12f} R{radius if angle < math.pi else -radius:.12f}"
    )
    by_centre = arc_of(f"{code} X{end[0]:.12f} Y{end[1]:.12f} I{centre[0]:.12f} J{centre[1]:.12f}")
    assert by_radius.turns == by_centre.turns == sign
    assert by_radius.centre == pytest.approx(
        by_centre.centre, abs=1e-6 * radius / abs(math.cos(angle / 2))
    )


@given(st.floats(-5, 5), st.floats(-5, 5), st.floats(-5, 5), st.booleans())
def test_planes_are_the_same_with_other_letters(
    x: float, y: float, z: float, is_left: bool
) -> None:
    assume(math.hypot(x, y) > 0.1)
    code, radius = ("G3" if is_left else "G2"), math.hypot(x, y)
    found = {}
    for plane, letters in ((17, "XYZ"), (18, "ZXY"), (19, "YZX")):
        words = " ".join(f"{k}{v:.9f}" for k, v in zip(letters, (x, y, z), strict=True))
        move = arc_of(f"G{plane} {code} {words} R{radius:.9f}")
        axes = move.plane.value
        found[plane] = ([move.end[axis] for axis in axes], move.centre, move.turns)
    assert found[17] == found[18] == found[19]


def test_cubic_splines() -> None:
    first, second = moves_of(HEAD + "G5 X10 Y0 I1 J2 P-3 Q4\nG5 X20 P1 Q1\n")
    assert isinstance(first, SplineMove)
    assert isinstance(second, SplineMove)
    assert [point[:2] for point in first.points] == [(0, 0), (1, 2), (7, 4), (10, 0)]
    assert [point[:2] for point in second.points] == [(10, 0), (13, -4), (21, 1), (20, 0)]
    assert (first.degree, first.weights, first.knots) == (3, (1.0,) * 4, (0.0,) * 4 + (1.0,) * 4)


def test_quadratic_splines() -> None:
    move = spline_of("G0 X1\nG91 G5.1 X2 I1 J3")
    assert [point[:2] for point in move.points] == [(1, 0), (2, 3), (3, 0)]
    assert (move.degree, move.line) == (2, 3)


def test_nurbs() -> None:
    text = "G0 X1 Z5\nG5.2 X0 Y1 P1 L3\nX2 Y2 P2\n(comment)\n#1=4 X#1 Y0 P1\nG5.3\nG1 X0\n"
    move = moves_of(HEAD + text)[1]
    assert isinstance(move, SplineMove)
    assert [point[:3] for point in move.points] == [(1, 0, 5), (0, 1, 5), (2, 2, 5), (0, 0, 5)]
    assert move.weights == (1.0, 1.0, 2.0, 1.0)
    assert move.knots == (0, 0, 0, 0.5, 1, 1, 1)
    assert (move.degree, move.line) == (2, 3)
    assert spline_of("G5.2 P3\nX1 Y1 P1\nX2 Y0 P1\nG5.3").weights == (3.0, 1.0, 1.0)
    assert knots_of(6, 4) == pytest.approx((0, 0, 0, 0, 1 / 3, 2 / 3, 1, 1, 1, 1))


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("G5 X1 P1 Q1", 2, 1),
        ("G5 X1 I1 P1 Q1", 2, 7),
        ("G5 X1 I1 J1 P1", 2, 1),
        ("G5 X1 I1 J1 P1 Q1 Z1", 2, 19),
        ("G5 X1 I1 J1 P1 Q1\nG0 X5\nG5 X6 P1 Q1", 4, 1),  # nothing to go on from
        ("G18 G5 X1 I1 J1 P1 Q1", 2, 5),
        ("G5.1 X1 I1", 2, 1),
        ("G5.2 X1 P1", 2, 1),
        ("G5.2 X1 Y1", 2, 1),
        ("G5.2 X1 Y1 P-1", 2, 12),
        ("G5.2 X1 Y1 P1 L2", 2, 15),
        ("G5.2 X1 Y1 P1 Z1", 2, 15),
        ("G5.2 X1 Y1 P1\nG5.2 P1", 3, 1),
        ("G5.2 X1 Y1 P1\nG5.3", 3, 1),
        ("G5.2 X1 Y1 P1\nG0 X1", 3, 1),
        ("G5.2 X1 Y1 P1\nM3", 3, 1),
        ("G5.2 X1 Y1 P1\nF3", 3, 1),
        ("G5.2 X1 Y1 P1\nX2 Y2 P1", 4, 1),
        ("G5.2 X1 Y1 P1\nM2", 3, 1),
        ("G91 G5.2 X1 Y1 P1", 2, 5),
        ("G93 G5.2 X1 Y1 P1", 2, 5),
        ("G5.3", 2, 1),
        ("G5.2 X1 Y1 P1 G5.3", 2, 15),
    ],
)
def test_refused_splines(text: str, line: int, column: int) -> None:
    assert place_of(HEAD + text) == (line, column)


def test_drilling() -> None:
    text = HEAD + "G0 Z10\nG98 G81 X1 Y2 Z-3 R1\nX2\nG99 X3\nG80\nG0 Z20\n"
    assert xyz_of(text) == [
        (0, 0, 10),
        (1, 2, 10),
        (1, 2, 1),
        (1, 2, -3),
        (1, 2, 10),
        (2, 2, 10),
        (2, 2, 1),
        (2, 2, -3),
        (2, 2, 10),
        (3, 2, 10),
        (3, 2, 1),
        (3, 2, -3),
        (3, 2, 1),
        (3, 2, 20),
    ]


def test_pecks() -> None:
    text = HEAD + "G98 G0 Z2\nG83 Z-3 R1 Q2 L2 X4\n"
    hole = [1.0, -1.0, 1.0, -0.746, -3.0, 2.0]
    assert [z for _, _, z in xyz_of(text)] == pytest.approx([2.0, 2.0, *hole, *hole])


def test_steps_of_cycles() -> None:
    text = HEAD + "G0 Z2\nG91 G81 X1 Y1 Z-1 R-1 L3\n"
    bottoms = [end for end in xyz_of(text) if end[2] == 0.0 and end[0] > 0]
    assert bottoms == [(1, 1, 0), (2, 2, 0), (3, 3, 0)]
    polar = xyz_of(HEAD + "G0 X5 Z2\nG91 G81 ^90 Z-1 R-1 L3\n")
    assert [end[:2] for end in polar if end[2] == 0.0] == [
        pytest.approx(each, abs=1e-9) for each in ((0, 5), (-5, 0), (0, -5))
    ]


def test_a_cycle_rises_to_r_first_and_dwells_at_the_bottom() -> None:
    commands = commands_of(HEAD + "G64 P0.5\nG82 X1 Z-1 R3 P0.25\n")
    assert [type(each).__name__ for each in commands] == [
        "PathMode",
        "StraightMove",
        "PathMode",
        "StraightMove",
        "StraightMove",
        "Dwell",
        "StraightMove",
        "PathMode",
    ]
    assert commands[2] == PathMode(3, Blending.EXACT_PATH)
    assert commands[5] == Dwell(3, 0.25)
    assert commands[7] == PathMode(3, Blending.CONTINUOUS, 0.5, None)


def test_cycles_of_other_planes() -> None:
    assert (-2.0, 5.0, 1.0) in xyz_of(HEAD + "G19 G81 Y5 Z1 X-2 R1")
    assert (1.0, -2.0, 5.0) in xyz_of(HEAD + "G18 G81 Z5 X1 Y-2 R1")


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("G81 X1 Z-1", 1),
        ("G81 X1 R1", 1),
        ("G81 R1", 1),
        ("G81 X1 Z2 R1", 1),
        ("G82 X1 Z-1 R1", 1),
        ("G82 X1 Z-1 R1 P-1", 15),
        ("G83 X1 Z-1 R1", 1),
        ("G83 X1 Z-1 R1 Q0", 15),
        ("G83 X1 Z-1 R1 Q0.00001", 15),
        ("G81 X1 Z-1 R1 L0", 15),
        ("G81 X1 Z-1 R1 L1.5", 16),
        ("G81 X1 Z-1 R1 A5", 15),
        ("G93 G81 X1 Z-1 R1 F5", 5),
    ],
)
def test_refused_cycles(text: str, column: int) -> None:
    assert place_of(HEAD + text) == (2, column)


def test_words_of_a_cycle_hold_until_the_motion_changes() -> None:
    assert last(HEAD + "G83 X1 Z-1 R1 Q1\nX2\n")[0] == 2.0
    assert place_of(HEAD + "G83 X1 Z-1 R1 Q1\nG80\nG83 X2 Z-1 R1") == (4, 1)
    assert place_of(HEAD + "G81 X1 Z-1 R1\nG0 X3\nG81 X2 R1") == (4, 1)


def test_a_higher_r_within_a_series_is_reached_before_the_hole() -> None:
    text = HEAD + "G0 Z9\nG99 G81 X1 Z-2 R3\nG98 X2 R4\n"
    assert xyz_of(text)[5:] == [(1, 0, 4), (2, 0, 4), (2, 0, -2), (2, 0, 9)]


def test_pecks_in_inches_end_at_the_bottom() -> None:
    depths = [end[2] for end in xyz_of(HEAD + "G20 G83 X1 Z-8 R1 Q3") if end[2] < 0]
    assert depths == pytest.approx([-50.8, -50.546, -127.0, -126.746, -203.2])
