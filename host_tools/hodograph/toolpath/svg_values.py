# SPDX-License-Identifier: MIT
"""Values of SVG attributes: path data, transforms, lengths, lists of points, style declarations and style sheets. Used
by toolpath/svg. No I/O; path data is appended to the contours that are given.

Each function raises ShapeError for text that the grammar of SVG 1.1 does not allow. Renderers draw a broken path up to
its first error without a message; a part machined from such a path would be wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from ..errors import brief
from .contours import Affine, Contours, Point, ShapeError

PX_MM = 25.4 / 96.0
"""The user unit (px): 1/96 inch, as in CSS."""

_UNITS_PX = {
    "": 1.0,
    "px": 1.0,
    "in": 96.0,
    "cm": 96.0 / 2.54,
    "mm": 96.0 / 25.4,
    "q": 24.0 / 25.4,
    "pt": 96.0 / 72.0,
    "pc": 16.0,
}

_NUMBER = r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?"
_LENGTH = re.compile(rf"\s*({_NUMBER})\s*([a-zA-Z]*|%)\s*")
_SEPARATOR = re.compile(r"[\s,]*")
_NUMBERS = re.compile(_NUMBER)
_FUNCTION = re.compile(r"([a-zA-Z]+)\s*\(([^()]*)\)")


def length_px(text: str, whole_px: float) -> float:
    """A length in user units; `whole_px`: the length of 100 %."""
    found = _LENGTH.fullmatch(text)
    if found is None:
        raise ShapeError(f'"{brief(text)}" is not a length')
    number, unit = float(found[1]), found[2].lower()
    if unit == "%":
        return number / 100.0 * whole_px
    if unit not in _UNITS_PX:
        raise ShapeError(f'"{brief(text)}": unit "{unit}" is unknown')
    return number * _UNITS_PX[unit]


def is_relative(text: str) -> bool:
    """Whether a length is in percent, or not given."""
    return text.strip() in ("", "auto") or text.strip().endswith("%")


def numbers(text: str) -> list[float]:
    """A list of numbers, separated by blanks or commas."""
    found, at = [], _after_separator(text, 0)
    while at < len(text):
        match = _NUMBERS.match(text, at)
        if match is None:
            raise ShapeError(f'no number at character {at + 1} of "{brief(text)}"')
        found.append(float(match[0]))
        at = _after_separator(text, match.end())
    return found


def _after_separator(text: str, at: int) -> int:
    found = _SEPARATOR.match(text, at)
    return found.end() if found is not None else at


# ---- transforms


def transform(text: str) -> Affine:
    """The transformation of the attribute `transform`."""
    whole = Affine()
    if text.strip() == "none":
        return whole
    at = _after_separator(text, 0)
    while at < len(text):
        found = _FUNCTION.match(text, at)
        if found is None:
            raise ShapeError(f'transform "{brief(text[at:])}" is not understood')
        whole = whole.after(_function(found[1], found[2]))
        at = _after_separator(text, found.end())
    return whole


def _function(name: str, text: str) -> Affine:
    values = [_plain(each) for each in re.split(r"[\s,]+", text.strip()) if each]
    match name, len(values):
        case "matrix", 6:
            a, b, c, d, e, f = values
            return Affine.plane(a, b, c, d, e, f)
        case (("translate" | "translateX"), 1):
            return Affine.translation(values[0], 0.0)
        case "translateY", 1:
            return Affine.translation(0.0, values[0])
        case "translate", 2:
            return Affine.translation(values[0], values[1])
        case "scale", 1:
            return Affine.scaling(values[0], values[0], 1.0)
        case "scale", 2:
            return Affine.scaling(values[0], values[1], 1.0)
        case "rotate", 1:
            return Affine.rotation(values[0])
        case "rotate", 3:
            back = Affine.translation(-values[1], -values[2])
            return Affine.translation(values[1], values[2]).after(
                Affine.rotation(values[0]).after(back)
            )
        case "skewX", 1:
            return Affine.plane(1.0, 0.0, math.tan(math.radians(values[0])), 1.0, 0.0, 0.0)
        case "skewY", 1:
            return Affine.plane(1.0, math.tan(math.radians(values[0])), 0.0, 1.0, 0.0, 0.0)
    raise ShapeError(f'transform "{name}" with {len(values)} numbers is unknown')


def _plain(text: str) -> float:
    """A number, which may have a unit as CSS demands it: deg, px."""
    found = _LENGTH.fullmatch(text)
    if found is None or found[2] not in ("", "px", "deg"):
        raise ShapeError(f'"{brief(text)}" in a transform is not a number')
    return float(found[1])


def view_box(text: str) -> tuple[float, float, float, float]:
    """The four numbers of `viewBox`."""
    found = numbers(text)
    if len(found) != 4 or found[2] < 0 or found[3] < 0:
        raise ShapeError(f'viewBox "{brief(text)}" is not x, y, width and height')
    return found[0], found[1], found[2], found[3]


def fit_box(
    box: tuple[float, float, float, float], width: float, height: float, aspect: str
) -> Affine:
    """The map of a viewBox to a viewport of `width` and `height`; `aspect` is preserveAspectRatio."""
    left, top, box_width, box_height = box
    x, y = width / box_width, height / box_height
    words = aspect.split() or ["xMidYMid"]
    if words[0] == "defer":
        words = words[1:] or ["xMidYMid"]
    dx = dy = 0.0
    if words[0] != "none":
        found = re.fullmatch(r"x(Min|Mid|Max)Y(Min|Mid|Max)", words[0])
        if found is None or words[1:] not in ([], ["meet"], ["slice"]):
            raise ShapeError(f'preserveAspectRatio "{brief(aspect)}" is unknown')
        x = y = max(x, y) if words[1:] == ["slice"] else min(x, y)
        share = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}
        dx = (width - x * box_width) * share[found[1]]
        dy = (height - y * box_height) * share[found[2]]
    return Affine.translation(dx, dy).after(Affine.plane(x, 0.0, 0.0, y, -x * left, -y * top))


# ---- path data

_ARGUMENTS = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7, "z": 0}
_FLAG = re.compile(r"[01]")


def draw_path(contours: Contours, data: str, line: int) -> int:
    """Draws the attribute `d` of a path; returns the number of its pieces without length."""
    pen = _Pen(contours, line)
    for command, values, at in _commands(data):
        try:
            pen.draw(command, values)
        except ShapeError as error:
            raise ShapeError(f"path data, character {at + 1}: {error}") from None
    return pen.without_length


def _commands(data: str) -> Iterator[tuple[str, list[float], int]]:
    """Commands with their numbers and places. A command with several sets of numbers is repeated for each set."""
    at, command, is_first = _after_separator(data, 0), "", True
    if data[:at].strip():
        raise ShapeError("path data, character 1: a command is missing")
    while at < len(data):
        place = at
        if data[at].lower() in _ARGUMENTS:
            command = data[at]
            at += 1
        elif not command or command in "zZ":
            raise ShapeError(f'path data, character {at + 1}: "{brief(data[at])}" is not a command')
        if is_first and command not in "mM":
            raise ShapeError("path data, character 1: a path begins with M or m")
        is_first = False
        values, at = _arguments(data, at, command)
        yield command, values, place
        command = {"m": "l", "M": "L"}.get(command, command)
        at = _after_separator(data, at)


def _arguments(data: str, at: int, command: str) -> tuple[list[float], int]:
    count = _ARGUMENTS[command.lower()]
    values: list[float] = []
    while len(values) < count:
        at = _after_separator(data, at)
        is_flag = count == 7 and len(values) in (3, 4)
        found = (_FLAG if is_flag else _NUMBERS).match(data, at)
        if found is None:
            what = "a flag, 0 or 1," if is_flag else "a number"
            seen = f'"{brief(data[at])}"' if at < len(data) else "its end"
            raise ShapeError(
                f'path data, character {at + 1}: {what} of "{command}" is missing, there is {seen}'
            )
        values.append(float(found[0]))
        at = found.end()
    return values, at


class _Pen:
    """The state while path data is drawn, in user units."""

    def __init__(self, contours: Contours, line: int) -> None:
        self.without_length = 0
        self._contours = contours
        self._line = line
        self._here = (0.0, 0.0)
        self._start = (0.0, 0.0)
        self._control: tuple[str, tuple[float, float]] = ("", (0.0, 0.0))

    def draw(self, command: str, values: list[float]) -> None:
        kind = command.lower()
        x, y = self._here if command.islower() else (0.0, 0.0)
        control: tuple[str, tuple[float, float]] = ("", (0.0, 0.0))
        if kind == "z":
            self._contours.close(self._line)
            self._here = self._start
        elif kind == "m":
            self._here = self._start = (x + values[0], y + values[1])
            self._contours.move_to(_space(self._here), self._line)
        elif kind == "a":
            self._count(self._arc(values, (x + values[5], y + values[6])))
        elif kind in "lhv":
            self._count(self._straight(kind, values, x, y))
        else:
            points = [(x + p, y + q) for p, q in zip(values[0::2], values[1::2], strict=True)]
            if kind in "st":
                points.insert(0, self._mirrored("cs" if kind == "s" else "qt"))
            control = (kind, points[-2])
            inner = [_space(point) for point in points[:-1]]
            self._count(self._contours.bezier_to(inner, _space(points[-1]), self._line))
            self._here = points[-1]
        self._control = control

    def _count(self, is_drawn: bool) -> None:
        self.without_length += not is_drawn

    def _straight(self, kind: str, values: list[float], x: float, y: float) -> bool:
        if kind == "h":
            self._here = (x + values[0], self._here[1])
        elif kind == "v":
            self._here = (self._here[0], y + values[0])
        else:
            self._here = (x + values[0], y + values[1])
        return self._contours.line_to(_space(self._here), self._line)

    def _mirrored(self, kinds: str) -> tuple[float, float]:
        """The control point opposite to the last one, if that was of such a command; else the place itself."""
        kind, (x, y) = self._control
        if not kind or kind not in kinds:
            return self._here
        return 2 * self._here[0] - x, 2 * self._here[1] - y

    def _arc(self, values: list[float], end: tuple[float, float]) -> bool:
        """An elliptical arc, by section F.6 of SVG 1.1."""
        rx, ry, angle_deg, is_large, is_positive = abs(values[0]), abs(values[1]), *values[2:5]
        (x1, y1), (x2, y2) = self._here, end
        self._here = end
        if not (rx and ry):
            return self._contours.line_to(_space(end), self._line)
        if (x1, y1) == (x2, y2):
            return False
        turn = math.radians(angle_deg % 360.0)
        c, s = math.cos(turn), math.sin(turn)
        # Half the chord, and the centre, in the frame of the ellipse with both radii 1.
        dx, dy = (x1 - x2) / 2, (y1 - y2) / 2
        p, q = (c * dx + s * dy) / rx, (c * dy - s * dx) / ry
        size = math.hypot(p, q)
        if not 0.0 < size < math.inf:
            raise ShapeError("an arc with radii too large or too small")
        if size > 1.0:
            rx, ry, p, q, size = rx * size, ry * size, p / size, q / size, 1.0
        away = math.sqrt(max(0.0, 1.0 - size * size)) / size
        away = -away if is_large == is_positive else away
        u, v = away * q, -away * p
        centre = (c * rx * u - s * ry * v + (x1 + x2) / 2, s * rx * u + c * ry * v + (y1 + y2) / 2)
        start = math.atan2(q - v, p - u)
        sweep = (math.atan2(-q - v, -p - u) - start) % math.tau
        sweep -= 0.0 if is_positive else math.tau
        axes = ((c * rx, s * rx, 0.0), (-s * ry, c * ry, 0.0))
        return self._contours.ellipse_to(
            _space(centre), axes, start, sweep, _space(end), self._line
        )


def _space(point: tuple[float, float]) -> Point:
    return point[0], point[1], 0.0


# ---- styles

_IMPORTANT = re.compile(r"!\s*important\s*$", re.IGNORECASE)
_SELECTOR = re.compile(r"(\*|[\w-]+)?((?:[.#][\w-]+)*)")


def _without_comments(text: str) -> str:
    first, *others = text.split("/*")
    return first + "".join(other.partition("*/")[2] for other in others)


def declarations(text: str) -> tuple[dict[str, str], dict[str, str]]:
    """The properties of a style attribute, or of a rule of a style sheet: those without and those with `!important`."""
    found: tuple[dict[str, str], dict[str, str]] = ({}, {})
    for part in _without_comments(text).split(";"):
        name, _, value = part.partition(":")
        if value:
            plain = _IMPORTANT.sub("", value)
            found[plain != value][name.strip().lower()] = plain.strip()
    return found


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule of a style sheet: the name, classes and identities that an element needs; rules with a higher `rank` have
    precedence, and `important` properties over all others.
    """

    name: str
    classes: frozenset[str]
    ids: frozenset[str]
    rank: tuple[int, int, int]
    properties: Mapping[str, str]
    important: Mapping[str, str]

    def fits(self, name: str, classes: frozenset[str], identity: str) -> bool:
        """Whether the rule applies to an element."""
        return (
            self.name in ("", "*", name)
            and self.classes <= classes
            and self.ids <= (frozenset([identity]) if identity else frozenset())
        )


def style_rules(text: str) -> tuple[list[Rule], list[str]]:
    """The rules of a style sheet, and its selectors other than names, classes and ids, which are not supported."""
    text = _without_comments(text).replace("<!--", "").replace("-->", "")
    rules: list[Rule] = []
    others: list[str] = []
    *parts, rest = text.split("}")
    if rest.strip():
        others.append(brief(rest))
    for part in parts:
        selectors, brace, body = part.partition("{")
        if not brace or "{" in body:
            others.append(brief(part))
            continue
        for selector in selectors.split(","):
            found = _SELECTOR.fullmatch(selector.strip())
            if found is None or not selector.strip():
                others.append(brief(selector))
                continue
            marks = re.findall(r"([.#])([\w-]+)", found[2])
            classes = frozenset(each for mark, each in marks if mark == ".")
            ids = frozenset(each for mark, each in marks if mark == "#")
            rank = (len(ids), len(classes), int(found[1] not in (None, "*")))
            rules.append(Rule(found[1] or "", classes, ids, rank, *declarations(body)))
    return rules, others
