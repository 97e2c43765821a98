# SPDX-License-Identifier: MIT
"""Which pieces of a chunk get stop parameters, searched on the path that its planning window knows (docs/glossary.md);
docs/theory/feed.md section 7. Used by chunks.py. No I/O.

Stop codes of M pieces have the shape (M, 2, 3), as in ../program/stops.py.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from ..config import Machine
from ..feed.limits import zones_after
from ..feed.pieces import FeedPieces, joined_pieces
from ..machine_limits import stop_terms
from ..program.image import Program
from ..program.stop_planning import stop_codes
from ..program.stops import DECELERATION
from .windows import SectionFeed, Stretch, Window

Codes = NDArray[np.uint8]
Real = NDArray[np.float64]
Index = NDArray[np.intp]

SEARCH_S, GAP_S = 0.02, 0.06
"""Stop parameters are searched for one piece in SEARCH_S. Where none are found for GAP_S, all pieces are searched."""


class StopSearch:
    """The search of one section's stop codes."""

    def __init__(
        self, machine: Machine, feed: SectionFeed, program: Callable[[Stretch, Codes], Program]
    ) -> None:
        """program: makes the program of pieces, with these stop codes"""
        self._machine, self._feed, self._program = machine, feed, program
        self._last: tuple[Window, Codes] | None = None

    def of_window(self, window: Window) -> Codes:
        """Stop codes of the pieces of a window; only the kept ones are searched. Their path stops keep the limits on
        the path that the window knows after them. Of brief pieces only some are searched: a stop in another piece
        begins in the next one with codes, a little later.
        """
        if self._last is not None and self._last[0] is window:
            return self._last[1]
        codes, count = no_codes(len(window.stretch.pieces)), window.count
        durations = window.stretch.pieces.duration_q32_s[:count]
        seconds = np.ldexp(durations.astype(np.float64), -32)
        for spacing_s in (SEARCH_S, 0.0):
            found = np.asarray(codes[:count, :, DECELERATION].all(axis=1))
            wanted = _spaced(seconds, spacing_s, found)
            if wanted.any():
                mask = np.zeros(len(codes), dtype=np.bool_)
                mask[:count] = wanted
                codes[mask] = self._codes(window, window.stretch, mask, False)[mask]
        self._last = window, codes
        return codes

    def of_kept(
        self, window: Window, joint: int, kept: FeedPieces, codes: Codes, late: int | None
    ) -> Codes:
        """Stop codes of the kept pieces up to a joint, which have `codes`: those without any are searched on the
        window's path after the joint. With `late`: all pieces from that one on, with all trials.
        """
        rest = window.stretch.pieces.part(slice(joint, None))
        whole = Stretch(joined_pieces([kept, rest]), window.stretch.end_q40)
        count = _kinds(codes)
        wanted = count < codes.shape[1] if late is None else np.arange(len(codes)) >= late
        mask = np.concatenate((wanted, np.zeros(len(rest), dtype=np.bool_)))
        found = self._codes(window, whole, mask, late is not None)[: len(codes)]
        better = wanted & (_kinds(found) >= count)
        return np.where(better[:, None, None], found, codes)

    def of_tail(self, window: Window, tail: Stretch, thorough: bool | None) -> Codes:
        """Stop codes of a tail. thorough: with all trials; None: none are searched."""
        if thorough is None:
            return no_codes(len(tail.pieces))
        return self._codes(window, tail, np.ones(len(tail.pieces), dtype=np.bool_), thorough)

    def _codes(
        self, window: Window, stretch: Stretch, wanted: NDArray[np.bool_], thorough: bool
    ) -> Codes:
        path = self._feed.path
        program = self._program(stretch, no_codes(len(stretch.pieces)))
        begin = path.segment_at(int(stretch.pieces.start_q40[0]))
        base_mm = float(path.curve.segment_starts_mm[begin])
        limits = window.plan.limits
        zones = zones_after(limits.zones, base_mm)
        plan = replace(window.plan, limits=replace(limits, zones=zones))
        terms = replace(stop_terms(self._machine, limits), quick=not thorough)
        return stop_codes(program, plan, terms, wanted)


def _spaced(seconds: Real, spacing_s: float, found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pieces (M,) to search next: one in `spacing_s`; if that is 0, all pieces in gaps of GAP_S between found
    ones.
    """
    t = np.concatenate((np.zeros(1), np.cumsum(seconds)))
    if spacing_s > 0.0:
        return np.asarray(np.diff(np.floor(t / spacing_s)) > 0.0)
    before = np.maximum.accumulate(np.where(found, t[1:], 0.0))
    after = np.minimum.accumulate(np.where(found, t[:-1], t[-1])[::-1])[::-1]
    return np.asarray((after - before > GAP_S) & ~found)


def _kinds(codes: Codes) -> Index:
    """Number of kinds of stops for which each piece (M,) has codes."""
    return np.asarray(np.count_nonzero(codes[:, :, DECELERATION], axis=1))


def no_codes(count: int) -> Codes:
    """Stop codes of pieces without stop parameters."""
    return np.zeros((count, 2, 3), dtype=np.uint8)
