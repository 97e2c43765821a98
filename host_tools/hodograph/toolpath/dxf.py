# SPDX-License-Identifier: MIT
"""Reads drawings in DXF (ASCII, R12 and newer) as toolpaths. docs/reference/drawings.md lists what is read.

    for command in read_dxf(Path("part.dxf"), DrawingOptions(feed_mm_s=20.0)):
        ...

The file is read as a stream of tags (group code and value, a line each). Only contours are kept, of blocks too: a
document of ezdxf takes 30 times the file's memory, knows no lines, and replaces what is missing by zeros. ezdxf is what
knows coordinate systems of entities, colours, units and encodings.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import make_interp_spline

from ..errors import InputError, ToolpathError, brief
from .contours import Affine, Contours, Point, ShapeError, Spline
from .drawing import Drawing, DrawingOptions, Group
from .moves import Command

_BINARY = b"AutoCAD Binary DXF"
_DEEPEST_INSERT = 32
_MOST_DEGREE = 15
_MOST = 1e15
"""Greatest number in a file; its squares and products are far from the greatest of a float."""

_BY_BLOCK, _BY_LAYER = 0, 256
_WHITE = 7


def read_dxf(path: Path, options: DrawingOptions) -> Iterator[Command]:
    """The commands of a drawing in DXF: messages of what was left out, moves, and the end.

    Raises ToolpathError: a damaged file, or a value without meaning, with its line; a drawing without contours.
    InputError: the file cannot be read; its unit is not known; an option names what the drawing does not have; ezdxf
    is not installed.
    The whole file is read before the first command.
    """
    try:
        with path.open("rb") as file:
            drawing = _Reader(str(path), options).read(file)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    yield from drawing.commands()


def _ezdxf(name: str) -> Any:
    """A module of ezdxf, which is an extra of the package."""
    try:
        return import_module(f"ezdxf.{name}")
    except ImportError:
        raise InputError(
            "DXF needs ezdxf, which is not installed: pip install 'hodograph[cad]'"
        ) from None


# ---- tags


class Tag(NamedTuple):
    """A group code, its value, and the line that the value is in."""

    code: int
    value: bytes
    line: int


@dataclass(slots=True)
class _Entity:
    """A record: its kind, the line of its name, and its tags without extended data. `parts` are its vertices."""

    kind: str
    line: int
    tags: list[Tag] = field(default_factory=list)
    parts: list[_Entity] = field(default_factory=list)

    def all(self, code: int) -> list[Tag]:
        """All tags of a code."""
        return [tag for tag in self.tags if tag.code == code]

    def number(self, code: int, default: float | None = None) -> float:
        """The number of a tag. Raises ShapeError: there is none, and no default."""
        for tag in self.tags:
            if tag.code == code:
                return number_of(tag)
        if default is None:
            raise ShapeError(f"group {code} is missing")
        return default

    def integer(self, code: int, default: int) -> int:
        """The whole number of a tag."""
        return int(self.number(code, default))

    def point(self, code: int, default: Point | None = None) -> Point:
        """The point whose x has this code; z may be missing."""
        if default is not None and not self.all(code):
            return default
        return self.number(code), self.number(code + 10), self.number(code + 20, 0.0)

    def points(self, code: int) -> list[Point]:
        """All points whose x has this code, in their order; each x is followed by its y."""
        found: list[list[float]] = []
        for tag in self.tags:
            axis, rest = divmod(tag.code - code, 10)
            if rest or not 0 <= axis <= 2:
                continue
            if axis == 0:
                found.append([])
            if not found or len(found[-1]) != axis:
                raise ShapeError(
                    f"line {tag.line}: group {tag.code} without the coordinates before it"
                )
            found[-1].append(number_of(tag))
        if any(len(each) < 2 for each in found):
            raise ShapeError(f"a point of group {code} without y")
        return [(each[0], each[1], each[2] if len(each) > 2 else 0.0) for each in found]


def number_of(tag: Tag) -> float:
    """The value of a tag as a number of sensible size. Raises ShapeError, with its line."""
    try:
        value = float(tag.value)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or b"_" in tag.value:
        shown = brief(tag.value.decode("ascii", "replace"))
        raise ShapeError(f'line {tag.line}: "{shown}" of group {tag.code} is not a number')
    if abs(value) > _MOST:
        raise ShapeError(f"line {tag.line}: {value:g} of group {tag.code} is out of range")
    return value


class _Tags:
    """The tags of a file one after the other, with a look at the next one. Comments (999) are skipped."""

    def __init__(self, file: BinaryIO, name: str) -> None:
        self._file = file
        self._name = name
        self._line = 0
        self.next = self._read()

    def error(self, line: int, text: str) -> ToolpathError:
        return ToolpathError(self._name, max(1, line), 1, text)

    def take(self) -> Tag:
        """The next tag."""
        tag = self.next
        if tag.code == 0 and tag.value == b"EOF":
            raise self.error(tag.line, "EOF within a section: the file is damaged")
        self.next = self._read()
        return tag

    def _read(self) -> Tag:
        while True:
            raw = self._file.readline()
            value = self._file.readline()
            self._line += 2
            if not raw or not value:
                raise self.error(self._line - 1, "the file ends without EOF: it is not complete")
            try:
                code = int(raw)
            except ValueError:
                shown = brief(raw.decode("ascii", "replace"))
                text = f'"{shown}" is not a group code: this is no ASCII DXF, or damaged'
                raise self.error(self._line - 1, text) from None
            if code != 999:
                return Tag(code, value.strip(), self._line)

    def is_next(self, *values: bytes) -> bool:
        """Whether a record of one of these names begins."""
        return self.next.code == 0 and self.next.value in values


# ---- what entities look like


class _Look(NamedTuple):
    """Layer and colour as an entity gives them; `rgb` is a true colour or empty."""

    layer: str
    colour: int = _BY_LAYER
    rgb: str = ""

    def inside(self, insert: _Look | None) -> _Look:
        """The look of an entity of a block that is inserted with another look."""
        if insert is None:
            return self
        layer = insert.layer if self.layer == "0" else self.layer
        if self.rgb or self.colour != _BY_BLOCK:
            return _Look(layer, self.colour, self.rgb)
        return _Look(layer, insert.colour, insert.rgb)


@dataclass(frozen=True, slots=True)
class _Layer:
    """A layer of the table. Its name as it is spelled there, colour, and whether it is on."""

    name: str
    colour: int
    rgb: str
    is_hidden: bool


@dataclass(frozen=True, slots=True)
class _Insert:
    """A copy of a block: the maps from the block to where it stands, one for each place of a grid."""

    block: str
    maps: tuple[Affine, ...]
    look: _Look
    handle: str
    line: int


@dataclass(slots=True)
class _Block:
    """What a block holds: contours, whose groups are numbers of `looks`, copies of others, and what is left out."""

    base: Point
    contours: Contours = field(default_factory=Contours)
    looks: list[tuple[_Look, str]] = field(default_factory=list)
    inserts: list[_Insert] = field(default_factory=list)
    left_out: list[tuple[str, int]] = field(default_factory=list)


class _Reader:
    """The reading of one file."""

    def __init__(self, file: str, options: DrawingOptions) -> None:
        self._file = file
        self._drawing = Drawing(file, options)
        self._options = options
        self._encoding = "cp1252"
        self._units = 0
        self._layers: dict[str, _Layer] = {}
        self._blocks: dict[str, _Block] = {}
        self._placement = Affine()

    def read(self, file: BinaryIO) -> Drawing:
        """All contours and notes."""
        head = file.read(len(_BINARY))
        if head == _BINARY or head[:4] == b"AC10":
            raise ToolpathError(
                self._file, 1, 1, "this is binary DXF or DWG: save the drawing as ASCII DXF"
            )
        file.seek(0)
        if file.read(3) != b"\xef\xbb\xbf":
            file.seek(0)
        tags = _Tags(file, self._file)
        sections: dict[bytes, Callable[[_Tags], None]] = {
            b"HEADER": self._header,
            b"TABLES": self._tables,
            b"BLOCKS": self._read_blocks,
            b"ENTITIES": self._entities,
        }
        while not tags.is_next(b"EOF"):
            start = tags.take()
            if start.code != 0 or start.value != b"SECTION":
                raise tags.error(
                    start.line, f'"{self._text(start)}" where a section begins: the file is damaged'
                )
            name = tags.take()
            if name.code != 2:
                raise tags.error(name.line, "a section without a name: the file is damaged")
            sections.get(name.value, self._skip)(tags)
            tags.take()
        self._drawing.last_line = tags.next.line
        return self._drawing

    def _text(self, tag: Tag) -> str:
        """The value of a tag as printable text."""
        text = tag.value.decode(self._encoding, "replace")
        return "".join(each if each.isprintable() else "?" for each in text[:255])

    def _skip(self, tags: _Tags) -> None:
        while not tags.is_next(b"ENDSEC"):
            tags.take()

    def _header(self, tags: _Tags) -> None:
        name = b""
        while not tags.is_next(b"ENDSEC"):
            tag = tags.take()
            if tag.code == 9:
                name = tag.value
            elif name == b"$INSUNITS" and tag.code == 70:
                self._units = int(self._number(tags, tag))
            elif name == b"$DWGCODEPAGE" and tag.code == 3 and self._encoding != "utf-8":
                self._encoding = _ezdxf("tools.codepage").toencoding(self._text(tag))
            elif name == b"$ACADVER" and tag.code == 1 and tag.value >= b"AC1021":
                self._encoding = "utf-8"

    def _number(self, tags: _Tags, tag: Tag) -> float:
        try:
            return number_of(tag)
        except ShapeError as error:
            raise tags.error(tag.line, str(error)) from None

    # ---- records

    def _record(self, tags: _Tags) -> _Entity:
        """The next record, without extended data, groups of applications, and embedded objects."""
        start = tags.take()
        if start.code != 0:
            raise tags.error(
                start.line, f"group {start.code} where a record begins: the file is damaged"
            )
        entity = _Entity(self._text(start), start.line)
        is_in_group = is_embedded = False
        while tags.next.code != 0:
            tag = tags.take()
            if tag.code == 102:
                is_in_group = tag.value.startswith(b"{")
            is_embedded = is_embedded or tag.code == 101
            if tag.code < 1000 and tag.code != 102 and not (is_in_group or is_embedded):
                entity.tags.append(tag)
        return entity

    def _entity(self, tags: _Tags) -> _Entity:
        """The next entity; a POLYLINE with its vertices, an INSERT with its attributes."""
        entity = self._record(tags)
        has_parts = entity.kind == "POLYLINE" or (
            entity.kind == "INSERT" and tags.is_next(b"ATTRIB", b"SEQEND")
        )
        while has_parts:
            if not tags.is_next(b"VERTEX", b"ATTRIB", b"SEQEND"):
                raise tags.error(
                    tags.next.line,
                    f'"{self._text(tags.next)}" before the end (SEQEND) of {entity.kind}',
                )
            part = self._record(tags)
            if part.kind == "SEQEND":
                break
            entity.parts.append(part)
        return entity

    def _tables(self, tags: _Tags) -> None:
        while not tags.is_next(b"ENDSEC"):
            record = self._record(tags)
            if record.kind == "LAYER":
                with _Place(self._drawing, record):
                    self._add_layer(record)

    def _add_layer(self, record: _Entity) -> None:
        name = "".join(self._text(tag) for tag in record.all(2)[:1])
        colour = record.integer(62, _WHITE)
        is_hidden = colour < 0 or bool(record.integer(70, 0) & 1) or name.lower() == "defpoints"
        is_hidden = is_hidden or record.integer(290, 1) == 0
        self._layers[name.lower()] = _Layer(name, abs(colour), _rgb(record), is_hidden)

    def _look(self, entity: _Entity) -> _Look:
        layer = "".join(self._text(tag) for tag in entity.all(8)[:1]) or "0"
        known = self._layers.get(layer.lower())
        return _Look(known.name if known else layer, entity.integer(62, _BY_LAYER), _rgb(entity))

    def _group(self, look: _Look) -> Group:
        layer = self._layers.get(look.layer.lower())
        colour, rgb = look.colour, look.rgb
        if not rgb and colour == _BY_LAYER and layer is not None:
            colour, rgb = layer.colour, layer.rgb
        if rgb:
            return Group(look.layer, rgb)
        number = colour if 1 <= colour <= 255 else _WHITE
        return Group(look.layer, "#" + bytes(_ezdxf("colors").aci2rgb(number)).hex(), str(number))

    # ---- blocks

    def _read_blocks(self, tags: _Tags) -> None:
        while not tags.is_next(b"ENDSEC"):
            record = self._record(tags)
            if record.kind != "BLOCK":
                raise tags.error(
                    record.line, f'"{record.kind}" where a block begins: the file is damaged'
                )
            with _Place(self._drawing, record):
                block = _Block(record.point(10, (0.0, 0.0, 0.0)))
                name = "".join(self._text(tag) for tag in record.all(2)[:1]).lower()
                if record.integer(70, 0) & 4:
                    block.left_out.append(("external reference", record.line))
            while not tags.is_next(b"ENDBLK"):
                if tags.is_next(b"ENDSEC"):
                    raise tags.error(
                        tags.next.line, f'block "{name}" does not end: the file is damaged'
                    )
                self._add_to_block(block, self._entity(tags))
            self._record(tags)
            self._blocks[name] = block

    def _add_to_block(self, block: _Block, entity: _Entity) -> None:
        with _Place(self._drawing, entity):
            if entity.integer(60, 0):
                block.left_out.append(("hidden entity", entity.line))
            elif entity.kind == "INSERT":
                block.inserts.append(self._insert(entity, block.left_out))
            else:
                block.contours.group = len(block.looks)
                block.looks.append((self._look(entity), _handle(entity)))
                self._draw(entity, block.contours, Affine(), block.left_out)

    def _insert(self, entity: _Entity, left_out: list[tuple[str, int]]) -> _Insert:
        left_out += [(part.kind, part.line) for part in entity.parts]
        name = "".join(self._text(tag) for tag in entity.all(2)[:1])
        block = self._blocks.get(name.lower())
        if block is None:
            raise ShapeError(f'block "{name}" is not in the file before this place')
        x, y, z = (-each for each in block.base)
        scale = [entity.number(code, 1.0) for code in (41, 42, 43)]
        inner = Affine.scaling(scale[0], scale[1], scale[2]).after(Affine.translation(x, y, z))
        outer = _ocs(entity).after(Affine.translation(*entity.point(10)))
        outer = outer.after(Affine.rotation(entity.number(50, 0.0)))
        columns, rows = max(1, entity.integer(70, 1)), max(1, entity.integer(71, 1))
        self._drawing.count_copies(columns * rows, entity.line)
        dx, dy = entity.number(44, 0.0), entity.number(45, 0.0)
        maps = tuple(
            outer.after(Affine.translation(column * dx, row * dy)).after(inner)
            for row in range(rows)
            for column in range(columns)
        )
        return _Insert(name.lower(), maps, self._look(entity), _handle(entity), entity.line)

    # ---- entities

    def _entities(self, tags: _Tags) -> None:
        self._placement = self._drawing.placement(self._unit_mm())
        while not tags.is_next(b"ENDSEC"):
            self._add(self._entity(tags))

    def _unit_mm(self) -> float:
        """The unit of the file in mm. Raises InputError: not known."""
        if self._options.unit_mm is not None:
            return self._options.unit_mm
        enums, units = _ezdxf("enums"), _ezdxf("units")
        if not 1 <= self._units <= max(enums.InsertUnits):
            text = "the drawing does not say its unit ($INSUNITS): give it, as by --unit mm"
            raise InputError(f"{self._file}: {text}")
        return float(
            units.conversion_factor(enums.InsertUnits(self._units), enums.InsertUnits.Millimeters)
        )

    def _add(self, entity: _Entity) -> None:
        drawing = self._drawing
        with _Place(drawing, entity):
            left_out: list[tuple[str, int]] = []
            if entity.integer(60, 0):
                drawing.leave_out("hidden entity", entity.line)
            elif entity.integer(67, 0):
                drawing.leave_out("entity of a layout (paper space)", entity.line)
            elif entity.kind == "INSERT":
                self._copy(self._insert(entity, left_out), self._placement, None, (), 1)
            elif entity.kind not in _CURVES:
                left_out.append((entity.kind, entity.line))
            elif self._begin(self._look(entity), (_handle(entity),), entity.line):
                self._draw(entity, drawing.contours, self._placement, left_out)
            for what, line in left_out:
                drawing.leave_out(what, line)

    def _begin(self, look: _Look, handles: Iterable[str], line: int) -> bool:
        """Whether an entity with this look is drawn; its group is selected then."""
        if not self._drawing.takes(look.layer, handles):
            return False
        layer = self._layers.get(look.layer.lower())
        if layer is not None and layer.is_hidden:
            self._drawing.leave_out(f'entity of the hidden layer "{layer.name}"', line)
            return False
        self._drawing.select(self._group(look))
        return True

    def _copy(
        self,
        insert: _Insert,
        outer: Affine,
        above: _Look | None,
        handles: tuple[str, ...],
        depth: int,
    ) -> None:
        """Draw a copy of a block, and of those in it."""
        drawing, block = self._drawing, self._blocks[insert.block]
        if depth > _DEEPEST_INSERT:
            raise ShapeError(f'block "{insert.block}" is inside more than {_DEEPEST_INSERT} others')
        look = insert.look.inside(above)
        handles = (*handles, insert.handle)
        for each in insert.maps:
            affine = outer.after(each)
            for what, line in block.left_out:
                drawing.leave_out(what, line)
            for index in range(len(block.contours)):
                inner, handle = block.looks[block.contours.group_of(index)]
                drawing.count_copies(block.contours.length_of(index), insert.line)
                if self._begin(
                    inner.inside(look), (*handles, handle), block.contours.line_of(index)
                ):
                    _draw_copy(drawing.contours, affine, block.contours, index)
            for nested in block.inserts:
                drawing.count_copies(1, insert.line)
                self._copy(nested, affine, look, handles, depth + 1)

    def _draw(
        self, entity: _Entity, contours: Contours, outer: Affine, left_out: list[tuple[str, int]]
    ) -> None:
        """Draw an entity, or note why not."""
        draw = _CURVES.get(entity.kind)
        before = contours.step_count
        if draw is None:
            left_out.append((entity.kind, entity.line))
            return
        if entity.kind == "POLYLINE" and entity.integer(70, 0) & (16 | 64):
            left_out.append(("POLYLINE that is a mesh", entity.line))
            return
        contours.affine = outer
        draw(entity, contours)
        if contours.step_count == before:
            left_out.append((f"{entity.kind} without length", entity.line))


class _Place:
    """Gives errors of shapes the line of the entity, or of the tag that they name."""

    def __init__(self, drawing: Drawing, entity: _Entity) -> None:
        self._drawing = drawing
        self._entity = entity

    def __enter__(self) -> None:
        pass

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        if isinstance(error, ShapeError):
            raise self._drawing.error(self._entity.line, f"{self._entity.kind}: {error}") from None


def _draw_copy(contours: Contours, affine: Affine, source: Contours, index: int) -> None:
    contours.affine = affine
    for number, step in enumerate(source.steps(index)):
        if number == 0:
            contours.move_to(step.start, step.line)
        contours.draw(step)


def _handle(entity: _Entity) -> str:
    found = entity.all(5)
    return found[0].value.decode("ascii", "replace") if found else ""


def _rgb(entity: _Entity) -> str:
    if not entity.all(420):
        return ""
    return f"#{entity.integer(420, 0) & 0xFFFFFF:06x}"


def _ocs(entity: _Entity) -> Affine:
    """The map from the coordinate system of an entity, which its extrusion direction gives, to the world's."""
    extrusion = entity.point(210, (0.0, 0.0, 1.0))
    if extrusion == (0.0, 0.0, 1.0):
        return Affine()
    size = math.hypot(*extrusion)
    if not 1e-12 < size < 1e12:
        raise ShapeError("extrusion direction without length")
    ocs = _ezdxf("math").OCS(tuple(each / size for each in extrusion))
    x, y, z = zip(ocs.ux.xyz, ocs.uy.xyz, ocs.uz.xyz, strict=True)
    return Affine(x, y, z)


