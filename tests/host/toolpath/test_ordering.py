# SPDX-License-Identifier: MIT
"""Contours joined to chains, and their order for short rapid moves. Run by pytest; writes to temporary folders."""

from __future__ import annotations

import itertools
import math
import random
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drawings import contours_of, length_of, messages_in, moves_in, svg_commands, svg_page
from hodograph.errors import InputError
from hodograph.toolpath.contours import Contours, Point
from hodograph.toolpath.drawing import DrawingOptions
from hodograph.toolpath.moves import ArcMove, StraightMove
from hodograph.toolpath.ordering import arrange, in_file_order, join, rapid_length, steps_of


def lines(*ends: tuple[Point, Point]) -> Contours:
    contours = Contours()
    for start, end in ends:
        contours.move_to(start, 1)
        contours.line_to(end, 1)
    return contours


def point(x: float, y: float) -> Point:
    return (x, y, 0.0)


def paths(folder: Path, *data: str, **options: Any) -> list[Any]:
    body = "\n".join(f'<path d="{each}"/>' for each in data)
    return svg_commands(folder, svg_page(body, width=400, height=400), **options)


def test_lines_in_any_order_and_direction_are_one_contour(tmp_path: Path) -> None:
    corners = [(10, 10), (50, 10), (50, 40), (30, 60), (10, 40)]
    sides = list(itertools.pairwise([*corners, corners[0]]))
    for seed in range(10):
        draw = random.Random(seed)
        mixed = [side[::-1] if draw.random() < 0.5 else side for side in draw.sample(sides, 5)]
        found = paths(tmp_path, *(f"M{a[0]} {a[1]}L{b[0]} {b[1]}" for a, b in mixed))
        (contour,) = contours_of(found)
        assert len(contour) == 5
        assert contour[0][0] == pytest.approx(contour[-1][-1], abs=1e-12)
        assert "5 contours joined to 1" in messages_in(found)[-1]


@pytest.mark.parametrize("gap", [0.0, 0.009, 0.011])
def test_ends_within_the_gap_are_joined(tmp_path: Path, gap: float) -> None:
    found = paths(tmp_path, "M10 10H20", f"M{20 + gap} 10V20", f"M{20 + gap} 20 A5 5 0 0 1 10 20")
    chains = contours_of(found)
    assert len(chains) == (2 if gap > 0.01 else 1)
    for chain in chains:
        for first, second in itertools.pairwise(chain):
            assert (first[-1] == second[0]).all()


def test_between_arcs_a_line_bridges_the_gap(tmp_path: Path) -> None:
    found = moves_in(paths(tmp_path, "M10 10 A5 5 0 0 1 20 10", "M20.008 10 A5 5 0 0 1 30 10"))
    assert [type(move) for move in found[1:]] == [ArcMove, StraightMove, ArcMove]


def test_no_motion_gets_lost_in_a_gap(tmp_path: Path) -> None:
    """Dashes that are shorter than the gap stay dashes."""
    found = contours_of(paths(tmp_path, "M10 10h0.005", "M20 10h0.005"))
    assert [round(length_of(contour), 6) for contour in found] == [0.005, 0.005]


def test_contours_of_other_layers_are_not_joined(tmp_path: Path) -> None:
    body = '<g id="a"><path d="M0 0h9"/></g><g id="b"><path d="M9 0h9"/></g>'
    found = svg_commands(tmp_path, svg_page(body), feeds={"a": 1.0, "b": 2.0})
    assert "2 contours joined to 2" in messages_in(found)[-1]
    assert [move.feed.feed_mm_s for move in moves_in(found) if move.feed is not None] == [1.0, 2.0]


@pytest.mark.parametrize("seed", range(5))
def test_the_order_of_few_contours_is_nearly_the_best(seed: int) -> None:
    draw = random.Random(seed)
    ends = [
        tuple(point(draw.uniform(0, 99), draw.uniform(0, 99)) for _ in range(2)) for _ in range(5)
    ]
    contours = lines(*((a, b) for a, b in ends))
    chains = join(contours, 0.01)
    found = rapid_length(contours, arrange(contours, chains, point(0, 0)), point(0, 0))
    best = math.inf
    for order in itertools.permutations(range(5)):
        for turned in itertools.product((0, 1), repeat=5):
            here, length = point(0, 0), 0.0
            for k in order:
                length += math.dist(here, ends[k][turned[k]])
                here = ends[k][1 - turned[k]]
            best = min(best, length)
    assert best - 1e-9 <= found <= 1.15 * best


