# SPDX-License-Identifier: MIT
"""Points as toolpaths: columns, separators, headers, repeated points, and what is refused. Run by pytest; starts and
writes nothing.
"""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator
from typing import Any

import pytest

from drawings import messages_in, moves_in
from hodograph.errors import InputError, ToolpathError
from hodograph.toolpath.moves import Blending, Command, PathMode, ProgramEnd, StraightMove
from hodograph.toolpath.points import PointOptions, read_points

FILE = "part.csv"


def commands_of(text: str, **options: Any) -> list[Command]:
    settings = PointOptions(**{"feed_mm_s": 10.0, **options})
    found = list(read_points(text.splitlines(keepends=True), FILE, settings))
    assert isinstance(found[-1], ProgramEnd)
    return found


def ends_of(text: str, **options: Any) -> list[tuple[float, ...]]:
    return [move.end[:3] for move in moves_in(commands_of(text, **options))]


def refusal_of(text: str, **options: Any) -> ToolpathError:
    with pytest.raises(ToolpathError) as refusal:
        commands_of(text, **options)
    assert str(refusal.value).isprintable()
    return refusal.value


def test_a_rapid_move_to_the_first_point_and_straight_moves_at_feed() -> None:
    found = moves_in(commands_of("1,2,3\n4,5,6\n"))
    assert [(move.end, move.line) for move in found] == [
        ((1.0, 2.0, 3.0, 0.0, 0.0, 0.0), 1),
        ((4.0, 5.0, 6.0, 0.0, 0.0, 0.0), 2),
    ]
    assert [move.feed and move.feed.feed_mm_s for move in found] == [None, 10.0]


def test_the_start_is_not_approached_where_the_path_begins_there() -> None:
    assert ends_of("0,0\n1,0\n") == [(1.0, 0.0, 0.0)]
    assert ends_of("5,5\n1,0\n", start=(5.0, 5.0, 0.0, 0.0, 0.0, 0.0)) == [(1.0, 0.0, 0.0)]


def test_points_without_z_are_at_0_wherever_the_path_starts() -> None:
    """The start may be above the work."""
    ends = ends_of("5,5\n1,0\n", start=(5.0, 5.0, 20.0, 0.0, 0.0, 0.0))
    assert ends == [(5.0, 5.0, 0.0), (1.0, 0.0, 0.0)]


@pytest.mark.parametrize(
    "text",
    [
        "1.5,2\n3,-4.25\n",
        "1.5;2\r\n3;-4.25\r\n",
        "1,5;2\n3;-4,25\n",
        "1.5\t2\n3\t-4.25\n",
        "1,5\t2\n3\t-4,25\n",
        "  1.5   2 \n\n3 -4.25",
        "\N{ZERO WIDTH NO-BREAK SPACE}# points\n1.5,2\n// more\n3,-4.25 # last\n% end\n; end\n",
        "x,y\n1.5,2\n3,-425e-2\n",
        '"Y [mm]";"X [mm]"\n2;1.5\n-4.25;3\n',
        "x_mm y_mm\n1.5 2\n3 -4.25\n",
        '"x","y"\n"1.5","2"\n "3" ,-4.25\n',
        'sep=;\nx;y\n1,5;2\n"3";"-4,25"\n',
        "z,x (cm),y [um]\n0,0.15,2000\n0,0.3,-4250\n",
    ],
)
def test_separators_comments_and_headers(text: str) -> None:
    assert ends_of(text) == [pytest.approx((1.5, 2.0, 0.0)), pytest.approx((3.0, -4.25, 0.0))]


def test_columns_by_option() -> None:
    text = "7 1 2 600\n7 3 4 1200\n"
    found = moves_in(commands_of(text, columns=["-", "y", "x", "feed"]))
    assert [move.end[:2] for move in found] == [(2.0, 1.0), (4.0, 3.0)]
    assert found[1].feed is not None
    assert found[1].feed.feed_mm_s == 20.0
    assert ends_of("t,a,b\n1,2,3\n4,5,6\n", columns=["-", "x", "y"])[0] == (2.0, 3.0, 0.0)


def test_a_column_of_feeds() -> None:
    text = "x,y,feed (mm/s),c\n0,1,1,0\n1,1,5,90\n2,1,7,180\n"
    found = moves_in(commands_of(text, feed_mm_s=None))
    assert [move.feed and move.feed.feed_mm_s for move in found] == [None, 5.0, 7.0]
    assert [move.end[5] for move in found] == [0.0, 90.0, 180.0]


def test_rotary_axes_alone_turn_at_the_feed() -> None:
    found = moves_in(commands_of("x,c,feed\n0,0,60\n0,90,600\n5,90,60\n", feed_mm_s=None))
    assert [move.feed and move.feed.feed_deg_s for move in found] == [10.0, 1.0]