# ---- curves: each draws one entity


def _line(entity: _Entity, contours: Contours) -> None:
    contours.move_to(entity.point(10), entity.line)
    contours.line_to(entity.point(11), entity.line)


def _circle(entity: _Entity, contours: Contours) -> None:
    contours.affine = contours.affine.after(_ocs(entity))
    (x, y, z), radius = entity.point(10), entity.number(40)
    if radius < 0:
        raise ShapeError("a negative radius")
    start, sweep_deg = 0.0, 360.0
    if entity.kind == "ARC":
        start = entity.number(50)
        sweep_deg = (entity.number(51) - start) % 360.0 or 360.0
    first, last = (
        Affine.rotation(angle % 360.0).direction((radius, 0.0, 0.0))
        for angle in (start, start + sweep_deg)
    )
    contours.move_to((x + first[0], y + first[1], z), entity.line)
    end = None if sweep_deg == 360.0 else (x + last[0], y + last[1], z)
    axes = ((radius, 0.0, 0.0), (0.0, radius, 0.0))
    contours.ellipse_to(
        (x, y, z), axes, math.radians(start % 360.0), math.radians(sweep_deg), end, entity.line
    )


def _ellipse(entity: _Entity, contours: Contours) -> None:
    centre, major, ratio = entity.point(10), entity.point(11), entity.number(40)
    normal = np.array(_ocs(entity).direction((0.0, 0.0, 1.0)))
    minor = np.cross(normal, major) * ratio
    start = entity.number(41, 0.0) % math.tau
    sweep = entity.number(42, math.tau) - entity.number(41, 0.0)
    is_whole = abs(abs(sweep) - math.tau) < 1e-9 or not sweep
    sweep = math.tau if is_whole else sweep % math.tau
    axes = (major, (float(minor[0]), float(minor[1]), float(minor[2])))

    def at(t: float) -> Point:
        x, y, z = (
            c + math.cos(t) * u + math.sin(t) * v for c, u, v in zip(centre, *axes, strict=True)
        )
        return x, y, z

    contours.move_to(at(start), entity.line)
    contours.ellipse_to(
        centre, axes, start, sweep, None if is_whole else at(start + sweep), entity.line
    )


