# SPDX-License-Identifier: MIT
"""Reads drawings in DXF (ASCII, R12 and newer) as toolpaths. docs/reference/drawings.md lists what is read. Used by
toolpath/files. Reads the file that it is given.

    for command in read_dxf(Path("part.dxf"), DrawingOptions(feed_mm_s=20.0)):
        ...

The file is read as a stream of tags (group code and value, a line each). Only contours are kept, also of blocks. A
document of ezdxf would take 30 times the file's memory, has no line numbers, and replaces missing values by zeros.
ezdxf is used for coordinate systems of entities, colours, units and encodings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO, NamedTuple

from ..errors import InputError, ToolpathError
from .contours import Affine, Contours, Point, ShapeError
from .drawing import Drawing, DrawingOptions, Group
from .dxf_curves import CURVES, entity_system
from .dxf_tags import Entity, Tag, Tags, ezdxf_module, number_of
from .moves import Command

_BINARY = b"AutoCAD Binary DXF"
_DEEPEST_INSERT = 32
"""Greatest depth of blocks inside blocks."""

_SURVEY_FOOT_MM = 1.2e6 / 3937.0
"""US survey foot, 1200/3937 m."""
_INCH_UNITS_MM = {
    1: 25.4,
    2: 304.8,
    3: 1_609_344.0,
    8: 25.4e-6,
    9: 25.4e-3,
    10: 914.4,
    21: _SURVEY_FOOT_MM,
    22: _SURVEY_FOOT_MM / 12.0,
    23: 3.0 * _SURVEY_FOOT_MM,
    24: 5280.0 * _SURVEY_FOOT_MM,
}
"""Units by inches, feet, yards and miles, by their number in $INSUNITS. ezdxf has not all of them, and rounds them."""

_BY_BLOCK, _BY_LAYER = 0, 256
_WHITE = 7
"""Colour number of entities without a colour."""


def read_dxf(path: Path, options: DrawingOptions) -> Iterator[Command]:
    """The commands of a drawing in DXF: messages of what was left out, moves, and the end.

    Raises ToolpathError, with the line: a damaged file, or a value without meaning; a drawing without contours. Raises
    InputError: the file cannot be read; its unit is not known; the drawing lacks something that an option names; ezdxf
    is not installed. The whole file is read before the first command.
    """
    try:
        with path.open("rb") as file:
            drawing = _Reader(str(path), options).read(file)
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from None
    yield from drawing.commands()


class _Style(NamedTuple):
    """Layer and colour as an entity gives them; `rgb` is a true colour or empty."""

    layer: str
    colour: int = _BY_LAYER
    rgb: str = ""

    def inside(self, insert: _Style | None) -> _Style:
        """The style of an entity of a block that is inserted with another style."""
        if insert is None:
            return self
        layer = insert.layer if self.layer == "0" else self.layer
        if self.rgb or self.colour != _BY_BLOCK:
            return _Style(layer, self.colour, self.rgb)
        return _Style(layer, insert.colour, insert.rgb)


@dataclass(frozen=True, slots=True)
class _Layer:
    """A layer of the table. Its name as it is spelled there, colour, whether it is on, and whether it hides blocks that
    are inserted on it.
    """

    name: str
    colour: int
    rgb: str
    is_hidden: bool
    is_frozen: bool


@dataclass(frozen=True, slots=True)
class _Insert:
    """A copy of a block, which may follow in the file: the maps from the block to the drawing, without its base point,
    one for each place of a grid.
    """

    block: str
    maps: tuple[Affine, ...]
    style: _Style
    handle: str
    line: int


@dataclass(slots=True)
class _Block:
    """The content of a block: contours, whose groups are numbers of `styles`, copies of other blocks, and what is
    omitted.
    """

    base: Point
    contours: Contours = field(default_factory=Contours)
    styles: list[tuple[_Style, str]] = field(default_factory=list)
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
        tags = Tags(file, self._file)
        sections: dict[bytes, Callable[[Tags], None]] = {
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

    def _skip(self, tags: Tags) -> None:
        while not tags.is_next(b"ENDSEC"):
            tags.take()

    def _header(self, tags: Tags) -> None:
        name = b""
        while not tags.is_next(b"ENDSEC"):
            tag = tags.take()
            if tag.code == 9:
                name = tag.value
            elif name == b"$INSUNITS" and tag.code == 70:
                self._units = int(self._number(tags, tag))
            elif name == b"$DWGCODEPAGE" and tag.code == 3 and self._encoding != "utf-8":
                self._encoding = ezdxf_module("tools.codepage").toencoding(self._text(tag))
            elif name == b"$ACADVER" and tag.code == 1 and tag.value >= b"AC1021":
                self._encoding = "utf-8"

    def _number(self, tags: Tags, tag: Tag) -> float:
        try:
            return number_of(tag)
        except ShapeError as error:
            raise tags.error(tag.line, str(error)) from None

    # ---- records

    def _record(self, tags: Tags) -> Entity:
        """The next record, without extended data, groups of applications, and embedded objects."""
        start = tags.take()
        if start.code != 0:
            raise tags.error(
                start.line, f"group {start.code} where a record begins: the file is damaged"
            )
        entity = Entity(self._text(start), start.line)
        is_in_group = is_embedded = False
        while tags.next.code != 0:
            tag = tags.take()
            if tag.code == 102:
                is_in_group = tag.value.startswith(b"{")
            is_embedded = is_embedded or tag.code == 101
            if tag.code < 1000 and tag.code != 102 and not (is_in_group or is_embedded):
                entity.tags.append(tag)
        return entity

    def _entity(self, tags: Tags) -> Entity:
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

    def _tables(self, tags: Tags) -> None:
        while not tags.is_next(b"ENDSEC"):
            record = self._record(tags)
            if record.kind == "LAYER":
                with _Place(self._drawing, record):
                    self._add_layer(record)

    def _add_layer(self, record: Entity) -> None:
        name = "".join(self._text(tag) for tag in record.all(2)[:1])
        colour = record.integer(62, _WHITE)
        is_frozen = bool(record.integer(70, 0) & 1)
        is_hidden = colour < 0 or is_frozen or name.lower() == "defpoints"
        is_hidden = is_hidden or record.integer(290, 1) == 0
        self._layers[name.lower()] = _Layer(name, abs(colour), _rgb(record), is_hidden, is_frozen)

    def _style(self, entity: Entity) -> _Style:
        layer = "".join(self._text(tag) for tag in entity.all(8)[:1]) or "0"
        known = self._layers.get(layer.lower())
        return _Style(known.name if known else layer, entity.integer(62, _BY_LAYER), _rgb(entity))

    def _group(self, style: _Style) -> Group:
        layer = self._layers.get(style.layer.lower())
        colour, rgb = style.colour, style.rgb
        if not rgb and colour == _BY_LAYER and layer is not None:
            colour, rgb = layer.colour, layer.rgb
        if rgb:
            return Group(style.layer, rgb)
        number = colour if 1 <= colour <= 255 else _WHITE
        return Group(
            style.layer, "#" + bytes(ezdxf_module("colors").aci2rgb(number)).hex(), str(number)
        )

    # ---- blocks

    def _read_blocks(self, tags: Tags) -> None:
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
        for block in self._blocks.values():
            for insert in block.inserts:
                try:
                    self._require_block(insert)
                except ShapeError as error:
                    raise tags.error(insert.line, f"INSERT: {error}") from None

    def _require_block(self, insert: _Insert) -> None:
        """Raises ShapeError: the file does not have the block that is inserted."""
        if insert.block.lower() not in self._blocks:
            raise ShapeError(f'block "{insert.block}" is not in the file')

    def _add_to_block(self, block: _Block, entity: Entity) -> None:
        with _Place(self._drawing, entity):
            if entity.integer(60, 0):
                block.left_out.append(("hidden entity", entity.line))
            elif entity.kind == "INSERT":
                block.inserts.append(self._insert(entity, block.left_out))
            else:
                block.contours.group = len(block.styles)
                block.styles.append((self._style(entity), _handle(entity)))
                self._draw(entity, block.contours, Affine(), block.left_out)

    def _insert(self, entity: Entity, left_out: list[tuple[str, int]]) -> _Insert:
        left_out += [(part.kind, part.line) for part in entity.parts]
        name = "".join(self._text(tag) for tag in entity.all(2)[:1])
        scale = [entity.number(code, 1.0) or 1.0 for code in (41, 42, 43)]  # 0: not set, as in CAD
        inner = Affine.scaling(scale[0], scale[1], scale[2])
        outer = entity_system(entity).after(Affine.translation(*entity.point(10)))
        outer = outer.after(Affine.rotation(entity.number(50, 0.0)))
        columns, rows = max(1, entity.integer(70, 1)), max(1, entity.integer(71, 1))
        self._drawing.count_copies(columns * rows, entity.line)
        dx, dy = entity.number(44, 0.0), entity.number(45, 0.0)
        maps = tuple(
            outer.after(Affine.translation(column * dx, row * dy)).after(inner)
            for row in range(rows)
            for column in range(columns)
        )
        return _Insert(name, maps, self._style(entity), _handle(entity), entity.line)

    # ---- entities

    def _entities(self, tags: Tags) -> None:
        self._placement = self._drawing.placement(self._unit_mm())
        while not tags.is_next(b"ENDSEC"):
            self._add(self._entity(tags))

    def _unit_mm(self) -> float:
        """The unit of the file in mm. Raises InputError: not known."""
        if self._options.unit_mm is not None:
            return self._options.unit_mm
        enums, units = ezdxf_module("enums"), ezdxf_module("units")
        if not 1 <= self._units <= max(enums.InsertUnits):
            text = "the drawing does not say its unit ($INSUNITS): give it, as by --unit mm"
            raise InputError(f"{self._file}: {text}")
        if self._units in _INCH_UNITS_MM:
            return _INCH_UNITS_MM[self._units]
        return float(
            units.conversion_factor(enums.InsertUnits(self._units), enums.InsertUnits.Millimeters)
        )

    def _add(self, entity: Entity) -> None:
        drawing = self._drawing
        with _Place(drawing, entity):
            left_out: list[tuple[str, int]] = []
            if entity.integer(60, 0):
                drawing.leave_out("hidden entity", entity.line)
            elif entity.integer(67, 0):
                drawing.leave_out("entity of a layout (paper space)", entity.line)
            elif entity.kind == "INSERT":
                insert = self._insert(entity, left_out)
                self._require_block(insert)
                self._copy(insert, self._placement, None, (), 1)
            elif entity.kind not in CURVES:
                left_out.append((entity.kind, entity.line))
            elif self._begin(self._style(entity), (_handle(entity),), entity.line):
                self._draw(entity, drawing.contours, self._placement, left_out)
            for what, line in left_out:
                drawing.leave_out(what, line)

    def _begin(self, style: _Style, handles: Iterable[str], line: int) -> bool:
        """Whether an entity with this style is drawn; its group is selected then."""
        if not self._drawing.takes(style.layer, handles):
            return False
        layer = self._layers.get(style.layer.lower())
        if layer is not None and layer.is_hidden:
            self._drawing.leave_out(f'entity of the hidden layer "{layer.name}"', line)
            return False
        self._drawing.select(self._group(style))
        return True

    def _copy(
        self,
        insert: _Insert,
        outer: Affine,
        above: _Style | None,
        handles: tuple[str, ...],
        depth: int,
    ) -> None:
        """Draw a copy of a block, and of those in it."""
        drawing, block = self._drawing, self._blocks[insert.block.lower()]
        if depth > _DEEPEST_INSERT:
            raise ShapeError(f'block "{insert.block}" is inside more than {_DEEPEST_INSERT} others')
        style = insert.style.inside(above)
        layer = self._layers.get(style.layer.lower())
        if layer is not None and layer.is_frozen:
            drawing.leave_out(f'block on the frozen layer "{layer.name}"', insert.line)
            return
        handles = (*handles, insert.handle)
        x, y, z = (-each for each in block.base)
        for each in insert.maps:
            affine = outer.after(each).after(Affine.translation(x, y, z))
            for what, line in block.left_out:
                drawing.leave_out(what, line)
            for index in range(len(block.contours)):
                inner, handle = block.styles[block.contours.group_of(index)]
                drawing.count_copies(block.contours.length_of(index), insert.line)
                if self._begin(
                    inner.inside(style), (*handles, handle), block.contours.line_of(index)
                ):
                    _draw_copy(drawing.contours, affine, block.contours, index)
            for nested in block.inserts:
                drawing.count_copies(1, insert.line)
                self._copy(nested, affine, style, handles, depth + 1)

    def _draw(
        self, entity: Entity, contours: Contours, outer: Affine, left_out: list[tuple[str, int]]
    ) -> None:
        """Draw an entity, or note that it is left out."""
        draw = CURVES.get(entity.kind)
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
    """Adds to errors of shapes the line of the tag that they name, or of the entity."""

    def __init__(self, drawing: Drawing, entity: Entity) -> None:
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


def _handle(entity: Entity) -> str:
    found = entity.all(5)
    return found[0].value.decode("ascii", "replace") if found else ""


def _rgb(entity: Entity) -> str:
    if not entity.all(420):
        return ""
    return f"#{entity.integer(420, 0) & 0xFFFFFF:06x}"