def test_units_and_scale_are_for_lengths_alone() -> None:
    text = "x,y [mm],c\n1,1,1\n2,2,2\n"
    assert moves_in(commands_of(text, unit_mm=25.4, scale=2.0))[0].end == (
        50.8,
        2.0,
        0.0,
        0.0,
        0.0,
        1.0,
    )


def test_a_closed_path_goes_back() -> None:
    assert ends_of("1,1\n2,1\n2,2\n", closed=True)[-1] == (1.0, 1.0, 0.0)
    assert len(ends_of("1,1\n2,1\n1,1\n", closed=True)) == 3


def test_repeated_points_are_named() -> None:
    found = commands_of("1,1\n1,1\n2,1\n2,1\n2,1\n")
    assert len(moves_in(found)) == 2
    assert messages_in(found) == ["left out: 3 points that repeat the one before, first in line 2"]


def test_noise_is_how_far_a_fitted_curve_may_be_off() -> None:
    first = commands_of("1,1\n2,1\n", noise_mm=0.05)[0]
    assert first == PathMode(0, Blending.CONTINUOUS, None, 0.05)


@pytest.mark.parametrize(
    ("text", "message", "place"),
    [
        ("", "fewer than two different points", (1, 1)),
        ("# nothing\n", "fewer than two different points", (1, 1)),
        ("1,2\n", "fewer than two different points", (1, 1)),
        ("1,2\n1,2\n", "fewer than two different points", (2, 1)),
        ("1,2\n3,nan\n", '"nan" is not a number', (2, 3)),
        ("nan,1\n3,4\n", '"nan" is not a number', (1, 1)),
        ("1,2\n3,inf\n", '"inf" is not a number', (2, 3)),
        ("1,2\n3,\n", '"" is not a number', (2, 3)),
        ("1,2\n1_0,3\n", '"1_0" is not a number', (2, 1)),
        ("1,2\n3,4,5\n", "3 columns, where the first line has 2", (2, 1)),
        ("1,2\n3\n", "1 columns", (2, 1)),
        ("1,2\n3,1e10\n", "out of range", (2, 3)),
        ("1 2 3 4\n", "4 of them without a header", (1, 1)),
        ("5\n6\n", "1 of them without a header", (1, 1)),
        ("x,y,speed\n1,2,3\n", '"speed" is not one of', (1, 1)),
        ("x,x\n1,2\n", '"x" twice', (1, 1)),
        ("x [furlong],y\n1,2\n", 'unit "furlong"', (1, 1)),
        ("feed,-\n1,2\n", "none of them is a coordinate", (1, 1)),
        ("x,y,feed\n1,2,3\n4,5,0\n", "not a positive feed", (3, 5)),
        ("1,2\n" + "3" * 5000 + ",4\n", "line longer than 4096", (2, 1)),
        ("G1 X1\nX2\n", '"G1" is not one of', (1, 1)),
    ],
)
def test_refusals_name_the_place(text: str, message: str, place: tuple[int, int]) -> None:
    error = refusal_of(text)
    assert message in str(error)
    assert (error.line, error.column) == place


def test_a_feed_is_needed() -> None:
    assert "no feed" in str(refusal_of("1,2\n3,4\n", feed_mm_s=None))


@pytest.mark.parametrize(
    "options",
    [
        {"feed_mm_s": 0.0},
        {"scale": 0.0},
        {"noise_mm": -1.0},
        {"columns": ["x", "q"]},
        {"separator": "ab"},
        {"unit_mm": float("nan")},
    ],
)
def test_options_out_of_range(options: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        PointOptions(**options)


def many(count: int) -> Iterator[str]:
    for k in range(count):
        yield f"{k % 1000}.25,{k // 1000}.5,-1e-1\n"


def test_memory_does_not_grow_with_the_file() -> None:
    peaks = []
    for count in (10_000, 50_000):
        tracemalloc.start()
        moves = sum(
            isinstance(each, StraightMove)
            for each in read_points(many(count), FILE, PointOptions(1.0))
        )
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert moves == count
    assert peaks[1] < peaks[0] + 200_000


def test_plain_lines_and_others_mean_the_same() -> None:
    lines = list(many(9_000))
    lines[5_000] = "0.25,5.5,-0.1 # a comment is read by the careful path\n"
    plain = list(read_points(many(9_000), FILE, PointOptions(1.0)))
    assert list(read_points(lines, FILE, PointOptions(1.0))) == plain


def test_what_a_spreadsheet_may_write_wrong_is_refused() -> None:
    """A decimal comma inside quotes is no separator, UTF-16 is no list of columns."""
    assert refusal_of('"1,5","2"\n"3","4"\n').line == 1
    encoded = "x,y\n0,0\n1,1\n".encode("utf-16").decode("utf-8", "surrogateescape")
    assert "UTF-16" in str(refusal_of(encoded))
