# SPDX-License-Identifier: MIT
"""Compares the usual NURBS interpolator (tests/target/taylor.c) with the PH kernel: instructions of a tick and ripple
of the feed. Used by tools/count and benchmarks/counts. Reads the example alpha, starts the emulator; writes temporary
files.

Both run the alpha at its feed of 100 mm/s: the kernel runs the PH spline without ramps, the other one the B-spline of
the same control polygon, which the PH spline meets at its knots.
"""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from analysis.campaign import EXAMPLES, figures
from analysis.counting import Counter
from analysis.emulator import TARGETS
from hodograph.config import load_path_file

ROOT = Path(__file__).resolve().parents[2]
ALPHA = ROOT / "examples/alpha.toml"
FEED_MM_S = 100.0
PERIOD_S = 1e-3
RAMP_S = 0.1
CORES = (("an386", "float"), ("an385", "fixed"))  # and our kernel there

Setpoints = npt.NDArray[np.int32]


def stored(points_mm: npt.NDArray[np.complex128]) -> bytes:
    """struct path of taylor.c."""
    points = np.column_stack((points_mm.real, points_mm.imag)).astype("<f4")
    return struct.pack("<2f", len(points), FEED_MM_S * PERIOD_S) + points.tobytes() + bytes(512)


def polygon() -> bytes:
    """The alpha's, as the image takes it."""
    return stored(load_path_file(ALPHA).path.points)


def ripple(setpoints: Setpoints) -> float:
    """Greatest |chord feed - feed| / feed, three digits of it."""
    chords_mm = np.hypot(*np.diff(setpoints.astype(float), axis=0).T) * 1e-6
    most = np.abs(chords_mm / (FEED_MM_S * PERIOD_S) - 1.0).max()
    return float(f"{most:.3g}")


def compare(build: Path) -> dict[str, Any]:
    """For each core: figures of the other's tick and of ours, and both ripples."""
    program = EXAMPLES["alpha"].read_bytes()
    out: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as name:
        setpoints = Path(name) / "setpoints"
        for core, kernel in CORES:
            other = Counter(build, TARGETS[core], "taylor")
            theirs = figures(other.count_words([str(setpoints)], polygon()))
            # the last step ends at the end of the curve, and is shorter
            theirs["ripple"] = ripple(_read(setpoints)[:-1])
            counter = Counter(build, TARGETS[core])
            counts = counter.count(kernel, program, setpoints=setpoints)
            first = round(RAMP_S / PERIOD_S) + 1
            ours = figures(counts[first:-first])
            ours["ripple"] = ripple(_read(setpoints)[first:-first])
            out[core] = {"taylor": theirs, f"hodograph {kernel}": ours}
    return out


def _read(file: Path) -> Setpoints:
    return np.fromfile(file, "<i4").reshape(-1, 2)