def _lwpolyline(entity: _Entity, contours: Contours) -> None:
    contours.affine = contours.affine.after(_ocs(entity))
    height = entity.number(38, 0.0)
    vertices: list[list[float]] = []
    bulges: list[float] = []
    for tag in entity.tags:
        if tag.code == 10:
            vertices.append([number_of(tag)])
            bulges.append(0.0)
        elif tag.code in (20, 42):
            if not vertices or (tag.code == 20 and len(vertices[-1]) != 1):
                raise ShapeError(f"line {tag.line}: group {tag.code} before its x (group 10)")
            if tag.code == 20:
                vertices[-1].append(number_of(tag))
            else:
                bulges[-1] = number_of(tag)
    if any(len(vertex) != 2 for vertex in vertices):
        raise ShapeError("a vertex without y (group 20)")
    if len(vertices) != entity.integer(90, len(vertices)):
        raise ShapeError(f"{len(vertices)} vertices, where group 90 says {entity.integer(90, 0)}")
    points = [(x, y, height) for x, y in vertices]
    _polyline_through(
        contours, points, bulges, entity.line, is_closed=bool(entity.integer(70, 0) & 1)
    )


def _polyline(entity: _Entity, contours: Contours) -> None:
    flags = entity.integer(70, 0)
    vertices = [
        part for part in entity.parts if part.kind == "VERTEX" and not part.integer(70, 0) & 16
    ]
    points = [part.point(10) for part in vertices]
    bulges = [part.number(42, 0.0) for part in vertices]
    if flags & 8:
        bulges = [0.0] * len(points)
    else:
        contours.affine = contours.affine.after(_ocs(entity))
        height = entity.number(30, 0.0)
        points = [(x, y, height) for x, y, _ in points]
    _polyline_through(contours, points, bulges, entity.line, is_closed=bool(flags & 1))


