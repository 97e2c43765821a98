# SPDX-License-Identifier: MIT
"""Drawings in DXF: entities, blocks, layers, units, what is left out, and what is refused. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import math
import random
import tracemalloc
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from ezdxf.disassemble import recursive_decompose
from ezdxf.math import fit_points_to_cad_cv
from ezdxf.path import make_path

from drawings import (
    IN_FILE_ORDER,
    Points,
    contours_of,
    distance_both_ways,
    dxf_commands,
    length_of,
    messages_in,
    moves_in,
)
from hodograph.errors import InputError, ToolpathError
from hodograph.toolpath import dxf_tags
from hodograph.toolpath.contours import Spline
from hodograph.toolpath.drawing import DrawingOptions
from hodograph.toolpath.dxf import read_dxf
from hodograph.toolpath.dxf_curves import clamped
from hodograph.toolpath.moves import ArcMove, SplineMove, StraightMove
from marks import every


def new(units: int = 4) -> Any:
    document = ezdxf.new("R2010")
    document.units = units
    return document


def commands_of(folder: Path, document: Any, **options: Any) -> list[Any]:
    path = folder / "drawing.dxf"
    document.saveas(path)
    return dxf_commands(path, **options)


def text_of(*entities: str, header: str = "9\n$INSUNITS\n70\n4\n") -> str:
    body = "".join(entity.replace(" ", "\n") + "\n" for entity in entities)
    return f"0\nSECTION\n2\nHEADER\n{header}0\nENDSEC\n0\nSECTION\n2\nENTITIES\n{body}0\nENDSEC\n0\nEOF\n"


LINE = "0 LINE 8 0 10 0 20 0 11 3 21 4"


def write(folder: Path, text: str | bytes) -> Path:
    path = folder / "drawing.dxf"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


def refusal_of(folder: Path, text: str | bytes, **options: Any) -> ToolpathError:
    with pytest.raises(ToolpathError) as refusal:
        dxf_commands(write(folder, text), **options)
    assert str(refusal.value).isprintable()
    return refusal.value


@pytest.mark.parametrize(
    ("units", "size"),
    [(3, 1609344.0), (8, 2.54e-5), (9, 0.0254), (21, 304.800609601219), (24, 1609347.21869444)],
)
def test_units_that_ezdxf_does_not_convert(tmp_path: Path, units: int, size: float) -> None:
    line = text_of("0 LINE 10 0 20 0 11 400 21 0", header=f"9\n$INSUNITS\n70\n{units}\n")
    (contour,) = contours_of(dxf_commands(write(tmp_path, line), gap_mm=0.0))
    assert length_of(contour) == pytest.approx(400 * size, rel=1e-12)


def test_a_line(tmp_path: Path) -> None:
    found = moves_in(dxf_commands(write(tmp_path, text_of("0 LINE 8 0 10 1 20 2 30 3 11 4 21 5"))))
    assert [(move.end[:3], move.line) for move in found] == [
        ((1.0, 2.0, 3.0), 16),
        ((4.0, 5.0, 0.0), 16),
    ]


@pytest.mark.parametrize(
    ("units", "size"), [(1, 25.4), (2, 304.8), (4, 1.0), (5, 10.0), (6, 1000.0), (13, 1e-3)]
)
def test_units(tmp_path: Path, units: int, size: float) -> None:
    text = text_of(LINE, header=f"9\n$INSUNITS\n70\n{units}\n")
    assert sum(map(length_of, contours_of(dxf_commands(write(tmp_path, text))))) == pytest.approx(
        5 * size
    )
    (scaled,) = contours_of(dxf_commands(write(tmp_path, text), scale=0.5, unit_mm=3.0))
    assert length_of(scaled) == pytest.approx(7.5)


@pytest.mark.parametrize("header", ["", "9\n$INSUNITS\n70\n0\n", "9\n$INSUNITS\n70\n99\n"])
def test_a_drawing_without_unit_asks_for_it(tmp_path: Path, header: str) -> None:
    path = write(tmp_path, text_of(LINE, header=header))
    with pytest.raises(InputError, match="does not say its unit"):
        dxf_commands(path)
    (contour,) = contours_of(dxf_commands(path, unit_mm=25.4))
    assert length_of(contour) == pytest.approx(127.0)


def test_arcs_and_circles_are_arcs(tmp_path: Path) -> None:
    document = new()
    space = document.modelspace()
    space.add_arc((10, 10), 5, 350, 80)
    space.add_circle((40, 10), 3)
    space.add_circle((40, 10), 3, dxfattribs={"extrusion": (0, 0, -1)})
    found = moves_in(commands_of(tmp_path, document, **IN_FILE_ORDER))
    arcs = [move for move in found if isinstance(move, ArcMove)]
    assert [arc.turns for arc in arcs] == [1, 1, -1]
    assert [arc.centre for arc in arcs] == [(10.0, 10.0), (40.0, 10.0), (-40.0, 10.0)]
    assert arcs[0].end[:2] == pytest.approx(
        (10 + 5 * math.cos(math.radians(80)), 10 + 5 * math.sin(math.radians(80)))
    )


@pytest.mark.parametrize("turn", ["6.283185307179586", "6.283186", "6.28319", "6.2832"])
def test_an_ellipse_over_a_rounded_turn_is_whole(tmp_path: Path, turn: str) -> None:
    ellipse = f"0 ELLIPSE 8 0 10 0 20 0 11 10 21 0 40 0.5 41 0 42 {turn}"
    (contour,) = contours_of(dxf_commands(write(tmp_path, text_of(ellipse))))
    assert length_of(contour) == pytest.approx(48.4422, abs=0.02)


def test_an_arc_over_a_rounded_turn_is_whole(tmp_path: Path) -> None:
    for begin, end in ((0.0, 360.00000000000006), (0.1 + 0.2, 0.3 + 360.000001)):
        arc = f"0 ARC 10 0 20 0 40 10 50 {begin} 51 {end}"
        (contour,) = contours_of(dxf_commands(write(tmp_path, text_of(arc))))
        assert length_of(contour) == pytest.approx(20.0 * math.pi, abs=0.02)


def test_bulges_are_arcs(tmp_path: Path) -> None:
    document = new()
    document.modelspace().add_lwpolyline(
        [(0, 0, 1), (10, 0, -math.tan(math.pi / 8)), (20, 0)], format="xyb", close=True
    )
    found = moves_in(commands_of(tmp_path, document, **IN_FILE_ORDER))
    assert isinstance(found[0], ArcMove)
    assert (found[0].centre, found[0].turns) == (pytest.approx((5.0, 0.0)), 1)
    assert isinstance(found[1], ArcMove)
    assert (found[1].centre, found[1].turns) == (pytest.approx((15.0, -5.0)), -1)
    assert isinstance(found[2], StraightMove)
    assert found[2].end[:2] == (0.0, 0.0)


@pytest.mark.parametrize("bulge", [1e-300, 1e-14, -1e-9, 1e-8, -1e-7, 1e-6, 1e-4])
def test_slight_bulges_are_drawn(tmp_path: Path, bulge: float) -> None:
    line = f"0 LWPOLYLINE 8 0 90 2 70 0 10 0 20 0 42 {bulge:g} 10 100 20 0"
    (contour,) = contours_of(dxf_commands(write(tmp_path, text_of(line))))
    (points,) = contour
    assert points[[0, -1], :2] == pytest.approx(np.array([[0.0, 0.0], [100.0, 0.0]]))
    lowest = points[np.abs(points[:, 1]).argmax(), 1]
    assert lowest == pytest.approx(-50.0 * bulge, rel=1e-2, abs=1e-9)


def test_a_rational_spline_is_kept_exactly(tmp_path: Path) -> None:
    document = new()
    points, weights = [(0, 0, 0), (5, 5, 1), (10, 0, 2), (15, 6, 3), (20, 1, 4)], [1, 2, 1, 3, 1]
    document.modelspace().add_rational_spline(points, weights, degree=3)
    (_, move) = moves_in(commands_of(tmp_path, document, **IN_FILE_ORDER, start=(1.0,) * 6))
    assert isinstance(move, SplineMove)
    assert [point[:3] for point in move.points] == points
    assert move.weights == tuple(weights)
    assert move.knots == (0, 0, 0, 0, 0.5, 1, 1, 1, 1)
    assert move.degree == 3


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_a_spline_without_repeated_end_knots_is_clamped(degree: int) -> None:
    draw = np.random.default_rng(degree)
    points, weights = draw.uniform(-9, 9, (9, 3)), draw.uniform(0.5, 2.0, 9)
    knots = np.cumsum(draw.uniform(0.1, 1.0, 9 + degree + 1))
    knots = (knots - knots[degree]) / (knots[9] - knots[degree])
    found = clamped(Spline(points, weights, knots, degree))
    assert (found.knots[: degree + 1] == 0.0).all()
    assert (found.knots[-degree - 1 :] == 1.0).all()

    def at(spline: Spline, t: Points) -> Points:
        from scipy.interpolate import BSpline

        values = np.column_stack([spline.points * spline.weights[:, None], spline.weights])
        both = BSpline(spline.knots, values, spline.degree)(t)
        return np.asarray(both[:, :3] / both[:, 3:])

    t = np.linspace(0.0, 1.0, 50)
    assert at(found, t) == pytest.approx(at(Spline(points, weights, knots, degree), t), abs=1e-12)


@pytest.mark.parametrize("tangents", [None, [(1, 1, 0), (0, -1, 0)]])
def test_a_spline_through_fit_points_is_that_of_cad(tmp_path: Path, tangents: Any) -> None:
    points = [(0, 30, 0), (5, 35, 0), (10, 30, 0), (10, 30, 0), (15, 36, 0), (15.5, 36, 0)]
    document = new()
    spline = document.modelspace().add_spline(points)
    if tangents:
        spline.dxf.start_tangent, spline.dxf.end_tangent = tangents
    (_, move) = moves_in(commands_of(tmp_path, document))
    assert isinstance(move, SplineMove)
    expected = fit_points_to_cad_cv([*points[:3], *points[4:]], tangents=tangents)
    assert [point[:3] for point in move.points] == pytest.approx(
        [pytest.approx(point.xyz, abs=1e-9) for point in expected.control_points]
    )


@pytest.mark.parametrize("again", ["", " 11 1e-13 21 0"])
def test_a_closed_spline_through_fit_points_is_smooth_everywhere(
    tmp_path: Path, again: str
) -> None:
    square = "11 0 21 0 11 10 21 0 11 10 21 10 11 0 21 10"
    text = text_of(f"0 SPLINE 8 0 70 1 71 3 {square}{again}")
    (contour,) = contours_of(dxf_commands(write(tmp_path, text)))
    (points,) = contour
    assert points[0] == pytest.approx(points[-1], abs=1e-9)
    for corner in ((0, 0), (10, 0), (10, 10), (0, 10)):
        assert np.hypot(*(points[:, :2] - corner).T).min() < 0.2
    # It has the symmetry of the square.
    radii = np.hypot(*(points[:, :2] - 5.0).T)
    assert radii.max() - radii.min() < 0.2
    assert np.ptp(points[:, 0]) == pytest.approx(np.ptp(points[:, 1]), abs=1e-2)


def test_rapid_moves_are_lifted_above_the_middle_of_contours(tmp_path: Path) -> None:
    document = new()
    space = document.modelspace()
    space.add_circle((0, 0, -9), 1)  # an arc has its direction where points have z
    space.add_line((5, 0, -9), (6, 0, -9))
    assert max(move.end[2] for move in moves_in(commands_of(tmp_path, document, lift_mm=2.0))) == -7
    space.add_polyline3d([(0, 5, 0), (5, 5, 10), (9, 5, 0)])
    found = moves_in(commands_of(tmp_path, document, lift_mm=2.0))
    assert max(move.end[2] for move in found if move.feed is None) == 12.0
    space.add_open_spline([(0, 7, 0), (1, 7, 30), (2, 7, 30), (3, 7, 0)])
    found = moves_in(commands_of(tmp_path, document, lift_mm=2.0))
    assert max(move.end[2] for move in found if move.feed is None) == 32.0


def test_layers_colours_and_blocks_choose_feeds(tmp_path: Path) -> None:
    document = new()
    document.layers.add("Cut", color=1)
    document.layers.add("Mark", color=5)
    block = document.blocks.new("B")
    block.add_line((0, 0), (1, 0), dxfattribs={"layer": "0", "color": 256})
    block.add_line((0, 1), (1, 1), dxfattribs={"layer": "0", "color": 0})
    block.add_line((0, 2), (1, 2), dxfattribs={"layer": "Mark", "color": 3})
    space = document.modelspace()
    space.add_line((5, 5), (6, 5), dxfattribs={"layer": "cut"})
    space.add_blockref("B", (9, 9), dxfattribs={"layer": "Mark", "color": 6})
    space.add_line((5, 6), (6, 6), dxfattribs={"true_color": 0x123456})
    feeds = {"Cut": 1.0, "#0000FF": 2.0, "6": 3.0, "3": 4.0, "#123456": 5.0}
    found = moves_in(commands_of(tmp_path, document, feeds=feeds, **IN_FILE_ORDER))
    assert [move.feed.feed_mm_s for move in found if move.feed is not None] == [
        1.0,
        2.0,
        3.0,
        4.0,
        5.0,
    ]
    assert len(contours_of(commands_of(tmp_path, document, layers=["Mark"]))) == 3


def test_hidden_layers_layouts_and_text_are_named(tmp_path: Path) -> None:
    document = new()
    document.layers.add("Off").off()
    document.layers.add("Frozen").freeze()
    space = document.modelspace()
    space.add_line((0, 0), (1, 0))
    for layer in ("Off", "Frozen"):
        space.add_line((0, 0), (9, 0), dxfattribs={"layer": layer})
    space.add_line((0, 0), (9, 0), dxfattribs={"invisible": 1})
    space.add_text("text")
    space.add_point((1, 1))
    space.add_line((1, 1), (1, 1))
    document.layout("Layout1").add_line((0, 0), (9, 9))
    block = document.blocks.new("B")
    block.add_text("inside")
    space.add_blockref("B", (0, 0)).add_attrib("A", "text")
    found = commands_of(tmp_path, document)
    assert sum(map(length_of, contours_of(found))) == pytest.approx(1.0)
    text = "; ".join(messages_in(found))
    for what in (
        'layer "Off"',
        'layer "Frozen"',
        "hidden entity",
        "TEXT, 2 times",
        "POINT",
        "LINE without length",
        "ATTRIB",
    ):
        assert what in text
    with pytest.raises(ToolpathError, match="cannot be followed"):
        commands_of(tmp_path, document, strict=True)


def test_a_frozen_layer_hides_blocks_with_all_of_their_layers(tmp_path: Path) -> None:
    document = new()
    document.layers.add("Frozen").freeze()
    document.layers.add("Off").off()
    document.layers.add("Cut")
    document.blocks.new("Inner").add_line((0, 0), (1, 0), dxfattribs={"layer": "Cut"})
    block = document.blocks.new("B")
    block.add_line((0, 0), (2, 0), dxfattribs={"layer": "Cut"})
    block.add_line((0, 0), (4, 0))
    block.add_blockref("Inner", (0, 0), dxfattribs={"layer": "Frozen"})
    for layer in ("Off", "Frozen"):
        document.modelspace().add_blockref("B", (0, 0), dxfattribs={"layer": layer})
    found = commands_of(tmp_path, document)
    assert sum(map(length_of, contours_of(found))) == pytest.approx(2.0)
    assert 'block on the frozen layer "Frozen", 2 times' in "; ".join(messages_in(found))


def test_entities_are_chosen_by_handle(tmp_path: Path) -> None:
    document = new()
    lines = [document.modelspace().add_line((0, k), (k, k)) for k in (1, 2, 4)]
    found = contours_of(
        commands_of(tmp_path, document, ids=[lines[0].dxf.handle, lines[2].dxf.handle])
    )
    assert sum(map(length_of, found)) == pytest.approx(5.0)


def test_blocks_within_blocks_are_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hodograph.toolpath.drawing.MOST_COPIES", 20_000)  # else it takes seconds
    document = new()
    document.blocks.new("B0").add_line((0, 0), (1, 0))
    for k in range(1, 12):
        block = document.blocks.new(f"B{k}")
        for column in range(10):
            block.add_blockref(f"B{k - 1}", (column, 0))
    document.modelspace().add_blockref("B11", (0, 0))
    path = tmp_path / "drawing.dxf"
    document.saveas(path)
    with pytest.raises(ToolpathError, match="copies add more than"):
        dxf_commands(path)
    grid = text_of("0 INSERT 8 0 2 B 10 0 20 0 70 30000 71 30000").replace(
        "0\nSECTION\n2\nENTITIES",
        "0\nSECTION\n2\nBLOCKS\n0\nBLOCK\n2\nB\n0\nENDBLK\n0\nENDSEC\n0\nSECTION\n2\nENTITIES",
    )
    assert "copies add more than" in str(refusal_of(tmp_path, grid))


def text_with_blocks(blocks: dict[str, str], entities: str, tables: str = "") -> str:
    body = "".join(f"0 BLOCK 2 {name} 10 1 20 0 {text} 0 ENDBLK " for name, text in blocks.items())
    sections = f"0 SECTION 2 TABLES {tables} 0 ENDSEC 0 SECTION 2 BLOCKS {body}0 ENDSEC ".split()
    text = text_of(entities)
    at = text.index("0\nSECTION\n2\nENTITIES")
    return text[:at] + "\n".join(sections) + "\n" + text[at:]


@pytest.mark.parametrize("zero", [(41,), (43,), (41, 42, 43)])
def test_a_scale_of_zero_is_one(tmp_path: Path, zero: tuple[int, ...]) -> None:
    """Programs write it where a block is not scaled."""
    line = "0 LINE 8 0 10 0 20 0 30 1 11 3 21 4 31 6"
    scale = " ".join(f"{code} 0" for code in zero)
    text = text_with_blocks({"B": line}, f"0 INSERT 2 B 10 1 20 0 {scale}")
    (contour,) = contours_of(dxf_commands(write(tmp_path, text)))
    assert contour[0][[0, -1], :3] == pytest.approx(np.array([[0.0, 0, 1], [3, 4, 6]]))


def test_a_block_may_follow_the_one_that_it_is_inserted_in(tmp_path: Path) -> None:
    insert = "0 INSERT 2 Later 10 3 20 0"
    text = text_with_blocks({"First": insert, "LATER": LINE}, "0 INSERT 2 First 10 0 20 0")
    (contour,) = contours_of(dxf_commands(write(tmp_path, text)))
    assert contour[0][[0, -1], :2] == pytest.approx(np.array([[1.0, 0.0], [4.0, 4.0]]))
    missing = text_with_blocks({"First": insert}, LINE)
    assert 'INSERT: block "Later" is not in the file' in str(refusal_of(tmp_path, missing))
    loop = text_with_blocks({"A": "0 INSERT 2 A 10 0 20 0"}, "0 INSERT 2 A 10 0 20 0")
    assert 'block "A" is inside more than 32 others' in str(refusal_of(tmp_path, loop))


@pytest.mark.parametrize(
    ("text", "message", "line"),
    [
        (text_of("0 LINE 8 0 10 0 20 0 11 3"), "group 21 is missing", 16),
        (
            text_of("0 LINE 8 0 10 zero 20 0 11 3 21 4"),
            'line 20: "zero" of group 10 is not a number',
            16,
        ),
        (text_of("0 LINE 8 0 10 nan 20 0 11 3 21 4"), "is not a number", 16),
        (text_of("0 CIRCLE 10 0 20 0 40 -1"), "negative radius", 16),
        (text_of("0 CIRCLE 10 0 20 0 40 1e12"), "beyond", 16),
        (text_of("0 LWPOLYLINE 90 3 10 0 20 0 10 1 20 1"), "2 vertices, where group 90 says 3", 16),
        (text_of("0 LWPOLYLINE 90 2 10 0 20 0 10 1"), "without y", 16),
        (text_of("0 SPLINE 71 3 40 0 40 1 10 0 20 0 10 1 20 1"), "2 control points, 2 knots", 16),
        (text_of("0 INSERT 2 None 10 0 20 0"), 'block "None" is not in the file', 16),
        (text_of("0 POLYLINE 70 0", "0 LINE 10 0"), "before the end (SEQEND)", 20),
        (text_of(), "no line or curve", 18),
        (text_of(LINE)[:-8], "the file ends without EOF", 29),
        (text_of(LINE).replace("20\n", "twenty\n", 1), '"twenty" is not a group code', 21),
        ("<svg/>\n", "the file ends without EOF", 1),
        ("", "the file ends without EOF", 1),
        ("AutoCAD Binary DXF\r\n", "binary DXF or DWG", 1),
        ("AC1032abc", "binary DXF or DWG", 1),
    ],
)
def test_refusals_name_the_place(tmp_path: Path, text: str, message: str, line: int) -> None:
    error = refusal_of(tmp_path, text)
    assert message in str(error)
    assert error.line == line


def test_without_ezdxf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(dxf_tags, "import_module", missing)
    with pytest.raises(InputError, match=r"pip install 'hodograph\[cad\]'"):
        dxf_commands(write(tmp_path, text_of(LINE)))


# ---- beside ezdxf, which reads the whole document


class _Writer:
    """Random documents; a pure function of the seed."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)

    def _n(self, low: float = -40.0, high: float = 40.0) -> float:
        return round(self._random.uniform(low, high), self._random.randint(0, 5))

    def _points(self, count: int) -> list[tuple[float, float, float]]:
        flat = self._random.random() < 0.5
        return [(self._n(), self._n(), 0.0 if flat else self._n()) for _ in range(count)]

    def _add(self, space: Any, blocks: list[str], *, is_plain: bool) -> None:
        """Add an entity; a plain one is not tilted, and a copy neither turned nor a grid.

        ezdxf is off where copies of copies shear arcs, scale tilted ones, or scale grids of copies;
        `test_copies_of_copies_are_exact` has those.
        """
        n, few = self._n, self._random.randint(4, 9)
        tilts = [(0, 0, 1), (0, 0, 1), (0, 0, -1), (1, 2, 3)]
        extrusion = (0, 0, 1) if is_plain else self._random.choice(tilts)
        given = {"extrusion": extrusion}
        kind = self._random.randrange(10 if blocks else 8)
        if kind == 0:
            space.add_line(*self._points(2))
        elif kind == 1:
            space.add_arc(self._points(1)[0], n(1, 20), n(0, 360), n(0, 360), dxfattribs=given)
        elif kind == 2:
            space.add_circle(self._points(1)[0], n(1, 20), dxfattribs=given)
        elif kind == 3:
            limits = self._random.choice([(0.0, math.tau), (n(0, 6), n(0, 6))])
            space.add_ellipse(self._points(1)[0], (n(1, 9), n(1, 9), 0), n(0.1, 1), *limits)
        elif kind == 4:
            points = [(n(), n(), self._random.choice([0, 0, n(-2, 2)])) for _ in range(few)]
            attributes = {**given, "elevation": n()}
            space.add_lwpolyline(
                points, format="xyb", close=self._random.random() < 0.5, dxfattribs=attributes
            )
        elif kind == 5:
            polyline = space.add_polyline2d([(n(), n()) for _ in range(few)], dxfattribs=given)
            polyline.vertices[0].dxf.bulge = n(-1, 1)
        elif kind == 6:
            space.add_polyline3d(self._points(few), close=self._random.random() < 0.5)
        elif kind == 7:
            weights = [n(0.5, 2) + 0.1 for _ in range(few)]
            self._random.choice(
                [space.add_open_spline, lambda p: space.add_rational_spline(p, weights)]
            )(self._points(few))
        else:
            scales = [(1, 1, 1), (2, 2, 2), (-1, 1, 1)]
            if extrusion == (0, 0, 1) and not is_plain:
                scales += [(n(0.5, 2), n(0.5, 2), 1), (1, -2, 1.5)]
            scale = self._random.choice(scales)
            attributes = dict(zip(("xscale", "yscale", "zscale"), scale, strict=True))
            if not is_plain:
                grid = {
                    "column_count": 2,
                    "row_count": 2,
                    "column_spacing": n(),
                    "row_spacing": n(),
                }
                attributes |= {
                    "rotation": n(0, 360),
                    **given,
                    **(grid if self._random.random() < 0.2 else {}),
                }
            space.add_blockref(
                self._random.choice(blocks), self._points(1)[0], dxfattribs=attributes
            )

    def document(self) -> Any:
        document, blocks = new(), []
        for k in range(self._random.randint(0, 3)):
            block = document.blocks.new(f"Block {k}", base_point=self._points(1)[0])
            for _ in range(2):
                self._add(block, blocks, is_plain=True)
            blocks.append(block.name)
        for _ in range(self._random.randint(1, 6)):
            self._add(document.modelspace(), blocks, is_plain=False)
        return document


