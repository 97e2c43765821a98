# SPDX-License-Identifier: MIT
"""Drawings in SVG: shapes, units, transforms, copies, what is left out, and what is refused. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import math
import random
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import svgelements

from drawings import (
    IN_FILE_ORDER,
    Points,
    contours_of,
    distance_both_ways,
    length_of,
    messages_in,
    moves_in,
    svg_commands,
    svg_page,
)
from hodograph.errors import InputError, ToolpathError
from hodograph.toolpath.drawing import DrawingOptions
from hodograph.toolpath.moves import ArcMove, Plane, SplineMove, StraightMove
from hodograph.toolpath.svg import read_svg
from marks import every


def refusal_of(folder: Path, text: str, **options: object) -> ToolpathError:
    with pytest.raises(ToolpathError) as refusal:
        svg_commands(folder, text, **options)
    assert "\n" not in str(refusal.value)
    return refusal.value


def test_a_line_is_a_rapid_move_and_a_move_at_feed(tmp_path: Path) -> None:
    found = moves_in(svg_commands(tmp_path, svg_page('<line x1="10" y1="5" x2="20" y2="5"/>')))
    assert [(move.end[:3], move.line) for move in found] == [
        ((10.0, 45.0, 0.0), 2),
        ((20.0, 45.0, 0.0), 2),
    ]
    assert found[0].feed is None
    assert found[1].feed is not None
    assert found[1].feed.feed_mm_s == 10.0


@pytest.mark.parametrize(
    ("head", "size"),
    [
        ('width="100mm" height="50mm" viewBox="0 0 100 50"', 1.0),
        ('width="4in" height="2in" viewBox="0 0 4 2"', 25.4),
        ('width="10cm" height="5cm" viewBox="0 0 200 100"', 0.5),
        ('width="960" height="480"', 25.4 / 96),
        ('width="960px" height="480px" viewBox="0 0 480 240"', 2 * 25.4 / 96),
        ('viewBox="0 0 960 480"', 25.4 / 96),
        ('width="100%" height="100%" viewBox="0 0 960 480"', 25.4 / 96),
        ('width="72pt" height="6pc"', 25.4 / 96),
        ('width="200mm" viewBox="0 0 100 50"', 2.0),
        ('height="100mm" viewBox="0 0 100 50"', 2.0),
        ('width="200mm" height="auto" viewBox="0 0 100 50"', 2.0),
        ('width="100%" height="100mm" viewBox="0 0 100 50" preserveAspectRatio="none"', 2.0),
    ],
)
def test_units(tmp_path: Path, head: str, size: float) -> None:
    text = f'<svg xmlns="http://www.w3.org/2000/svg" {head}><path d="M1 1H3"/></svg>'
    (contour,) = contours_of(svg_commands(tmp_path, text))
    assert length_of(contour) == pytest.approx(2 * size, rel=1e-12)
    (scaled,) = contours_of(svg_commands(tmp_path, text, scale=3.0))
    assert length_of(scaled) == pytest.approx(6 * size, rel=1e-12)
    (given,) = contours_of(svg_commands(tmp_path, text, unit_mm=7.0))
    assert length_of(given) == pytest.approx(14.0, rel=1e-12)


def test_the_lower_left_corner_of_the_page_is_the_origin(tmp_path: Path) -> None:
    text = '<svg viewBox="-10 -20 100 50" width="200mm" height="100mm"><path d="M-10 30h1"/></svg>'
    (contour,) = contours_of(svg_commands(tmp_path, text))
    assert contour[0][0] == pytest.approx((0.0, 0.0, 0.0), abs=1e-12)
    assert contour[0][-1] == pytest.approx((2.0, 0.0, 0.0), abs=1e-12)


def test_a_box_keeps_its_shape_in_the_middle_of_the_page(tmp_path: Path) -> None:
    for aspect, start, end in (
        ("", (25.0, 50.0), (75.0, 0.0)),
        ("xMinYMin meet", (0.0, 50.0), (50.0, 0.0)),
        ("none", (0.0, 50.0), (100.0, 0.0)),
        ("xMidYMax slice", (0.0, 100.0), (100.0, 0.0)),
    ):
        head = f'width="100mm" height="50mm" viewBox="0 0 10 10" preserveAspectRatio="{aspect}"'
        (contour,) = contours_of(
            svg_commands(tmp_path, f'<svg {head}><path d="M0 0L10 10"/></svg>', order="file")
        )
        assert contour[0][0, :2] == pytest.approx(start, abs=1e-9)
        assert contour[-1][-1, :2] == pytest.approx(end, abs=1e-9)


def test_circles_are_arcs_as_long_as_they_are_circles(tmp_path: Path) -> None:
    def only(transform: str) -> ArcMove | SplineMove:
        body = f'<circle transform="{transform}" cx="20" cy="10" r="5"/>'
        move = moves_in(svg_commands(tmp_path, svg_page(body)))[-1]
        assert not isinstance(move, StraightMove)
        return move

    upright = only("rotate(30) scale(2)")
    assert isinstance(upright, ArcMove)
    assert (upright.plane, upright.turns) == (Plane.XY, -1)
    assert isinstance(mirrored := only("scale(-1 1)"), ArcMove)
    assert mirrored.turns == 1
    assert mirrored.centre == pytest.approx((-20.0, 40.0))
    assert isinstance(only("scale(2 1)"), SplineMove)
    assert isinstance(only("skewX(10)"), SplineMove)


def test_an_ellipse_is_exact(tmp_path: Path) -> None:
    (contour,) = contours_of(
        svg_commands(tmp_path, svg_page('<ellipse cx="50" cy="25" rx="20" ry="3"/>'))
    )
    x, y = contour[0][:, 0] - 50.0, contour[0][:, 1] - 25.0
    assert np.hypot(x / 20.0, y / 3.0) == pytest.approx(np.ones(len(x)), abs=1e-13)


def test_no_transform(tmp_path: Path) -> None:
    body = '<g transform="none"><path style="transform: none" d="M1 1h3"/></g>'
    (contour,) = contours_of(svg_commands(tmp_path, svg_page(body)))
    assert length_of(contour) == pytest.approx(3.0)


def test_repeated_and_mirrored_commands(tmp_path: Path) -> None:
    short = "M0 0 1 1 2 0 m1 0 1 1 c1 0 2 1 2 2s1 2 2 2S9 9 9 8Q1 2 3 4T5 6t1 1h1v1H9V9z"
    long = "M0 0L1 1L2 0M3 0L4 1C5 1 6 2 6 3C6 4 7 5 8 5C9 5 9 9 9 8Q1 2 3 4Q5 6 5 6Q5 6 6 7L7 7L7 8L9 8L9 9Z"
    some, others = (
        contours_of(svg_commands(tmp_path, svg_page(f'<path d="{data}"/>'), **IN_FILE_ORDER))
        for data in (short, long)
    )
    assert len(some) == len(others) == 2
    for first, second in zip(some, others, strict=True):
        assert np.concatenate(first) == pytest.approx(np.concatenate(second), abs=1e-12)


def test_drawing_goes_on_after_a_path_is_closed(tmp_path: Path) -> None:
    found = contours_of(
        svg_commands(tmp_path, svg_page('<path d="M10 10h5v5zl0-5"/>'), **IN_FILE_ORDER)
    )
    assert [len(contour) for contour in found] == [4]
    assert found[0][3][0] == pytest.approx((10.0, 40.0, 0.0))
    assert found[0][3][-1] == pytest.approx((10.0, 45.0, 0.0))


def test_copies_are_drawn_where_they_are_used(tmp_path: Path) -> None:
    body = """
    <use xlink:href="#later" x="10" transform="scale(2)"/>
    <defs><path id="later" d="M0 0h1"/><g id="two"><use href="#later"/><use href="#later" y="5"/></g>
    <symbol id="s" viewBox="0 0 10 10"><path d="M0 0H10"/></symbol></defs>
    <use href="#two" x="30"/><use href="#s" x="50" width="20" height="20"/>"""
    found = contours_of(svg_commands(tmp_path, svg_page(body), **IN_FILE_ORDER))
    starts = [tuple(round(float(each), 9) for each in contour[0][0, :2]) for contour in found]
    assert starts == [(20.0, 50.0), (30.0, 50.0), (30.0, 45.0), (50.0, 50.0)]
    assert [length_of(contour) for contour in found] == pytest.approx([2.0, 1.0, 1.0, 20.0])


@pytest.mark.parametrize(
    ("rules", "own", "drawn"),
    [
        (".a{display:none!important}", "display:inline", False),
        (".a{display:none ! IMPORTANT}#b{display:inline}", "", False),
        (".a{display:none!important}", "display:inline!important", True),
        (".a{display:none!important;display:inline}", "", False),
        (".a{display:none!important}#b{display:inline!important}", "", True),
        (".a{display:none}", "display:inline", True),
    ],
)
def test_an_important_style_has_precedence(
    tmp_path: Path, rules: str, own: str, *, drawn: bool
) -> None:
    shape = f'<path id="b" class="a" style="{own}" d="M1 1H3"/>'
    page = svg_page(f'<style>{rules}</style><path d="M5 5h1"/>{shape}')
    assert len(contours_of(svg_commands(tmp_path, page))) == 1 + drawn


def test_a_symbol_has_a_style(tmp_path: Path) -> None:
    def symbol(attributes: str) -> str:
        text = f'<symbol id="s" {attributes}><path d="M0 0h1"/></symbol><use href="#s"/>'
        return svg_page(f"<style>symbol.wide {{ transform: scale(3) }}</style>{text}")

    for attributes in ('style="transform: scale(3)"', 'class="wide"', 'transform="scale(3)"'):
        (contour,) = contours_of(svg_commands(tmp_path, symbol(attributes)))
        assert length_of(contour) == pytest.approx(3.0)
    red = svg_commands(tmp_path, symbol('stroke="red" display="none"'), feeds={"red": 7.0})
    assert {move.feed.feed_mm_s for move in moves_in(red) if move.feed} == {7.0}
    assert len(contours_of(svg_commands(tmp_path, symbol(""), ids=["s"]))) == 1
    assert "no line or curve" in str(refusal_of(tmp_path, symbol('visibility="hidden"')))
    hidden = '<svg id="s" display="none"><g><path d="M0 0h1"/></g></svg><use href="#s"/>'
    found = svg_commands(tmp_path, svg_page(f'{hidden}<path d="M0 0h2"/>'))
    assert [length_of(contour) for contour in contours_of(found)] == pytest.approx([2.0])


def test_copies_of_copies_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hodograph.toolpath.drawing.MOST_COPIES", 20_000)  # else it takes seconds
    rows = ['<g id="g0"><path d="M0 0h1"/></g>']
    rows += [f'<g id="g{k}">' + f'<use href="#g{k - 1}"/>' * 10 + "</g>" for k in range(1, 12)]
    assert "copies add more than" in str(refusal_of(tmp_path, svg_page("\n".join(rows))))
    loop = '<g id="a"><path d="M0 0h1"/><use href="#a"/></g>'
    assert "uses itself" in str(refusal_of(tmp_path, svg_page(loop)))


def test_what_is_no_curve_is_named(tmp_path: Path) -> None:
    body = """<path d="M0 0h1"/><text>a</text><text>b</text><image href="x.png"/>
    <g style="display:none"><path d="M0 0h9"/></g><path visibility="hidden" d="M0 0h9"/>
    <path d="M5 5z"/><use href="#none"/><path d="M3 3h1" clip-path="url(#c)"/>"""
    found = svg_commands(tmp_path, svg_page(body))
    text = "; ".join(messages_in(found))
    assert 'element "text", 2 times, first in line 2' in text
    for what in (
        '"image"',
        "hidden element, 2 times",
        '"path" without length',
        'use of "#none"',
        '"clip-path"',
    ):
        assert what in text
    assert len(contours_of(found)) == 2
    error = refusal_of(tmp_path, svg_page(body), strict=True)
    assert (error.line, '"text"' in str(error)) == (2, True)


def test_definitions_are_not_drawn(tmp_path: Path) -> None:
    body = """<defs><path d="M0 0h9"/></defs><clipPath><path d="M0 0h9"/></clipPath><title>t</title>
    <marker><path d="M0 0h9"/></marker><pattern><rect width="3" height="3"/></pattern><path d="M1 1h1"/>"""
    found = svg_commands(tmp_path, svg_page(body))
    assert len(contours_of(found)) == 1
    assert len(messages_in(found)) == 1


def test_layers_and_colours_choose_feeds(tmp_path: Path) -> None:
    body = """<style>.r { stroke: red } #two { stroke: rgb(0, 0, 255) } path.g { stroke: #0f0 }</style>
    <g id="l1" inkscape:groupmode="layer" inkscape:label="Cut"><path class="r" d="M0 0h1"/></g>
    <g stroke="red"><path id="two" d="M0 9h1"/><path class="g" d="M0 8h1"/><path d="M0 7h1" style="stroke:none"/>
    <path d="M0 6h1"/></g>"""
    feeds = {"Cut": 1.0, "blue": 2.0, "#00ff00": 3.0, "#000": 4.0, "red": 5.0}
    found = moves_in(svg_commands(tmp_path, svg_page(body), feeds=feeds, **IN_FILE_ORDER))
    assert [move.feed.feed_mm_s for move in found if move.feed is not None] == [
        1.0,
        2.0,
        3.0,
        4.0,
        5.0,
    ]
    with pytest.raises(InputError, match='a feed for "green"'):
        svg_commands(tmp_path, svg_page(body), feeds={"green": 1.0})


def test_layers_and_identities_choose_elements(tmp_path: Path) -> None:
    body = """<g id="a"><path id="p" d="M0 0h1"/><g id="b"><path d="M0 0h2"/></g></g>
    <g inkscape:groupmode="layer" inkscape:label="L"><path id="q" d="M0 0h4"/></g><path d="M0 0h8"/>"""

    def length(**options: object) -> float:
        return sum(map(length_of, contours_of(svg_commands(tmp_path, svg_page(body), **options))))

    assert length() == pytest.approx(15.0)
    assert length(layers=["a"]) == pytest.approx(3.0)
    assert length(layers=["L", "a"]) == pytest.approx(7.0)
    assert length(ids=["b", "q"]) == pytest.approx(6.0)
    assert length(layers=["a"], ids=["p"]) == pytest.approx(1.0)
    with pytest.raises(InputError, match='no layer "x" in the drawing: it has L, a'):
        length(layers=["x"])
    with pytest.raises(InputError, match='the identity "x"'):
        length(ids=["x"])


@pytest.mark.parametrize(
    ("body", "text"),
    [
        ('<path d="M0 0L1"/>', 'path data, character 7: a number of "L" is missing'),
        ('<path d="L1 1"/>', "a path begins with M"),
        ('<path d="M0 0 X"/>', 'a number of "L" is missing, there is "X"'),
        ('<path d="M0 0 a1 1 0 2 0 1 1"/>', "a flag, 0 or 1,"),
        ('<path d="M0 0z3"/>', "is not a command"),
        ('<path d="M0 0L1e999 0"/>', "beyond"),
        ('<rect width="-1" height="1"/>', "negative"),
        ('<rect width="1em" height="1"/>', 'unit "em" is unknown'),
        ('<circle r="x"/>', '"x" is not a length'),
        ('<polygon points="1 2 3"/>', "odd count"),
        ('<g transform="rotate(1 2)"/>', "rotate"),
        ('<g transform="turn(1)"/>', "turn"),
        ('<g transform-origin="1 2"/>', "transform-origin"),
        ("<g></h>", "mismatched tag"),
        ("<text>a</text>", "no line or curve"),
        ("", "no line or curve"),
    ],
)
def test_refusals_name_the_place(tmp_path: Path, body: str, text: str) -> None:
    error = refusal_of(tmp_path, svg_page(body))
    assert text in str(error)
    assert error.line in (2, 3, 4)
    assert error.column >= 1


def test_what_is_no_svg_is_refused(tmp_path: Path) -> None:
    assert 'the root is "html"' in str(refusal_of(tmp_path, "<html/>"))
    assert "not well-formed" in str(refusal_of(tmp_path, "G1 X1"))
    assert "not well-formed" in str(refusal_of(tmp_path, ""))
    assert "unknown encoding" in str(
        refusal_of(tmp_path, '<?xml version="1.0" encoding="none"?><svg/>')
    )
    with pytest.raises(InputError, match="cannot be read"):
        list(read_svg(tmp_path / "missing.svg", DrawingOptions(feed_mm_s=1.0)))


# ---- beside svgelements, an independent reader


_OF_TWO_DEGREES = {
    first + second
    for pair in (("qQtT", "sS"), ("cCsS", "tT"))
    for first in pair[0]
    for second in pair[1]
}


class _Writer:
    """Random drawings; a pure function of the seed."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def _n(self, low: float = -40.0, high: float = 40.0) -> str:
        return f"{self._random.uniform(low, high):.{self._random.randint(0, 4)}f}"

    def _transform(self) -> str:
        n = self._n
        return " ".join(
            self._random.choice(
                [
                    f"translate({n()},{n()})",
                    f"rotate({n(0, 360)})",
                    f"rotate({n(0, 360)} {n()} {n()})",
                    f"scale({n(0.5, 2)})",
                    f"scale({n(0.5, 2)},-{n(0.5, 2)})",
                    f"skewX({n(-30, 30)})",
                    f"skewY({n(-30, 30)})",
                    f"matrix(1 {n(0, 1)} {n(-1, 0)} 1.5 {n()} {n()})",
                ]
            )
            for _ in range(self._random.randint(0, 2))
        )

    def _path(self) -> str:
        n, parts = self._n, [f"M{self._n()} {self._n()}l3 4"]
        for _ in range(self._random.randint(1, 8)):
            command = self._random.choice("lLhHvVcCsSqQtTaAmMz")
            # svgelements mirrors the control point of a curve of the other degree too.
            if parts[-1][0] + command in _OF_TWO_DEGREES:
                command = "l"
            count = {"h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "z": 0}.get(command.lower(), 2)
            if command.lower() == "a":
                radii = f"{n(1, 30)} {n(1, 30)} {n(-90, 90)}"
                numbers = (
                    f"{radii} {self._random.randint(0, 1)} {self._random.randint(0, 1)} {n()} {n()}"
                )
            else:
                numbers = " ".join(n() for _ in range(count))
            parts.append(f"{command}{numbers}")
        return f'<path d="{" ".join(parts)}"'

    def _shape(self) -> str:
        n = self._n
        return self._random.choice(
            [
                f'<rect x="{n()}" y="{n()}" width="{n(5, 30)}" height="{n(5, 30)}" rx="{n(0, 20)}"',
                f'<rect x="{n()}" y="{n()}" width="{n(5, 30)}mm" height="{n(5, 30)}"',
                f'<circle cx="{n()}" cy="{n()}" r="{n(1, 20)}"',
                f'<ellipse cx="{n()}" cy="{n()}" rx="{n(1, 20)}" ry="{n(1, 20)}"',
                f'<line x1="{n()}" y1="{n()}" x2="{n()}" y2="{n()}"',
                f'<polyline points="{n()},{n()} {n()},{n()} {n()},{n()}"',
                f'<polygon points="{n()},{n()} {n()},{n()} {n()},{n()}"',
                *[self._path() for _ in range(5)],
            ]
        )

    def drawing(self) -> str:
        rows = []
        for _ in range(self._random.randint(1, 5)):
            inner = "".join(f'{self._shape()} transform="{self._transform()}"/>' for _ in range(2))
            rows.append(f'<g transform="{self._transform()}">{inner}</g>')
        body = "\n".join(rows)
        box = self._random.choice(["0 0 200 100", "-30 10 400 200", "0 0 100 100"])
        return f'<svg xmlns="http://www.w3.org/2000/svg" width="200mm" height="100mm" viewBox="{box}">{body}</svg>'


def polylines_by_svgelements(path: Path) -> list[Points]:
    """Each segment as points, in mm, y up."""
    found = []
    for element in svgelements.SVG.parse(str(path), ppi=96.0, reify=False).elements():
        if not isinstance(element, svgelements.Shape):
            continue
        for segment in element.segments(transformed=False):
            if isinstance(
                segment, svgelements.Move
            ) or segment.start == segment.end == segment.point(0.5):
                continue
            points = [
                element.transform.point_in_matrix_space(segment.point(k / 64)) for k in range(65)
            ]
            found.append(
                np.array([(p.x * 25.4 / 96, 100.0 - p.y * 25.4 / 96, 0.0) for p in points])
            )
    return found


@pytest.mark.parametrize("part", every(10, range(10)))
def test_random_drawings_agree_with_svgelements(tmp_path: Path, part: int) -> None:
    for seed in range(part * 10, part * 10 + 10):
        ours = contours_of(svg_commands(tmp_path, _Writer(seed).drawing(), **IN_FILE_ORDER))
        theirs = polylines_by_svgelements(tmp_path / "drawing.svg")
        mine = [points for contour in ours for points in contour]
        assert len(theirs) > 0
        assert distance_both_ways(mine, theirs, 0.5) < 0.4, seed
        assert sum(map(length_of, ours)) == pytest.approx(length_of(theirs), rel=2e-3), seed


def test_a_long_path_takes_little_memory(tmp_path: Path) -> None:
    data = "M0 0" + "".join(f"l{math.cos(k):.3f} {math.sin(k):.3f}" for k in range(20_000))
    path = tmp_path / "long.svg"
    path.write_text(f'<svg width="10mm" height="10mm"><path d="{data}"/></svg>')
    tracemalloc.start()
    count = sum(1 for _ in read_svg(path, DrawingOptions(feed_mm_s=1.0)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count > 20_000
    assert peak < 10 * path.stat().st_size + 3_000_000


@pytest.mark.parametrize("size", ["", 'width="100%" height="100%"'])
def test_a_page_without_a_size_is_reported(tmp_path: Path, size: str) -> None:
    text = f'<svg xmlns="http://www.w3.org/2000/svg" {size} viewBox="0 0 96 96"><path d="M0 0H96"/></svg>'
    found = svg_commands(tmp_path, text)
    assert messages_in(found)[0].startswith("the page has no size")
    assert moves_in(found)[-1].end[0] == pytest.approx(25.4)
    assert "no size" not in messages_in(svg_commands(tmp_path, text, unit_mm=1.0))[0]