def _polyline_through(
    contours: Contours, points: list[Point], bulges: list[float], line: int, *, is_closed: bool
) -> None:
    """Lines, and arcs where the bulge (tangent of a quarter of the angle) is not 0."""
    if not points:
        return
    contours.move_to(points[0], line)
    ends = [*points[1:], points[0]] if is_closed else points[1:]
    for start, end, bulge in zip(points, ends, bulges, strict=False):
        if bulge == 0.0 or start == end:
            contours.line_to(end, line)
            continue
        dx, dy, away = end[0] - start[0], end[1] - start[1], (1.0 / bulge - bulge) / 4.0
        x = (start[0] + end[0]) / 2.0 - away * dy
        y = (start[1] + end[1]) / 2.0 + away * dx
        u = (start[0] - x, start[1] - y, 0.0)
        axes = (u, (-u[1], u[0], 0.0))
        contours.ellipse_to((x, y, start[2]), axes, 0.0, 4.0 * math.atan(bulge), end, line)


def _spline(entity: _Entity, contours: Contours) -> None:
    if entity.kind == "HELIX":
        entity = _without_subclass(entity, b"AcDbHelix")
    points = entity.points(10)
    spline = _through_fit_points(entity) if not points else _given_spline(entity, np.array(points))
    if spline is None:
        return
    x, y, z = spline.points[0].tolist()
    contours.move_to((x, y, z), entity.line)
    contours.spline_to(spline, entity.line)