def test_many_contours_are_visited_once_and_sooner(tmp_path: Path) -> None:
    draw = random.Random(1)
    places = [(draw.uniform(0, 390), draw.uniform(0, 390)) for _ in range(300)]
    shapes = ["h5v5h-5z", "a3 3 0 0 0 6 0a3 3 0 0 0 -6 0z", "l4 6"]
    data = [f"M{x:.3f} {y:.3f}{shapes[k % 3]}" for k, (x, y) in enumerate(places)]
    found, given = paths(tmp_path, *data), paths(tmp_path, *data, order="file")
    assert sum(map(length_of, contours_of(found))) == pytest.approx(
        sum(map(length_of, contours_of(given)))
    )
    text = messages_in(found)[-1]
    numbers = re.search(r"rapid moves of ([0-9.]+) mm, ([0-9]+) % shorter than ([0-9.]+) mm", text)
    assert numbers is not None
    rapids, here = 0.0, np.zeros(3)
    for move in moves_in(found):
        if move.feed is None:
            rapids += float(np.linalg.norm(np.array(move.end[:3]) - here))
        here = np.array(move.end[:3])
    assert float(numbers[1]) == pytest.approx(rapids, abs=0.06)
    assert float(numbers[1]) < 0.15 * float(
        numbers[3]
    )  # random places: 300 legs of 0.52 of the page


def test_a_closed_contour_begins_where_that_is_short(tmp_path: Path) -> None:
    found = moves_in(
        paths(tmp_path, "M300 100h50v50h-50z", start=(340.0, 240.0, 0.0, 0.0, 0.0, 0.0))
    )
    assert found[0].end[:2] == pytest.approx((350.0, 250.0))
    assert found[-1].end[:2] == pytest.approx((350.0, 250.0))
    body = '<circle cx="200" cy="200" r="50"/>'
    circle = moves_in(svg_commands(tmp_path, svg_page(body, width=400, height=400)))
    assert circle[0].end[:2] == pytest.approx((200 - 50 / math.sqrt(2), 200 - 50 / math.sqrt(2)))
    assert isinstance(circle[1], ArcMove)
    assert circle[1].end == circle[0].end


def test_inside_before_outside(tmp_path: Path) -> None:
    rings = ["M100 100h200v200h-200z", "M120 120h160v160h-160z", "M20 20h20v20h-20z"]
    hole = "M150 200a50 50 0 0 0 100 0a50 50 0 0 0 -100 0z"
    found = paths(tmp_path, *rings, hole, order="inside-first")
    lengths = [round(length_of(contour)) for contour in contours_of(found)]
    assert lengths == [314, 640, *sorted(lengths[2:], key=lambda each: lengths.index(each))]
    assert sorted(lengths[2:]) == [80, 800]


def test_layers_are_machined_in_the_order_asked_for(tmp_path: Path) -> None:
    body = '<g id="a"><path d="M1 1h1"/><path d="M90 40h3"/></g><g id="b"><path d="M2 2h2"/></g>'
    found = contours_of(svg_commands(tmp_path, svg_page(body), layers=["b", "a"]))
    assert [round(length_of(contour)) for contour in found] == [2, 1, 3]


def test_rapid_moves_are_lifted(tmp_path: Path) -> None:
    found = moves_in(paths(tmp_path, "M10 10h10", "M10 50h10", z_mm=-1.0, lift_mm=3.0))
    for first, second in itertools.pairwise([None, *found]):
        if second is not None and second.feed is None:
            before = (0.0, 0.0, 0.0) if first is None else first.end[:3]
            assert second.end[2] == 2.0
            assert before[2] == 2.0 or before[:2] == second.end[:2]
    assert found[-1].end[2] == 2.0
    assert {round(contour[-1][-1, 2], 9) for contour in contours_of(found)} == {-1.0}


def test_the_order_of_many_contours_at_one_point_takes_no_time() -> None:
    ends = [(point(0, 0), point(math.cos(k), math.sin(k))) for k in range(1_000)]
    contours = lines(*ends)
    chains = join(contours, 0.0)
    assert len(chains) == 500
    visits = arrange(contours, chains, point(0, 0))
    assert sum(1 for visit in visits for _ in steps_of(contours, visit)) == 1_000
    assert rapid_length(contours, visits, point(0, 0)) <= rapid_length(
        contours, in_file_order(chains), point(0, 0)
    )


@pytest.mark.parametrize(
    "options",
    [
        {"feed_mm_s": 0.0},
        {"feed_mm_s": math.nan},
        {"feed_mm_s": 1.0, "feeds": {"a": -1.0}},
        {"feed_mm_s": 1.0, "unit_mm": 0.0},
        {"feed_mm_s": 1.0, "scale": math.inf},
        {"feed_mm_s": 1.0, "gap_mm": -1.0},
        {"feed_mm_s": 1.0, "order": "any"},
    ],
)
def test_options_out_of_range(options: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        DrawingOptions(**options)


def test_contours_that_are_drawn_again_are_counted(tmp_path: Path) -> None:
    """In either direction; not two halves of a circle, and not a longer line."""
    twice = paths(tmp_path, "M0 0H10V5", "M50 0A5 5 0 0 1 60 0", "M10 5V0H0", "M0 0H10V5")
    assert messages_in(twice)[0].startswith("drawn again: 2 contours, first in line ")
    once = paths(tmp_path, "M50 0A5 5 0 0 1 60 0", "M50 0A5 5 0 0 0 60 0", "M0 0H10", "M0 0H11")
    assert not any("drawn again" in text for text in messages_in(once))
