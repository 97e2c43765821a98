# SPDX-License-Identifier: MIT
"""The machine, program and notes of one fault case while it runs; the input of the judge. Used by faults/case_runner,
faults/disturb, faults/judge and faults/uploads. Reads the path file, and keeps its program in memory.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bus.capture.frames import Frames
from ..config import Machine
from ..errors import InputError
from ..native import NativeProgram
from ..pipeline import load_pipeline
from ..simulate import Motion, simulate_on
from .case_record import CaseRecord
from .scenario import Case

REST_TOLERANCE_COUNTS = 2000
"""An axis that stays within this is at rest: 2 um for encoder increments and the end of settling."""
LIMIT_S = 30.0
"""A process that takes longer counts as hanging."""
LOOK_S = 0.02


@dataclass(frozen=True, eq=False)
class CleanRun:
    """A program with its machine, and the result of an undisturbed run."""

    machine: Machine
    image: bytes
    other: Path
    """Another path for the same machine."""
    motion: Motion
    setpoints: NDArray[np.int32]
    fault_stop_s: float
    """Bound of the longest fault stop."""


@dataclass
class CaseRun:
    """The events of a case, for the judge."""

    case: Case
    clean_run: CleanRun
    injections: list[dict[str, object]] = field(default_factory=list)
    evidence: CaseRecord | None = None
    """Of the disturbed run."""
    control: Frames | None = None
    """The controller's bus from the beginning to the end, recovery included."""
    began_us: int = 0
    """Time of the first injected fault or action; 0: there was none."""
    fault_codes: list[int] = field(default_factory=list)
    """Codes read from object 0x2003."""
    rest_us: int | None = None
    """Time at which the drives were at rest, by their own SDO answers."""
    recovery_ms: float | None = None
    """Time from the first reset command until the drives were found and configured; None: they never were."""
    troubles: list[str] = field(default_factory=list)
    """Errors during the case; each is a violation."""
    again: Motion | None = None
    """The run after the recovery."""
    finished: bool = False
    """The disturbed program came to its end."""
    wall_s: float = 0.0


@lru_cache(maxsize=8)
def load_clean_run(path: Path) -> CleanRun:
    """The program of a path file; raises InputError, PlanError."""
    pipeline = load_pipeline(path, allow_space=True)
    if pipeline.standing_mm:
        raise InputError(
            f"{path}: moves rotary axes alone: fault scenarios take paths that x, y or z draw"
        )
    machine, image = pipeline.machine, pipeline.image
    _, setpoints = NativeProgram(image).setpoints("fixed", machine.path_counts)
    motion = simulate_on(machine, image, "fixed", keep_rows=False)
    longest_us = max(pipeline.program.stops.worst_us[1:])
    return CleanRun(
        machine, image, path.with_name("other.toml"), motion, setpoints, longest_us * 1e-6
    )