def _without_subclass(entity: _Entity, name: bytes) -> _Entity:
    at = next(
        (k for k, tag in enumerate(entity.tags) if tag.code == 100 and tag.value == name), None
    )
    return _Entity(entity.kind, entity.line, entity.tags[:at])


def _given_spline(entity: _Entity, points: NDArray[np.float64]) -> Spline:
    degree = entity.integer(71, 3)
    knots = np.array([number_of(tag) for tag in entity.all(40)])
    weights = (
        np.array([number_of(tag) for tag in entity.all(41)])
        if entity.all(41)
        else np.ones(len(points))
    )
    for code, what, count in ((72, "knots", len(knots)), (73, "control points", len(points))):
        if entity.integer(code, count) != count:
            raise ShapeError(f"{count} {what}, where group {code} says {entity.integer(code, 0)}")
    if not 1 <= degree <= _MOST_DEGREE:
        raise ShapeError(f"degree {degree} is not 1 to {_MOST_DEGREE}")
    if (
        len(points) <= degree
        or len(knots) != len(points) + degree + 1
        or len(weights) != len(points)
    ):
        raise ShapeError(
            f"{len(points)} control points, {len(knots)} knots, {len(weights)} weights of degree {degree}"
        )
    if (np.diff(knots) < 0).any() or not (weights > 0).all():
        raise ShapeError("knots that fall, or weights that are not positive")
    begin, end = knots[degree], knots[len(points)]
    if not end - begin > 0 or not (weights < 1e12 * weights.min()).all():
        raise ShapeError("no range of knots, or weights too far apart")
    return clamped(Spline(points, weights, (knots - begin) / (end - begin), degree))


