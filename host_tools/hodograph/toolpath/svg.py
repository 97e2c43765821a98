# SPDX-License-Identifier: MIT
"""Reads drawings in SVG 1.1 as toolpaths. docs/reference/drawings.md lists what is read. Used by toolpath/files. Reads
the file that it is given two or three times.

    for command in read_svg(Path("part.svg"), DrawingOptions(feed_mm_s=20.0)):
        ...

The outlines of paths and basic shapes are followed, whether they are stroked or filled. The page's lower left corner is
the origin; y points up. Expat reads the XML as a stream; `svg_values` reads the values of attributes. The libraries
svgpathtools 1.8 and svgelements 1.9 are not used: they continue after errors without a message, have no line numbers,
and take 32 and 84 times the memory of the path data. Tests compare with svgelements.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import BinaryIO
from xml.parsers import expat

from ..errors import InputError, ToolpathError, brief, one_line
from .contours import Affine, Point, ShapeError
from .drawing import Drawing, DrawingOptions, Group, normal_colour
from .moves import Command
from .svg_values import (
    PX_MM,
    Rule,
    declarations,
    draw_path,
    fit_box,
    is_relative,
    length_px,
    numbers,
    style_rules,
    transform,
    view_box,
)

_SVG = "http://www.w3.org/2000/svg"
_HREFS = ("href", "http://www.w3.org/1999/xlink href")
_INKSCAPE = "http://www.inkscape.org/namespaces/inkscape"

_QUIET_NAMES = """
animate animateColor animateMotion animateTransform clipPath color-profile cursor defs desc filter font font-face
linearGradient marker mask meshgradient metadata pattern radialGradient script set solidcolor style symbol title view
"""
_QUIET = frozenset(_QUIET_NAMES.split())
"""Elements that draw nothing by themselves."""

_SHAPES = frozenset(["path", "rect", "circle", "ellipse", "line", "polyline", "polygon"])
_GROUPS = frozenset(["svg", "g", "a", "switch", "use"])
_STYLED = (
    "display",
    "visibility",
    "stroke",
    "fill",
    "transform",
    "clip-path",
    "mask",
    "transform-origin",
)
_DEEPEST_USE = 32
"""Greatest depth of elements inside other elements."""


def read_svg(path: Path, options: DrawingOptions) -> Iterator[Command]:
    """The commands of a drawing in SVG: messages of what was left out, moves, and the end.

    Raises ToolpathError: broken XML, or an attribute without meaning, with its place; a drawing without contours.
    InputError: the file cannot be read; the drawing lacks something that an option names.
    The whole file is read before the first command.
    """
    try:
        with path.open("rb") as file:
            drawing = _Reader(str(path), options).read(file)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    yield from drawing.commands()


@dataclass(frozen=True, slots=True)
class _Element:
    """An element as it begins: its local name, attributes and place. A name of None stands for the end of one."""

    name: str | None
    attributes: Mapping[str, str]
    line: int
    column: int


@dataclass(frozen=True, slots=True)
class _State:
    """State that children inherit from an element. Lengths in px."""

    affine: Affine
    width: float
    height: float
    layer: str = ""
    depth: int = 0
    ids: tuple[str, ...] = ()
    stroke: str = "none"
    fill: str = "#000000"
    is_visible: bool = True


class _Reader:
    """The reading of one file: once for styles and for what `use` refers to, and once to draw."""

    def __init__(self, file: str, options: DrawingOptions) -> None:
        self._file = file
        self._drawing = Drawing(file, options)
        self._options = options
        self._rules: list[Rule] = []
        self._symbols: dict[str, list[_Element]] = {}
        self._states: list[_State] = []
        self._skipped = 0
        self._uses = 0

    def read(self, file: BinaryIO) -> Drawing:
        """All contours and notes."""
        survey = _Survey()
        self._parse(file, survey.start, survey.end, survey.text)
        self._rules, others = style_rules(survey.style)
        for selector in others:
            self._drawing.leave_out(f'style rule "{selector}"', survey.style_line)
        if survey.references:
            copies = _Copies(survey.references)
            self._parse(file, copies.start, copies.end, None)
            self._symbols = copies.found
        self._parse(file, self._start, self._end, None)
        return self._drawing

    # ---- XML

    def _parse(
        self,
        file: BinaryIO,
        start: Callable[[_Element], None],
        end: Callable[[], None],
        text: Callable[[str], None] | None,
    ) -> None:
        """Call `start` and `end` for each element of SVG; elements of other names have the name ""."""
        parser = expat.ParserCreate(namespace_separator=" ")
        parser.buffer_text = True

        def begin(name: str, attributes: dict[str, str]) -> None:
            uri, _, local = name.rpartition(" ")
            known = local if uri in ("", _SVG) else ""
            line, column = parser.CurrentLineNumber, parser.CurrentColumnNumber + 1
            start(_Element(known, attributes, line, column))

        parser.StartElementHandler = begin
        parser.EndElementHandler = lambda _: end()
        if text is not None:
            parser.CharacterDataHandler = text
        file.seek(0)
        try:
            parser.ParseFile(file)
        except expat.ExpatError as error:
            what = f"not well-formed XML ({expat.ErrorString(error.code)}): save the drawing as plain SVG"
            raise ToolpathError(self._file, error.lineno, error.offset + 1, what) from None
        except ToolpathError:
            raise
        except (LookupError, ValueError) as error:  # an encoding that there is no codec for
            raise ToolpathError(
                self._file, 1, 1, f"XML in an unknown encoding ({one_line(error)})"
            ) from None
        self._drawing.last_line = parser.CurrentLineNumber

    # ---- elements

    def _start(self, element: _Element) -> None:
        if self._skipped or not self._begin(element):
            self._skipped += 1

    def _end(self) -> None:
        if self._skipped:
            self._skipped -= 1
        else:
            self._states.pop()

    def _begin(self, element: _Element) -> bool:
        """Draw an element, or begin a group; False if nothing in it is drawn."""
        name = element.name or ""
        if not self._states and name != "svg":
            raise self._error(
                element, f'the root is "{brief(name)}", not "svg": this is no SVG drawing'
            )
        if name in _QUIET or not name:
            return False
        if name not in _SHAPES and name not in _GROUPS:
            self._drawing.leave_out(f'element "{brief(name)}"', element.line, element.column)
            return False
        try:
            return self._begin_drawn(name, element)
        except ShapeError as error:
            raise self._error(element, f'"{name}": {error}') from None

    def _error(self, element: _Element, text: str) -> ToolpathError:
        return self._drawing.error(element.line, text, element.column)

    def _begin_drawn(self, name: str, element: _Element) -> bool:
        style = self._style(name, element)
        if style.get("display") == "none" and name != "symbol":
            self._drawing.leave_out("hidden element", element.line, element.column)
            return False
        for what in ("clip-path", "mask"):
            if style.get(what, "none") != "none":
                self._drawing.leave_out(f'"{what}" of an element', element.line, element.column)
        if "transform-origin" in style:
            raise ShapeError("transform-origin is not understood: apply the transform")
        state = self._inherited(name, element, style)
        self._states.append(state)
        if name == "use":
            self._use(element, state)
        elif name in _SHAPES:
            self._shape(name, element, state)
        return True

    def _style(self, name: str, element: _Element) -> dict[str, str]:
        """The properties of an element that are used here: from attributes, then style sheets, then its own style, then
        those that are `!important` in the same order.
        """
        given = element.attributes
        style = {key: given[key].strip() for key in _STYLED if key in given}
        classes = frozenset(given.get("class", "").split())
        rules = [rule for rule in self._rules if rule.fits(name, classes, given.get("id", ""))]
        important: dict[str, str] = {}
        for rule in sorted(rules, key=lambda each: each.rank):
            style |= rule.properties
            important |= rule.important
        own, own_important = declarations(given.get("style", ""))
        return style | own | important | own_important

    def _inherited(self, name: str, element: _Element, style: Mapping[str, str]) -> _State:
        given = element.attributes
        state = self._states[-1] if self._states else self._page(element)
        if self._states:
            affine = state.affine.after(transform(style.get("transform", "")))
            state = replace(state, affine=affine, depth=state.depth + 1)
            if name in ("svg", "symbol"):
                state = self._viewport(state, given)
        layer = state.layer
        if given.get(f"{_INKSCAPE} groupmode") == "layer":
            layer = given.get(f"{_INKSCAPE} label", given.get("id", ""))
        elif name == "g" and state.depth == 1:
            layer = given.get("id", "")
        visibility = style.get("visibility", "inherit")
        return replace(
            state,
            layer=layer,
            ids=(*state.ids, given["id"]) if self._options.ids and "id" in given else state.ids,
            stroke=self._colour(style, "stroke", state.stroke),
            fill=self._colour(style, "fill", state.fill),
            is_visible=state.is_visible if visibility == "inherit" else visibility == "visible",
        )

    def _colour(self, style: Mapping[str, str], name: str, inherited: str) -> str:
        given = style.get(name, "inherit")
        return inherited if given in ("inherit", "currentColor") else normal_colour(given)

    def _page(self, element: _Element) -> _State:
        """The state of the root: a page whose lower left corner is the origin."""
        given = element.attributes
        box = view_box(given["viewBox"]) if "viewBox" in given else None
        if box is not None and not (box[2] and box[3]):
            raise ShapeError("viewBox has no width or height")
        sizes = []
        for name, whole in (("width", box[2] if box else 0.0), ("height", box[3] if box else 0.0)):
            text = given.get(name, "")
            sizes.append(whole if is_relative(text) else length_px(text, 0.0))
        width, height = sizes
        is_open = [is_relative(given.get(name, "")) for name in ("width", "height")]
        if all(is_open):
            self._drawing.assume_unit(element.line)
        elif box is not None and any(is_open):  # the page has the shape of its viewBox
            ratio = box[2] / box[3]
            width, height = (height * ratio, height) if is_open[0] else (width, width / ratio)
        if box is not None and (self._options.unit_mm is not None):
            width, height = box[2], box[3]
        if width < 0 or height < 0 or (box is not None and not (width and height)):
            raise ShapeError("the page has no width or height")
        inner = (
            fit_box(box, width, height, given.get("preserveAspectRatio", "")) if box else Affine()
        )
        inner = inner.after(transform(given.get("transform", "")))
        flip = Affine.plane(1.0, 0.0, 0.0, -1.0, 0.0, height)
        affine = self._drawing.placement(PX_MM).after(flip.after(inner))
        return _State(affine, *(box[2:] if box else (width, height)))

    def _viewport(self, state: _State, given: Mapping[str, str]) -> _State:
        """The state inside of a nested `svg`, or of a `symbol` that is used, with these attributes."""
        width = length_px(given.get("width", "100%").replace("auto", "100%"), state.width)
        height = length_px(given.get("height", "100%").replace("auto", "100%"), state.height)
        x = length_px(given.get("x", "0"), state.width)
        y = length_px(given.get("y", "0"), state.height)
        affine = state.affine.after(Affine.translation(x, y))
        if "viewBox" not in given:
            return replace(state, affine=affine, width=width, height=height)
        box = view_box(given["viewBox"])
        if not (box[2] and box[3] and width > 0 and height > 0):
            raise ShapeError("a viewport without width or height")
        fitted = fit_box(box, width, height, given.get("preserveAspectRatio", ""))
        return replace(state, affine=affine.after(fitted), width=box[2], height=box[3])

    # ---- copies

    def _use(self, element: _Element, state: _State) -> None:
        given = element.attributes
        target = next((given[name] for name in _HREFS if name in given), "").strip()
        copied = self._symbols.get(target[1:]) if target.startswith("#") else None
        if copied is None:
            self._drawing.leave_out(
                f'use of "{brief(target)}", which is not in the file', element.line, element.column
            )
            return
        if self._uses >= _DEEPEST_USE:
            raise ShapeError(
                f'"{brief(target)}" uses itself, or is used through more than {_DEEPEST_USE} others'
            )
        x, y = (
            length_px(given.get(name, "0"), whole)
            for name, whole in (("x", state.width), ("y", state.height))
        )
        self._states[-1] = replace(state, affine=state.affine.after(Affine.translation(x, y)))
        self._uses += 1
        root = copied[0]
        if root.name in ("symbol", "svg"):
            sizes = {name: given[name] for name in ("width", "height") if name in given}
            root = replace(root, attributes={**root.attributes, **sizes})
            self._skipped += not self._begin_drawn(root.name or "", root)
            copied = copied[1:]
        for each in copied:
            self._drawing.count_copies(0, element.line, element.column)
            if each.name is None:
                self._end()
            else:
                self._start(each)
        self._uses -= 1

    # ---- shapes

    def _shape(self, name: str, element: _Element, state: _State) -> None:
        if not state.is_visible:
            self._drawing.leave_out("hidden element", element.line, element.column)
            return
        if not self._drawing.takes(state.layer, state.ids):
            return
        contours = self._drawing.contours
        contours.affine = state.affine
        colour = state.fill if state.stroke in ("none", "transparent") else state.stroke
        self._drawing.select(Group(state.layer, "" if colour == "none" else colour))
        steps = contours.step_count
        if name == "path":
            draw_path(contours, element.attributes.get("d", ""), element.line)
        elif name in ("polyline", "polygon"):
            self._polygon(element, is_closed=name == "polygon")
        else:
            self._basic_shape(name, element, state)
        added = contours.step_count - steps
        if not added:
            self._drawing.leave_out(f'"{name}" without length', element.line, element.column)
        if self._uses:
            self._drawing.count_copies(added, element.line, element.column)

    def _polygon(self, element: _Element, *, is_closed: bool) -> None:
        contours, line = self._drawing.contours, element.line
        values = numbers(element.attributes.get("points", ""))
        if len(values) % 2:
            raise ShapeError("points have an odd count of numbers")
        points = [(x, y, 0.0) for x, y in zip(values[0::2], values[1::2], strict=True)]
        for number, point in enumerate(points):
            if number:
                contours.line_to(point, line)
            else:
                contours.move_to(point, line)
        if is_closed and points:
            contours.close(line)

    def _basic_shape(self, name: str, element: _Element, state: _State) -> None:
        diagonal = math.hypot(state.width, state.height) / math.sqrt(2.0)

        def length(key: str, default: str = "0") -> float:
            whole = {"x": state.width, "y": state.height, "r": diagonal}[_DIRECTION[key]]
            return length_px(element.attributes.get(key, default), whole)

        contours, line = self._drawing.contours, element.line
        if name == "line":
            contours.move_to((length("x1"), length("y1"), 0.0), line)
            contours.line_to((length("x2"), length("y2"), 0.0), line)
        elif name == "rect":
            given = element.attributes
            rx, ry = (
                None if given.get(key, "auto").strip() == "auto" else length(key)
                for key in ("rx", "ry")
            )
            size = (length("width"), length("height"))
            self._rectangle((length("x"), length("y")), size, (rx, ry), line)
        else:
            rx, ry = (
                (length("r"), length("r")) if name == "circle" else (length("rx"), length("ry"))
            )
            if rx < 0 or ry < 0:
                raise ShapeError("a negative radius")
            if rx and ry:
                centre = (length("cx"), length("cy"), 0.0)
                contours.move_to((centre[0] + rx, centre[1], 0.0), line)
                contours.ellipse_to(
                    centre, ((rx, 0.0, 0.0), (0.0, ry, 0.0)), 0.0, math.tau, None, line
                )

    def _rectangle(
        self,
        corner: tuple[float, float],
        size: tuple[float, float],
        radii: tuple[float | None, float | None],
        line: int,
    ) -> None:
        (x, y), (width, height) = corner, size
        if width < 0 or height < 0 or min(radius or 0.0 for radius in radii) < 0:
            raise ShapeError("a negative width, height or radius")
        if not (width and height):
            return
        rx = radii[0] if radii[0] is not None else radii[1] or 0.0
        ry = radii[1] if radii[1] is not None else rx
        rx, ry = min(rx, width / 2), min(ry, height / 2)
        contours = self._drawing.contours
        right, bottom = x + width, y + height
        corners: list[tuple[Point, Point, Point]] = [  # start of the rounding, its end, its centre
            ((right - rx, y, 0.0), (right, y + ry, 0.0), (right - rx, y + ry, 0.0)),
            ((right, bottom - ry, 0.0), (right - rx, bottom, 0.0), (right - rx, bottom - ry, 0.0)),
            ((x + rx, bottom, 0.0), (x, bottom - ry, 0.0), (x + rx, bottom - ry, 0.0)),
            ((x, y + ry, 0.0), (x + rx, y, 0.0), (x + rx, y + ry, 0.0)),
        ]
        contours.move_to((x + rx, y, 0.0), line)
        for k, (start, end, centre) in enumerate(corners):
            contours.line_to(start, line)
            if rx and ry:
                axes = ((rx, 0.0, 0.0), (0.0, ry, 0.0))
                contours.ellipse_to(centre, axes, (k - 1) * math.pi / 2, math.pi / 2, end, line)
        contours.close(line)


_DIRECTION = {
    **dict.fromkeys(("x", "x1", "x2", "cx", "rx", "width"), "x"),
    **dict.fromkeys(("y", "y1", "y2", "cy", "ry", "height"), "y"),
    "r": "r",
}


class _Survey:
    """The first reading of a file: style sheets, and the identities that `use` refers to."""

    def __init__(self) -> None:
        self.references: set[str] = set()
        self.style_line = 0
        self._style: list[str] = []
        self._names: list[str] = []

    @property
    def style(self) -> str:
        """All style sheets."""
        return "\n".join(self._style)

    def start(self, element: _Element) -> None:
        self._names.append(element.name or "")
        if element.name == "use":
            for name in _HREFS:
                self.references.add(element.attributes.get(name, "").strip().removeprefix("#"))
        elif element.name == "style":
            self.style_line = self.style_line or element.line

    def end(self) -> None:
        self._names.pop()

    def text(self, data: str) -> None:
        if self._names[-1] == "style":
            self._style.append(data)


class _Copies:
    """The elements that `use` refers to, as they are in the file."""

    def __init__(self, wanted: set[str]) -> None:
        self.found: dict[str, list[_Element]] = {}
        self._wanted = wanted
        self._open: list[list[list[_Element]]] = []

    def start(self, element: _Element) -> None:
        above = self._open[-1] if self._open else []
        identity = element.attributes.get("id", "")
        if identity and identity in self._wanted and identity not in self.found:
            self.found[identity] = []
            above = [*above, self.found[identity]]
        for events in above:
            events.append(element)
        self._open.append(above)

    def end(self) -> None:
        for events in self._open.pop():
            events.append(_Element(None, {}, 0, 0))
