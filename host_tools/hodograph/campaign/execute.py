# SPDX-License-Identifier: MIT
"""Compiles the program of a campaign and makes a batch of its runs. Used by campaign/results, campaign/runner and
campaign/summary. Runs in a worker of Dask or in the process itself. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..errors import HodographError, one_line
from ..native import NativeProgram
from ..simulate import simulate
from .definition import Source
from .run_settings import Design, Run

QUANTITIES = (
    "max_contour_error_um",
    "rms_contour_error_um",
    "max_following_error_um",
    "max_volts",
    "duration_s",
)
"""The stored figures of a run, by their names in `Motion`; the contour error is the first."""


@dataclass(frozen=True)
class Built:
    """The result of compiling a program: its image and ticks, or the error."""

    number: int
    image: bytes = b""
    ticks: int = 0
    error: str = ""


@dataclass(frozen=True)
class Outcome:
    """The result of a run: its figures in the order of QUANTITIES and the hash of its encoders, or the error."""

    number: int
    values: tuple[float, ...] = ()
    encoders_sha256: str = ""
    error: str = ""


def build(source: Source, profile: str | None, feed_mm_s: float | None, number: int) -> Built:
    """Plans and compiles one program."""
    try:
        pipeline = source.pipeline(profile, feed_mm_s)
        return Built(number, pipeline.image, pipeline.program.ticks)
    except Exception as error:  # a program that cannot be made is a result too
        return Built(number, error=_error_text(error))


def make_runs(design: Design, built: Built, numbers: Sequence[int]) -> list[Outcome]:
    """Simulates runs of one program, in their order."""
    program = NativeProgram(built.image)
    return [_outcome(design, program, number) for number in numbers]


def _outcome(design: Design, program: NativeProgram, number: int) -> Outcome:
    try:
        return _simulated(design.run(number), program)
    except Exception as error:  # a run that fails is a row of the table
        return Outcome(number, error=_error_text(error))


def _simulated(run: Run, program: NativeProgram) -> Outcome:
    plant = run.plant
    forward = any(f.velocity or f.has_torque for f in plant.feedforward)
    motion = simulate(
        program,
        plant.drives,
        kernel=plant.kernel,
        counts_per_mm=plant.counts_per_unit,
        feedforward=plant.feedforward if forward else None,
        faults=run.faults,
        keep_rows=False,
    )
    values = tuple(float(getattr(motion, name)) for name in QUANTITIES)
    return Outcome(run.number, values, motion.encoders_sha256)


def _error_text(error: Exception) -> str:
    """The message of an error; errors of other types, which are bugs, with the type."""
    text = one_line(error)
    return text if isinstance(error, HodographError) else f"{type(error).__name__}: {text}"
