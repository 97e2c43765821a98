# SPDX-License-Identifier: MIT
"""Instructions of the controller's proof of the axis limits (core/limit_check.h), by segment and piece, and of the
proof of stops (core/brake_check.h), by piece and kind of stop.

Used by benchmarks/counts, which prints them. Runs the images `checker` of two cores and `stop_checker` of one in the
emulator, over the example programs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from analysis.counting import Counter
from analysis.emulator import TARGETS
from hodograph.pipeline import load_pipeline
from hodograph.program import encode
from hodograph.program.stops import DECELERATION

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("alpha", "heart", "star", "alpha_optimal", "heart_optimal")
CORES = ("an386", "microbit")
"""The cores that are counted."""

STOP_NAMES = ("alpha", "alpha_optimal")
"""The programs whose stops are counted; others take minutes."""

KINDS = ("hold", "fault")


def costs(build: Path) -> dict[str, Any]:
    """By core and example: instructions of limit_check_all, also by segment and piece, and of program_check."""
    programs = {name: load_pipeline(ROOT / f"examples/{name}.toml") for name in NAMES}
    out: dict[str, Any] = {}
    for core in CORES:
        proof, whole = (
            Counter(build, TARGETS[core], "checker", entry)
            for entry in ("limit_check_all", "program_check")
        )
        for name, chain in programs.items():
            both = [int(one.count_words([], chain.image).sum()) for one in (proof, whole)]
            parts = chain.program.segment_count + chain.program.piece_count
            out[f"{core} {name}"] = {
                "limit_check": both[0],
                "program_check": both[1],
                "per_segment_and_piece": round(both[0] / parts),
            }
    return out


def stop_costs(build: Path) -> dict[str, Any]:
    """By example and kind of stop, on the Cortex-M4F: instructions of brake_check_piece over the feed pieces with stop
    parameters: number of pieces, median, most, and sum.
    """
    counter = Counter(build, TARGETS[CORES[0]], "stop_checker", "brake_check_piece")
    out: dict[str, Any] = {}
    for name in STOP_NAMES:
        program = load_pipeline(ROOT / f"examples/{name}.toml").program
        counted = counter.count_words([], encode(program)).sum(axis=1, dtype=np.int64)
        by_kind = counted.reshape(program.piece_count, len(KINDS))
        has_stop = program.stops.codes[:, :, DECELERATION] != 0
        out[name] = {
            kind: _spread(by_kind[has_stop[:, column], column]) for column, kind in enumerate(KINDS)
        }
    return out


def _spread(counted: np.ndarray[Any, np.dtype[np.int64]]) -> dict[str, int]:
    return {
        "pieces": counted.size,
        "median": int(np.median(counted)),
        "most": int(counted.max()),
        "all": int(counted.sum()),
    }