def polylines_by_ezdxf(path: Path) -> list[Points]:
    """Each entity as points."""
    document = ezdxf.readfile(path)
    found = []
    for entity in recursive_decompose(document.modelspace()):
        curve = make_path(entity)
        for part in curve.sub_paths():
            points = np.array([point.xyz for point in part.flattening(0.01)])
            found += [points] if len(points) > 1 else []
    return found


@pytest.mark.parametrize("part", every(10, range(10)))
def test_random_documents_agree_with_ezdxf(tmp_path: Path, part: int) -> None:
    for seed in range(part * 10, part * 10 + 10):
        ours = contours_of(commands_of(tmp_path, _Writer(seed).document(), **IN_FILE_ORDER))
        theirs = polylines_by_ezdxf(tmp_path / "drawing.dxf")
        mine = [points for contour in ours for points in contour]
        assert distance_both_ways(mine, theirs, 0.5) < 0.4, seed
        assert sum(map(length_of, ours)) == pytest.approx(length_of(theirs), rel=2e-3), seed


@pytest.mark.parametrize("seed", range(5))
def test_copies_of_copies_are_exact(tmp_path: Path, seed: int) -> None:
    draw = random.Random(seed)

    def scaled() -> dict[str, float]:
        names = ("xscale", "yscale", "zscale", "rotation")
        return {
            name: draw.choice([-1, 1]) * draw.uniform(0.5, 2) * (90 if name == "rotation" else 1)
            for name in names
        }

    def matrix(insert: Any) -> tuple[Points, Points]:
        c, s = (
            math.cos(math.radians(insert.dxf.rotation)),
            math.sin(math.radians(insert.dxf.rotation)),
        )
        turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        linear = turned @ np.diag([insert.dxf.xscale, insert.dxf.yscale, insert.dxf.zscale])
        return linear, np.array(insert.dxf.insert) - linear @ np.array(
            insert.block().block.dxf.base_point
        )

    document = new()
    inner = document.blocks.new("inner", base_point=(1, 2, 3))
    inner.add_lwpolyline(
        [(0, 0, 0.3), (5, 1, -2), (8, 8, 0), (1, 9, 0)],
        format="xyb",
        dxfattribs={"extrusion": (1, 2, 3)},
    )
    inner.add_ellipse((30, 3), (8, 3), 0.4, 0.5, 3.0)
    outer = document.blocks.new("outer", base_point=(4, 5, 6))
    first = outer.add_blockref("inner", (7, 8, 9), dxfattribs=scaled())
    second = document.modelspace().add_blockref("outer", (1, 1, 1), dxfattribs=scaled())
    inserted = contours_of(commands_of(tmp_path, document, **IN_FILE_ORDER))
    plain = new()
    for entity in inner:
        plain.modelspace().add_foreign_entity(entity)
    drawn = contours_of(commands_of(tmp_path, plain, **IN_FILE_ORDER))
    (a, p), (b, q) = matrix(first), matrix(second)
    expected = [(part @ a.T + p) @ b.T + q for contour in drawn for part in contour]
    mine = [part for contour in inserted for part in contour]
    assert len(mine) == len(expected) == 4
    assert distance_both_ways(mine, expected, 0.02) < 0.02


def test_a_flood_of_lines_takes_little_memory(tmp_path: Path) -> None:
    contours_of(dxf_commands(write(tmp_path, text_of(LINE))))  # imports
    path = write(
        tmp_path,
        text_of(
            *(
                f"0 LINE 8 0 10 {k % 100} 20 {k // 100} 11 {k % 100}.5 21 {k // 100}"
                for k in range(1_000)
            )
        ),
    )
    tracemalloc.start()
    count = sum(1 for _ in read_dxf(path, DrawingOptions(feed_mm_s=1.0)))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert count > 1_000
    assert peak < 40 * path.stat().st_size + 700_000
