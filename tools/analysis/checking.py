# SPDX-License-Identifier: MIT
"""Instructions of the controller's proof of the axis limits (core/limit_check.h), by segment and piece.

For benchmarks/counts.py, which prints them: runs the image `checker` of two cores over the example programs.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from analysis.counting import Counter
from analysis.emulator import TARGETS
from hodograph.pipeline import load_pipeline

ROOT = Path(__file__).resolve().parents[2]
NAMES = ("alpha", "heart", "star", "alpha_optimal", "heart_optimal")
CORES = ("an386", "microbit")


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
