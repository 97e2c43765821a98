# SPDX-License-Identifier: MIT
"""Blocks of G-code: words, modes, coordinates and machine commands. Run by pytest; starts and writes nothing."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gcode import commands_of, ends_of, error_of, last, moves_of, place_of, xyz_of
from hodograph.errors import InputError
from hodograph.toolpath.moves import (
    AnalogOutput,
    Blending,
    Command,
    Coolant,
    DigitalOutput,
    Dwell,
    Feed,
    FeedMode,
    Message,
    OverrideSwitch,
    PathMode,
    ProgramStop,
    Rotation,
    Spindle,
    StraightMove,
    ToolChange,
    ToolOffset,
    ToolSelect,
)


def test_straight_moves_carry_line_end_and_feed() -> None:
    rapid, feed = moves_of("G0 X1 Y2\nF600 G1 Z-3 A90\n")
    assert rapid == StraightMove(1, (1.0, 2.0, 0.0, 0.0, 0.0, 0.0), None)
    expected = Feed(FeedMode.PER_MINUTE, feed_mm_s=10.0, feed_deg_s=10.0)
    assert feed == StraightMove(2, (1.0, 2.0, -3.0, 90.0, 0.0, 0.0), expected)


@pytest.mark.parametrize(
    "text",
    [
        "g1x1.5y-2f100",
        "G01X01.50Y-2.F100",
        "N10 G1 X1.5 Y-2 F100",
        "n0010g1 x1.5 y-2. f100 ; comment",
        "G1\tX 1 . 5\tY - 2\tF 1 0 0\r",
        "\ufeffG1 X1.5 Y-2 F100",
        "(a) G1 (b (x) X1.5 (c) Y-2 F100 (d)".replace("(x)", "x)"),
        "F100\nG1\nX1.5 Y-2",
        "F100 G1 X1.5\nY-2",
        "%\nO1000 (NAME)\nG1 X1.5 Y-2 F100\nM30\n%\ngarbage",
        "G1.0 X1.5 Y-2 F100\nM2\nand this is not read",
        "G17 G21 G40 G49 G80 G90 G94\nG1 F100 X1.5 Y-2 (msg)\n\n   \n",
        "#1=1.5 G#<_abs_x> F100\nG[0+1] X#1 Y[-2]",
        "/G1 X1.5 Y-2 F100",
    ],
)
def test_habits_of_cam_systems(text: str) -> None:
    move = moves_of(text)[-1]
    assert isinstance(move, StraightMove)
    assert move.end[:2] == (1.5, -2.0)
    assert move.feed is not None
    assert move.feed.feed_mm_s == pytest.approx(100 / 60)


def test_block_delete_is_an_option() -> None:
    assert xyz_of("/G0 X1\nG0 Y1") == [(1.0, 0.0, 0.0), (1.0, 1.0, 0.0)]
    assert xyz_of("/G0 X1\n / nonsense\nG0 Y1", block_delete=True) == [(0.0, 1.0, 0.0)]


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [
        ("G1 X1", 1, 1),  # no feed
        ("G21\n  G1 X1", 2, 3),
        ("X1", 1, 1),
        ("G80\nF1 Y1 X1", 2, 4),
        ("G0 X1 X2", 1, 7),
        ("G0 G1 X1", 1, 4),
        ("G90 (comment) G91", 1, 15),
        ("M3 M4", 1, 4),
        ("M7 M8", 1, 4),
        ("G41 D1", 1, 1),
        ("G0 U1", 1, 4),
        ("G0 D1", 1, 4),
        ("G0 X1 N5", 1, 7),
        ("G0 X1 O5 sub", 1, 7),
        ("G0 X1 $2", 1, 7),
        ("N1 G0 X1*71", 1, 9),
        ("G0 X1 \u00e9", 1, 7),
        ("G0 X1 \x00", 1, 7),
        ("G0 X1 %", 1, 7),
        ("G0 X1 /", 1, 7),
        ("G99.9", 1, 1),
        ("G1.55", 1, 1),
        ("G-1", 1, 1),
        ("G9999999999999999999", 1, 1),
        ("M200", 1, 1),
        ("M3.5", 1, 2),
        ("G0 X1 (open", 1, 7),
        ("G0 X1 (a (b)", 1, 10),
        ("G0 X1 )", 1, 7),
        ("G0 P1", 1, 4),
        ("G0 X1 K1", 1, 7),
        ("G4", 1, 1),
        ("G4 P-1", 1, 4),
        ("G1 F-5", 1, 4),
        ("S-5", 1, 1),
        ("T1.5", 1, 2),
        ("T-1", 1, 1),
        ("G10 L2 X1", 1, 1),
        ("G10 L3 P1", 1, 5),
        ("G10 L2 P10", 1, 8),
        ("G10 L20 P1 R5", 1, 12),
        ("G92", 1, 1),
        ("G28 G1 X1", 1, 5),
        ("G53 X1", 1, 5),
        ("G0 G91 G53 X1", 1, 8),
        ("G93\nF1 G1 X1\nX2", 3, 1),
        ("G95 F1 G1 X1", 1, 8),
        ("G94 G1 F100 X1\nG94\nX2", 3, 1),  # G94 takes the feed away
        ("M62", 1, 1),
        ("M62 P64", 1, 5),
        ("M67 Q1", 1, 1),
        ("M67 E1", 1, 1),
        ("G0 X1\nX2 M68 E1", 2, 4),
        ("F1\nG5 X1 Y0 I0 J1 P0 Q1\nG28 X1\nG5 X2 Y0 P0 Q1", 4, 1),
        ("F1\nG5 X1 Y0 I0 J1 P0 Q1\nG30\nX2 Y0 P0 Q1", 4, 1),
        ("G2 X1 I1 M62 P1 F1", 1, 14),
        ("G64 P-1", 1, 5),
        ("G0 @1 X1", 1, 4),
        ("G0 @30", 1, 4),
        ("%\nG0 X1", 3, 1),
        ("G0 X1\n%", 2, 1),
        ("X1" * 3000, 1, 4097),
    ],
)
def test_refusals_name_line_and_column(text: str, line: int, column: int) -> None:
    assert place_of(text) == (line, column)
    assert isinstance(error_of(text), InputError)


@pytest.mark.parametrize("code", ["G33", "G38.2", "G41", "G73", "G76", "G84", "G96", "G7", "G52"])
def test_known_codes_outside_are_named(code: str) -> None:
    assert f"{code} is not supported (" in str(error_of(code))


@pytest.mark.parametrize("code", ["M19", "M50", "M60", "M61", "M66", "M70", "M98", "M123"])
def test_known_m_codes_outside_are_named(code: str) -> None:
    assert f"{code} is not supported (" in str(error_of(code))


@pytest.mark.parametrize(
    ("text", "commands"),
    [
        ("G4 P1.5", [Dwell(1, 1.5)]),
        ("S1000 M3", [Spindle(1, Rotation.CLOCKWISE, 1000.0)]),
        ("M4", [Spindle(1, Rotation.COUNTERCLOCKWISE, 0.0)]),
        ("S500", [Spindle(1, Rotation.STOPPED, 500.0)]),
        ("T3 M6", [ToolSelect(1, 3), ToolChange(1, 3)]),
        ("G43 H2", [ToolOffset(1, 2)]),
        ("G43 H0", []),
        ("M7\nM8\nM9", [Coolant(1, True, False), Coolant(2, True, True), Coolant(3, False, False)]),
        ("M62 P3", [DigitalOutput(1, 3, True, True)]),
        ("M63 P3", [DigitalOutput(1, 3, False, True)]),
        ("M64 P0", [DigitalOutput(1, 0, True, False)]),
        ("M65 P63", [DigitalOutput(1, 63, False, False)]),
        ("M67 E2 Q0.5", [AnalogOutput(1, 2, 0.5, True)]),
        ("M68 E2 Q-0.5", [AnalogOutput(1, 2, -0.5, False)]),
        ("M48\nM49", [OverrideSwitch(1, True), OverrideSwitch(2, False)]),
        ("M0\nM1", [ProgramStop(1, False), ProgramStop(2, True)]),
        (
            "(MSG, hello #1) (debug, #1 #<no>) (plain)",
            [Message(1, "hello #1"), Message(1, "0 ######")],
        ),
        ("#5599=0\n(debug, quiet)", []),
        ("G61", [PathMode(1, Blending.EXACT_PATH)]),
        ("G61.1", [PathMode(1, Blending.EXACT_STOP)]),
        ("G64", [PathMode(1, Blending.CONTINUOUS)]),
        ("G20 G64 P0.1 Q0", [PathMode(1, Blending.CONTINUOUS, pytest.approx(2.54), 0.0)]),
        (
            "M3 S9\nT1 M6",
            [
                Spindle(1, Rotation.CLOCKWISE, 9.0),
                ToolSelect(2, 1),
                Spindle(2, Rotation.STOPPED, 9.0),
                ToolChange(2, 1),
            ],
        ),
    ],
)
def test_machine_commands(text: str, commands: list[Command]) -> None:
    assert commands_of(text) == commands


def test_order_of_execution_in_a_block() -> None:
    text = "M1 G0 X1 G4 P2 M8 S100 M3 T5 M6 M62 P1 (msg, first)".replace("M62 P1 ", "M67 E1 Q2 ")
    kinds = [type(command) for command in commands_of(text)]
    assert kinds == [
        Message,
        ToolSelect,
        AnalogOutput,
        ToolChange,
        Spindle,
        Coolant,
        Dwell,
        StraightMove,
        ProgramStop,
    ]


def test_feed_is_taken_in_the_units_before_the_block() -> None:
    first, second = moves_of("G20 F60 G1 X1\nF60 X2")
    assert [move.feed.feed_mm_s for move in (first, second) if move.feed] == [1.0, 25.4]


def test_feed_modes() -> None:
    inverse, turn = moves_of("G93 G1 X10 F2\nG95 S120 F0.5\nX20")
    assert inverse.feed == Feed(FeedMode.INVERSE_TIME, duration_s=30.0)
    assert turn.feed == Feed(FeedMode.PER_REVOLUTION, 1.0, 1.0, 0.0, 120.0)


def test_incremental_and_polar() -> None:
    assert last("G91 G0 X1 Y2\nX1\nZ-1")[:3] == (2.0, 2.0, -1.0)
    assert last("G0 @10 ^30")[:2] == pytest.approx((10 * math.cos(math.pi / 6), 5.0))
    assert last("G0 X3 Y4\n^90\nG91 @1")[:2] == pytest.approx((0.0, 6.0))


def test_coordinate_systems() -> None:
    text = "G10 L2 P2 X10 Y20 C30\nG55 G0 X1 Y1 C1\nG54 X1\nG53 Y5\nG10 L20 P0 X0\nX2\n"
    assert ends_of(text) == [
        (11.0, 21.0, 0.0, 0.0, 0.0, 31.0),
        (1.0, 21.0, 0.0, 0.0, 0.0, 31.0),
        (1.0, 5.0, 0.0, 0.0, 0.0, 31.0),
        (3.0, 5.0, 0.0, 0.0, 0.0, 31.0),
    ]
    assert last("G59.3 G0 X1", origins={9: (5.0, 0, 0, 0, 0, 0)})[0] == 6.0
    with pytest.raises(ValueError, match="1 to 9"):
        commands_of("G0 X1", origins={10: (0.0,) * 6})


def test_g92_offsets() -> None:
    text = "G0 X10\nG92 X3\nX4\nG92.2\nX4\nG92.3\nX4\nG92.1\nX4\nG92.3\nX4\n"
    assert [end[0] for end in ends_of(text)] == [10.0, 11.0, 4.0, 11.0, 4.0, 4.0]


def test_rotated_coordinates() -> None:
    text = "G10 L2 P1 X1 R90\nG0 X2 Y3\nG92 X0\nG91 X1\nG90 G1 F9 X1 Y1 Z1\n"
    assert xyz_of(text)[0] == pytest.approx((-2.0, 2.0, 0.0))
    assert xyz_of(text)[1] == pytest.approx((-2.0, 3.0, 0.0))
    assert xyz_of(text)[2] == pytest.approx((0.0, 3.0, 1.0))
    assert "rotation" in str(error_of("G10 L2 P1 R9\nG18 F9 G2 X1 Z1 R5"))


def test_reference_points() -> None:
    home = (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
    assert xyz_of("G0 X9 Y9 Z9\nG28", g28=home)[1:] == [(1.0, 2.0, 3.0)]
    assert xyz_of("G0 X9 Y9 Z9\nG91 G30 Z1", g30=home)[1:] == [(9.0, 9.0, 10.0), (9.0, 9.0, 3.0)]
    assert xyz_of("G0 X4\nG28.1\nX8\nG28\nX7\nG30.1\nX0\nG30")[-1] == (7.0, 0.0, 0.0)


def test_tool_length() -> None:
    tools = {3: (1.0, 0.0, 10.0, 0, 0, 0)}
    assert last("G43 H3 G0 X0 Z0", tools=tools)[:3] == (1.0, 0.0, 10.0)
    assert last("T3 M6\nG43\nG0 Z1\nG49\nZ1", tools=tools)[2] == 1.0
    assert last("T3 M6\nG43 G0 Z1", tools=tools)[2] == 11.0
    assert last("G43.1 Z5 X1\nG0 Z1")[2] == 6.0
    assert last("G43 H7 G0 Z1")[2] == 1.0
    assert place_of("G0 X1\nG43 H4", tools=tools) == (2, 5)
    assert place_of("T4 M6", tools=tools) == (1, 1)


def test_system_parameters() -> None:
    text = (
        "G20 G0 X1 Z2\nG91 G18 F30 S7 M3\n"
        "G90 G21 G0 X[#<_metric> + 10 * #<_imperial>] Y[#<_plane>] Z[#<_rpm>] A[#<_spindle_cw>] B#<_line> C#<_feed>\n"
    )
    assert last(text) == (10.0, 180.0, 7.0, 1.0, 3.0, 30.0)
    assert last("G20 G0 X1\nG10 L2 P1 X2\nG0 Y[#5420] Z[#5221] A#<_abs_x> B#<_coord_system>")[
        1:5
    ] == (
        pytest.approx(-25.4),
        pytest.approx(50.8 * 25.4),
        1.0,
        540.0,
    )


_NUMBERS = st.integers(-9999, 9999).map(lambda number: number / 100)
_WORDS = st.lists(
    st.dictionaries(st.sampled_from("XYZABC"), _NUMBERS, min_size=1, max_size=4),
    min_size=1,
    max_size=12,
)
_ONE_POSITION = st.tuples(*[_NUMBERS] * 6)


def _program(blocks: list[dict[str, float]]) -> str:
    return "G0 " + "\n".join(" ".join(f"{k}{v:.4f}" for k, v in block.items()) for block in blocks)


def _close(left: list[tuple[float, ...]], right: list[tuple[float, ...]]) -> bool:
    return all(
        math.dist(p, q) < 1e-9 * (1.0 + max(map(abs, q))) for p, q in zip(left, right, strict=True)
    )


@given(_WORDS)
def test_inches_are_mm_of_another_size(blocks: list[dict[str, float]]) -> None:
    scaled = [
        {key: value * (25.4 if key in "XYZ" else 1.0) for key, value in block.items()}
        for block in blocks
    ]
    assert _close(ends_of("G20\n" + _program(blocks)), ends_of("G21\n" + _program(scaled)))


@given(_WORDS)
def test_steps_are_differences(blocks: list[dict[str, float]]) -> None:
    here = dict.fromkeys("XYZABC", 0.0)
    steps = []
    for block in blocks:
        steps.append({key: value - here[key] for key, value in block.items()})
        here |= block
    assert _close(ends_of("G91\n" + _program(steps)), ends_of("G90\n" + _program(blocks)))


@given(_WORDS, _ONE_POSITION, _ONE_POSITION, _ONE_POSITION)
def test_offsets_only_move_the_path(
    blocks: list[dict[str, float]],
    origin: tuple[float, ...],
    offset: tuple[float, ...],
    tool: tuple[float, ...],
) -> None:
    all_axes = [dict(zip("XYZABC", [0.0] * 6, strict=True)), *blocks]
    words = [
        " ".join(f"{k}{v}" for k, v in zip("XYZABC", p, strict=True))
        for p in (origin, offset, tool)
    ]
    # G92 makes the present machine position, which is the start, the program's `offset`.
    text = f"G10 L2 P3 {words[0]}\nG56 G43.1 {words[2]}\nG92 {words[1]}\n" + _program(all_axes)
    moved = [
        tuple(p - q for p, q in zip(end, offset, strict=True))
        for end in ends_of(_program(all_axes))
    ]
    assert _close(ends_of(text), moved)
