# SPDX-License-Identifier: MIT
"""Equal sections of a job: sections that differ only in their place share curve, plan and proof.

Holes of one depth are equal sections, and so are equal moves on a grid. Two sections are equal if their points, as
distances from the first point, are the same after rounding to 2^-40 mm, and so are feeds, tolerance and angles. The
curve and the integers of the program are then those of the other section, shifted. Only two rules of a program depend
on its place: the range of its points and the travel of the axes. Both are checked again. Used by job.py and
section_pipeline.py. No I/O.
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
"""Number of sections that are kept for comparison: those found or used last."""

_MOST_CHORDS = 2000
"""Longer sections are not compared: they are seldom equal and would take much memory."""

_REACH_MM = 8192.0
"""Twice the range of coordinates in a program. No program has points farther from its first one."""


@dataclass(eq=False)
class SharedPrograms:
    """What equal sections share: the plan, and the programs by the bytes of their events. The first section fills
    it.
    """

    plan: FeedPlan | None = None
    judged: dict[bytes, Judged] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class KnownSection:
    """A fitted section, including its rotary axes, and what it shares."""

    fitted: FittedPath
    shared: SharedPrograms


class EqualSections:
    """The fitted sections of a job, by what equal sections have in common."""

    def __init__(self) -> None:
        self._known: OrderedDict[bytes, KnownSection] = OrderedDict()

    def find(self, section: Section) -> KnownSection | None:
        """An equal section, its curve moved to the place of this one; None: there is none."""
        key = _key(section)
        if key is None or key not in self._known:
            return None
        self._known.move_to_end(key)
        known = self._known[key]
        return replace(known, fitted=_moved_path(known.fitted, section.reference))

    def add(self, section: Section, fitted: FittedPath) -> SharedPrograms:
        """Keeps a fitted section, including its rotary axes. Returns what equal sections will share with it."""
        shared, key = SharedPrograms(), _key(section)
        if key is not None:
            self._known[key] = KnownSection(fitted, shared)
            if len(self._known) > _MOST_KNOWN:
                self._known.popitem(last=False)
        return shared


def _key(section: Section) -> bytes | None:
    """Bytes that only equal sections have in common; None: the section has too many chords, or is too large, to
    compare.
    """
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
    """An accepted program, shifted so that its first point is `start_q40`. None: the controller refused it, or it would
    leave the travel or the range of the format there.
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
