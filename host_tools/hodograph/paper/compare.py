# SPDX-License-Identifier: MIT
"""Compares the paper's printed results (paper section 6) with computed ones.

The paper does not fully describe the servo loop of its contour errors. They are computed in two readings: one that fits
all printed units, and one with a loop of 1 ms (docs/validation/paper.md, "Contour error").

Used by cli/report_commands and report/. Reads the examples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..config import Drive, Machine, load_machine
from ..data import EXAMPLES
from ..errors import InputError
from ..feed import FeedPlan, FeedRequest, plan_feed
from ..feed.ramp import JERK, exponential_ramp
from ..pipeline import Pipeline, load_pipeline
from ..simulate import simulate
from .dynamics import constant_feed_dynamics
from .joints import joint_disturbance

CASES = ("alpha", "heart")
PAPER_N_C = 8.12
"""Slope coefficient n_c as printed in the paper."""
A_MAX_MM_S2, J_MAX_MM_S3 = 2000.0, 50000.0


@dataclass(frozen=True)
class Printed:
    """Numbers that the paper prints for one curve."""

    joint_acceleration_mm_s2: float
    joint_jerk_mm_s3: float
    contour_error_um: float


PRINTED = {"alpha": Printed(0.5, 210.0, 10.5), "heart": Printed(0.1, 16.0, 10.8)}
N_C, ITERATIONS, EVALUATIONS = PAPER_N_C, 56, 205
PEAK_JERK_MM_S3, REDUCTION_PERCENT = 48500.0, 14.0


def compare() -> dict[str, Any]:
    """Printed and computed numbers by curve: {curve: {quantity: {"unit", "paper", "ours", "ours_1ms"}}}.

    `paper` None: not printed. `ours_1ms`: with the servo loop of 1 ms; None for quantities that no loop changes.
    """
    return {name: _compare_case(name) for name in CASES}


def _compare_case(name: str) -> dict[str, Any]:
    file = EXAMPLES / f"{name}.toml"
    if not file.is_file():
        raise InputError(f"{file}: the examples did not come with this installation: reinstall")
    pipeline = load_pipeline(file)
    rows: dict[str, Any] = {}

    def row(
        key: str, unit: str, paper: float | None, ours: float | None, ours_1ms: float | None = None
    ) -> None:
        rows[key] = {"unit": unit, "paper": paper, "ours": ours, "ours_1ms": ours_1ms}

    _feed_rows(pipeline, row)
    _joint_rows(pipeline, PRINTED[name], row)
    _contour_rows(pipeline, PRINTED[name], row)
    _dynamics_rows(pipeline, row)
    return rows


def plain_plan(pipeline: Pipeline) -> FeedPlan:
    """The plain quintic profile with the same nominal feed and ramp time."""
    asked = pipeline.feed
    request = FeedRequest("quintic", asked.nominal_mm_s, asked.ramp_time_s)
    return plan_feed(
        pipeline.curve.length_mm,
        request,
        pipeline.file.limits,
        pipeline.plan.controller,
        period_us=pipeline.plan.period_us,
    )


def _feed_rows(pipeline: Pipeline, row: Any) -> None:
    plan, plain = pipeline.plan, plain_plan(pipeline)
    jerk, plain_jerk = plan.peak_jerk_mm_s3, plain.peak_jerk_mm_s3
    at_paper_n_c = exponential_ramp(plan.feed_mm_s, pipeline.feed.ramp_time_s, PAPER_N_C).peak(JERK)
    row("n_c", "", N_C, plan.n_c)
    row("search_iterations", "", ITERATIONS, len(plan.history) - 1)
    row("search_evaluations", "", EVALUATIONS, plan.evaluations)
    row("peak_jerk_plain_mm_s3", "mm/s^3", None, plain_jerk)
    row("peak_jerk_modified_mm_s3", "mm/s^3", PEAK_JERK_MM_S3, jerk)
    row("peak_jerk_reduction_percent", "%", REDUCTION_PERCENT, 100 * (1 - jerk / plain_jerk))
    row("peak_jerk_at_paper_n_c_mm_s3", "mm/s^3", PEAK_JERK_MM_S3, at_paper_n_c)
    row(
        "reduction_at_paper_n_c_percent",
        "%",
        REDUCTION_PERCENT,
        100 * (1 - at_paper_n_c / plain_jerk),
    )
    row("peak_acceleration_mm_s2", "mm/s^2", None, plan.peak_acceleration_mm_s2)


def _joint_rows(pipeline: Pipeline, printed: Printed, row: Any) -> None:
    found = joint_disturbance(
        pipeline.spline_result.spline, pipeline.feed.nominal_mm_s, pipeline.plan.period_us / 1e6
    )
    acceleration, jerk = found.acceleration_mm_s2, found.jerk_mm_s3
    row(
        "joint_acceleration_mm_s2",
        "mm/s^2",
        printed.joint_acceleration_mm_s2,
        found.largest_at_joints(acceleration),
    )
    row("joint_jerk_mm_s3", "mm/s^3", printed.joint_jerk_mm_s3, found.largest_at_joints(jerk))
    row("chord_acceleration_mm_s2", "mm/s^2", None, found.largest(acceleration))
    row("chord_jerk_mm_s3", "mm/s^3", None, found.largest(jerk))


def _contour_rows(pipeline: Pipeline, printed: Printed, row: Any) -> None:
    machine = pipeline.machine
    loop_1ms = load_machine(_loop_1ms(machine))
    for delay_samples, error, largest in (
        (0, "contour_error_um", "max_volts"),
        (1, "contour_error_delayed_um", "max_volts_delayed"),
    ):
        errors, volts = zip(
            *(_contour(pipeline, one, delay_samples) for one in (machine, loop_1ms)), strict=True
        )
        row(error, "um", printed.contour_error_um, *errors)
        row(largest, "V", None, *volts)


def _loop_1ms(machine: Machine) -> Path:
    return machine.file.with_name(f"{machine.file.stem}_1ms.toml")


def _contour(
    pipeline: Pipeline, machine: Machine, delay_samples: int
) -> tuple[float, float | None]:
    """Largest contour error in um, and largest voltage, of a machine whose loops have this delay."""
    motion = simulate(
        pipeline.image,
        _delayed(machine.models(machine.path_axes), delay_samples),
        kernel=machine.kernel,
        counts_per_mm=machine.counts_per_mm,
        feedforward=machine.path_feedforward,
    )
    return motion.max_contour_error_um, motion.max_volts


def _delayed(drives: Sequence[Drive], delay_samples: int) -> tuple[Drive, ...]:
    return tuple(replace(drive, delay_samples=delay_samples) for drive in drives)


def _dynamics_rows(pipeline: Pipeline, row: Any) -> None:
    found = constant_feed_dynamics(pipeline.spline_result.spline, pipeline.feed.nominal_mm_s)
    for key, limit, unit, maximum in (
        ("vector_acceleration_mm_s2", A_MAX_MM_S2, "mm/s^2", found.vector_acceleration),
        ("axis_acceleration_mm_s2", A_MAX_MM_S2, "mm/s^2", found.axis_acceleration),
        ("vector_jerk_mm_s3", J_MAX_MM_S3, "mm/s^3", found.vector_jerk),
        ("axis_jerk_mm_s3", J_MAX_MM_S3, "mm/s^3", found.axis_jerk),
    ):
        row(key, unit, None, maximum.value)
        row(f"{key}_over_limit", "", None, maximum.value / limit)