def clamped(spline: Spline) -> Spline:
    """The part of a NURBS from knot 0 to knot 1, with these knots repeated so that it meets its end points.

    Raises ShapeError: a knot inside is repeated more often than the degree says, where the curve may break.
    """
    found = _clamped_at_start(_clamped_at_start(spline).reversed()).reversed()
    inner = found.knots[(found.knots > 0.0) & (found.knots < 1.0)]
    if len(inner) and np.unique(inner, return_counts=True)[1].max() > found.degree:
        raise ShapeError("a knot that is repeated too often: the curve has a gap")
    return found


def _clamped_at_start(spline: Spline) -> Spline:
    degree, knots = spline.degree, spline.knots
    values = np.column_stack([spline.points * spline.weights[:, None], spline.weights])
    for _ in range(degree - int((knots == 0.0).sum())):
        values, knots = _with_knot(values, knots, degree, 0.0)
    last = int(np.searchsorted(knots, 0.0, side="right")) - 1
    values = values[last - degree :]
    knots = np.concatenate([np.zeros(degree + 1), knots[last + 1 :]])
    return Spline(values[:, :3] / values[:, 3:], values[:, 3], knots, degree)


def _with_knot(
    values: NDArray[np.float64], knots: NDArray[np.float64], degree: int, knot: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The same curve with another knot (Boehm's algorithm)."""
    span = int(np.searchsorted(knots, knot, side="right")) - 1
    old = np.arange(span - degree + 1, span + 1)
    share = (knot - knots[old]) / (knots[old + degree] - knots[old])
    between = (1.0 - share)[:, None] * values[old - 1] + share[:, None] * values[old]
    new = np.concatenate([values[: span - degree + 1], between, values[span:]])
    return new, np.insert(knots, span + 1, knot)


def _through_fit_points(entity: _Entity) -> Spline | None:
    """The spline that CAD systems draw through fit points; None if they have no length.

    It is cubic, its knots are chord lengths, and its ends have the tangents given, else no curvature.
    """
    points = np.array(entity.points(11)).reshape(-1, 3)
    if len(points):
        points = points[np.append(True, (points[1:] != points[:-1]).any(axis=1))]
    if len(points) < 2:
        return None
    lengths = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    whole = float(lengths[-1])
    if not (whole < 1e12 and (np.diff(lengths) > 1e-12 * whole).all()):
        raise ShapeError("fit points too near to each other, or too far apart")
    ends: Any = tuple(_end_condition(entity, code, whole) for code in (12, 13))
    found = make_interp_spline(lengths / whole, points, k=3, bc_type=ends)
    return Spline(found.c, np.ones(len(found.c)), found.t, 3)


def _end_condition(entity: _Entity, code: int, length: float) -> list[tuple[int, list[float]]]:
    """The derivative (number and value) at an end of a spline through fit points, whose tangent has this code."""
    tangent = entity.point(code, (0.0, 0.0, 0.0))
    size = math.hypot(*tangent)
    if not 1e-12 < size < 1e12:
        return [(2, [0.0, 0.0, 0.0])]
    return [(1, [each / size * length for each in tangent])]


_CURVES: dict[str, Callable[[_Entity, Contours], None]] = {
    "LINE": _line,
    "CIRCLE": _circle,
    "ARC": _circle,
    "ELLIPSE": _ellipse,
    "LWPOLYLINE": _lwpolyline,
    "POLYLINE": _polyline,
    "SPLINE": _spline,
    "HELIX": _spline,
}
