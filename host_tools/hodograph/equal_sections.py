# SPDX-License-Identifier: MIT
"""Equal sections of a job: what is fitted, planned and proved for one holds for all that are equal but for their place.

Holes of one depth are drilled by equal sections, and so are moves between places of a grid. A section is equal to
another one if its points, seen from the first one, are the other's when rounded to 2^-40 mm, with the same feeds,
tolerance and angles. Its curve is the other's, moved; its program has the other's integers, moved. No rule of a
program but the range of its points and the travel of the axes depends on the place, and these two are looked at.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from .feed import FeedPlan
from .fixed_point import to_q40
from .native.program import NativeProgram
from .pipeline import Judged
from .program.check import leaves_range
from .program.image import Program, ProgramLimits, encode
from .toolpath.fit.fitting import FittedPath
from .toolpath.fit.reference import Reference
from .toolpath.fit.sections import Section

Int = NDArray[np.int64]

_MOST_KNOWN = 256
"""Sections that are kept to be compared with: the last ones that were found or used."""

_MOST_CHORDS = 2000
"""Longer sections are seldom equal, and would take much memory."""

_REACH_MM = 8192.0
"""Twice the range of coordinates in a program: with points farther from the first one there is no program, and their
places on the grid would leave 64 bits at 2^23 mm."""


@dataclass(eq=False)
class SharedPrograms:
    """What equal sections share: the plan, and the program by its events. Filled by the first that asks."""

    plan: FeedPlan | None = None
    judged: dict[bytes, Judged] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class KnownSection:
    """A section that was fitted, with the axes that turn along."""

    fitted: FittedPath
    shared: SharedPrograms


class EqualSections:
    """Sections that were fitted, to be found by those that are equal."""

    def __init__(self) -> None:
        self._known: OrderedDict[bytes, KnownSection] = OrderedDict()

    def find(self, section: Section) -> KnownSection | None:
        """An equal section with its curve moved to the place of this one."""
        key = _key(section)
        if key is None or key not in self._known:
            return None
        self._known.move_to_end(key)
        known = self._known[key]
        return replace(known, fitted=_moved_path(known.fitted, section.reference))

    def add(self, section: Section, fitted: FittedPath) -> SharedPrograms:
        """Keeps a section that has been fitted, with the axes that turn along; returns what the ones equal to it will
        share with it.
        """
        shared, key = SharedPrograms(), _key(section)
        if key is not None:
            self._known[key] = KnownSection(fitted, shared)
            if len(self._known) > _MOST_KNOWN:
                self._known.popitem(last=False)
        return shared


def _key(section: Section) -> bytes | None:
    """The same bytes for sections that are equal; None: the section is too long, or too large, to be compared."""
    own = section.reference
    if own.count > _MOST_CHORDS:
        return None
    from_first_mm = own.point - own.point[0]
    if not (np.abs(from_first_mm) < _REACH_MM).all():
        return None
    turn = b"" if own.turn_deg is None else own.turn_deg.tobytes()
    kind = repr((section.tolerance_mm, section.tied, section.stands_at, own.count, bool(turn)))
    moved = to_q40(from_first_mm)
    return b"".join(
        (kind.encode(), moved.tobytes(), own.feed_mm_s.tobytes(), own.sag_mm.tobytes(), turn)
    )


def _moved_path(fitted: FittedPath, reference: Reference) -> FittedPath:
    curve = fitted.curve
    shift = reference.point[0] - fitted.reference.point[0]
    return replace(fitted, reference=reference, curve=replace(curve, origin=curve.origin + shift))


def moved_program(judged: Judged, start_q40: Int, limits: ProgramLimits) -> Judged | None:
    """A program that the controller accepts, moved so that its first point is `start_q40`; None: it would leave the
    travel there, or the range of the format.
    """
    program = _moved_to(judged.compilation.program, start_q40)
    if judged.fault is not None or leaves_range(program, limits):
        return None
    native = NativeProgram(encode(program))
    native.accept_as(judged.native)
    return replace(judged, compilation=replace(judged.compilation, program=program), native=native)


def _moved_to(program: Program, start_q40: Int) -> Program:
    shift = start_q40 - program.point_q40[:, 0]
    return replace(program, point_q40=program.point_q40 + shift[:, None])
