# SPDX-License-Identifier: MIT
"""The path of a streamed job for the live page, from its chunks (parts of the job): captured SDO block downloads to
object 0x2060 sub 1. Used by monitor/. No I/O. Changes its own objects only; one thread.

In a block download (CiA 301) the client announces the transfer and sends segments of 7 bytes in blocks. The server
reports for each block how many segments came in order. At the end the client gives the number of unused bytes.
"""

from __future__ import annotations

import struct
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ..bus.capture.frames import Frames
from ..bus.sdo.objects import STREAM
from ..errors import InputError
from ..fixed_point import MM_PER_Q40
from ..program.image import Program
from ..spline import PHSpline
from ..spline.spatial.curve import SpatialPHSpline
from .chunk import Chunk, parse
from .geometry import Curve

REQUEST, RESPONSE = 0x600, 0x580
_CHUNK = struct.pack("<HB", STREAM, 1)
_BEGIN, _BLOCK_DONE, _END, _ENDED, _ABORT = 0xC0, 0xA2, 0xC1, 0xA1, 0x80
_POINTS, _MOST_POINTS = 60, 3000
_LONGEST = 1 << 20
"""A captured transfer of this number of bytes or more is ignored: it is no chunk."""

Floats = NDArray[np.float64]


@dataclass
class ChunkCapture:
    """Chunks that the controller has accepted, from the frames of its SDO channel."""

    node: int
    _block: dict[int, bytes] = field(default_factory=dict)
    _data: bytearray = field(default_factory=bytearray)
    _last: int = 0
    _open: bool = False
    _ending: bool = False

    def feed(self, frames: Frames) -> list[Chunk]:
        """The chunks that these frames complete."""
        own = frames[np.isin(frames["id"], (REQUEST + self.node, RESPONSE + self.node))]
        found: list[Chunk] = []
        for identifier, data in zip(own["id"].tolist(), own["data"], strict=True):
            one = data.tobytes()
            if identifier == REQUEST + self.node:
                self._request(one)
            elif self._response(one):
                with suppress(InputError):  # frames were lost: the path has a gap there
                    found.append(parse(bytes(self._data)))
                self._open = False
        return found

    def _request(self, one: bytes) -> None:
        if not self._open or (self._ending and one[0] & 0xE3 != _END):
            self._open = one[0] & 0xE1 == _BEGIN and one[1:4] == _CHUNK
            self._block, self._data = {}, bytearray()
            self._last, self._ending = 0, False
        elif self._ending:
            del self._data[len(self._data) - (one[0] >> 2 & 7) :]
        elif one[0] == _ABORT:
            self._open = False
        else:
            number = one[0] & 0x7F
            self._block[number] = one[1:]
            if one[0] & 0x80:
                self._last = number

    def _response(self, one: bytes) -> bool:
        """Whether the controller accepts a chunk with this response."""
        if not self._open:
            return False
        if one[0] == _ABORT:
            self._open = False
        elif one[0] == _BLOCK_DONE and not self._ending:
            for number in range(1, one[1] + 1):
                self._data += self._block.get(number, b"")
            self._ending = bool(self._last) and one[1] == self._last
            self._block, self._last = {}, 0
            self._open = len(self._data) < _LONGEST
        return self._ending and one[0] == _ENDED


def curve_of(program: Program) -> Curve:
    """The path of a program in mm: in the plane, or in space."""
    origin: Floats = np.ldexp(program.point_q40.astype(np.float64), -40)
    a: Floats = np.ldexp(program.a_q44.astype(np.float64), -44)
    if len(a) == 2:
        return PHSpline(origin[0] + 1j * origin[1], a[0] + 1j * a[1], False)
    return SpatialPHSpline(origin[:3].T, np.moveaxis(a, 0, 1), False)


def _drawn(program: Program) -> tuple[Floats, Floats]:
    """Arc lengths (n,) of a program and the points there, (n, 2) or (n, 3) in mm."""
    arc_mm = np.linspace(0.0, program.length_mm, _POINTS)
    return arc_mm, curve_of(program).axes_point(arc_mm)


class JobPoints:
    """Points of the path of a job, from the chunks received so far. The longer the job, the fewer points each part
    has.
    """

    def __init__(self) -> None:
        self._job = 0
        self._stride = 1
        self._arcs: Floats = np.zeros(0)
        self._points: Floats = np.zeros((0, 0))

    def add(self, chunk: Chunk) -> None:
        """The points of another chunk, in place of the tail before it; the first of another job begins anew. Chunks
        that move rotary axes alone are not drawn.
        """
        header, program = chunk.header, chunk.program
        if program.first_axis:
            return
        arc_mm, points = _drawn(program)
        arcs = arc_mm + header.job_start_q40 * MM_PER_Q40
        if header.job != self._job or header.first:
            self._job, self._stride = header.job, 1
            self._arcs, self._points = np.zeros(0), np.zeros((0, points.shape[1]))
        kept = self._arcs < arcs[0]
        self._arcs = np.concatenate((self._arcs[kept], arcs[:: self._stride]))
        self._points = np.concatenate((self._points[kept], points[:: self._stride]))
        if self._arcs.size > _MOST_POINTS:
            self._stride *= 2
            self._arcs, self._points = self._arcs[::2], self._points[::2]

    @property
    def job(self) -> int:
        """Number of the job; 0: none has come."""
        return self._job

    @property
    def points_mm(self) -> Floats:
        """(n, 2) or (n, 3), along the path."""
        return self._points
