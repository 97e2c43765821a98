# SPDX-License-Identifier: MIT
"""The contour error of a streamed job, from its chunks. Run by pytest; starts threads and processes, and writes to
temporary folders.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pytest

from hodograph.config import load_machine
from hodograph.machine_limits import program_limits
from hodograph.monitor.job_path import JobPath
from hodograph.native.program import NativeLimits
from hodograph.stream.chunk import Chunk, parse
from hodograph.stream.chunks import CHUNK_BYTES
from hodograph.stream.plan import JobFiles, JobPlan, Place
from hodograph.stream.simulation import simulate_chunks
from hodograph.toolpath.files import ReadOptions
from straight_job import chunks

MILL = Path(__file__).resolve().parents[3] / "examples" / "machines" / "mill.toml"
COUNTS_PER_MM = 1_000_000
JOB = 5
OFF_UM = (0.0, 2.5, -30.0, 7.0)


@pytest.fixture(scope="module")
def job() -> list[Chunk]:
    """Straight along x, 8 + 16 mm for each chunk."""
    return [parse(one) for one in chunks(4, JOB)]


def _setpoints(low_mm: float, high_mm: float, count: int = 400) -> np.ndarray:
    x = np.rint(np.linspace(low_mm, high_mm, count) * COUNTS_PER_MM)
    return np.column_stack((x, np.zeros(count)))


def test_the_error_is_the_distance_across_the_path(job: list[Chunk]) -> None:
    """Beside a chunk, its successor, and where they meet; a following error along the path counts for nothing."""
    path = JobPath(COUNTS_PER_MM)
    for k, chunk in enumerate(job):
        path.add(chunk)
        targets = _setpoints(16.0 * k, 16.0 * k + 16.0)
        actual = targets + np.array([-50_000.0, 1000.0 * OFF_UM[k]])
        actual[:, 0] = np.maximum(actual[:, 0], 0.0)
        errors, arcs = path.contour_errors_um(targets, actual)
        assert np.abs(errors - abs(OFF_UM[k])).max() < 1e-3
        assert np.abs(arcs - targets[:, 0] / COUNTS_PER_MM).max() < 1e-6


def test_another_motion_has_none(job: list[Chunk]) -> None:
    """A move to the start, setpoints that did not come, and chunks that have not."""
    path = JobPath(COUNTS_PER_MM)
    targets = _setpoints(0.0, 20.0)
    assert np.isnan(path.contour_errors_um(targets, targets)[0]).all()
    path.add(job[0])
    beside = targets + np.array([0.0, 5000.0])
    assert np.isnan(path.contour_errors_um(beside, beside)[0]).all()
    targets[7] = np.nan
    errors, _ = path.contour_errors_um(targets, targets)
    assert np.flatnonzero(np.isnan(errors)).tolist() == [7]
    ahead = _setpoints(30.0, 40.0)
    assert np.isnan(path.contour_errors_um(ahead, ahead)[0]).all()
    path.add(job[1])
    assert np.isfinite(path.contour_errors_um(ahead, ahead)[0]).all()


def test_setpoints_of_a_job_in_space_are_on_its_path(tmp_path: Path) -> None:
    """From chunks that the planner has made; each poll has what came in 50 ms."""
    machine = load_machine(MILL)
    part = tmp_path / "part.ngc"
    part.write_text("G64 P0.05\nF1200\nG1 X10\nG3 X20 Y10 Z-2 I0 J10\nG1 Y30\nG61\nG1 X0 Z0\nM2\n")
    job = JobFiles((part,), machine, 0.01, ReadOptions())
    with JobPlan(job, CHUNK_BYTES, JOB, Place()) as plan:
        (made,) = [list(chunks) for chunks in plan.by_job()]
    limits = NativeLimits(**asdict(program_limits(machine)), chunk=1)
    parts: list[np.ndarray] = []
    simulate_chunks(made, limits, "fixed", machine.counts_per_mm, parts.append)
    path = JobPath(machine.counts_per_mm)
    for chunk in made:
        path.add(chunk)
    assert len(made) >= 3
    setpoints = np.concatenate(parts).astype(float)
    for look in np.array_split(setpoints, len(setpoints) // 50):
        errors, arcs = path.contour_errors_um(look, look)
        assert errors.max() < 0.002, errors.max()
        assert (np.diff(arcs) > -1e-6).all()


def test_what_is_passed_is_forgotten() -> None:
    path = JobPath(COUNTS_PER_MM)
    for k, one in enumerate(chunks(12, JOB)):
        path.add(parse(one))
        targets = _setpoints(16.0 * k, 16.0 * k + 16.0)
        assert np.isfinite(path.contour_errors_um(targets, targets)[0]).all()
    assert len(path._parts) < 7
    path.add(parse(chunks(2, JOB + 1)[0]))
    assert len(path._parts) == 1
    path.add(parse(chunks(3, JOB + 2)[1]))  # the first chunk of another job did not come
    assert len(path._parts) == 1
