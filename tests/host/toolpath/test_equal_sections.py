# SPDX-License-Identifier: MIT
"""Equal sections of a job share their fit, plan and proof: the motion is that of sections made one by one."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from hodograph.config import load_machine
from hodograph.errors import PlanError
from hodograph.job import Job, SectionMaker, load_job
from hodograph.native.program import NativeProgram
from hodograph.pipeline import controller_verdict
from hodograph.toolpath.files import ReadOptions, read_toolpath
from hodograph.toolpath.fit.sections import divided

MILL = load_machine(Path(__file__).resolve().parents[3] / "examples" / "machines" / "mill.toml")
HOLES = "\n".join(
    ["G21 G90 G0 Z5", "G81 X0 Y0 Z-3 R1 F300"]
    + [f"X{8.1 * column:.3f} Y{7.3 * row:.3f}" for row in range(3) for column in range(4)]
    + ["G80", "G1 X40 Y5 F3000", "X50 Y12", "G4 P0.1", "G1 X60 Y19", "X70 Y26", "M2"]
)


def job_of(folder: Path, text: str) -> Job:
    file = folder / "holes.ngc"
    file.write_text(text, encoding="utf-8")
    return load_job(file, MILL)


def test_a_moved_program_is_that_of_the_section_alone(tmp_path: Path) -> None:
    job = job_of(tmp_path, HOLES)
    shared = {id(section.pipeline.shared) for section in job.sections}
    assert len(shared) < len(job.sections) / 2
    path = divided(read_toolpath(job.file, ReadOptions()), 0.01, str(job.file))
    maker = SectionMaker(job.file, MILL, None, [])
    alone = [made for section in path.sections for made in maker.made(section)]
    assert len(alone) == len(job.sections)
    for ours, other in zip(job.sections, alone, strict=True):
        one, two = ours.pipeline.program, other.pipeline.program
        assert np.abs(one.point_q40 - two.point_q40).max() <= 2
        assert one.duration_q32_s == pytest.approx(two.duration_q32_s, rel=1e-9)
        assert ours.line_at(np.array([0.0])) == other.line_at(np.array([0.0]))
        # What is taken over from an equal section is proved again here, for the place.
        native = NativeProgram(ours.pipeline.image)
        assert controller_verdict(native, MILL) is None


def test_an_equal_section_beyond_the_travel_is_refused(tmp_path: Path) -> None:
    steps = "\n".join(f"G61.1 G1 X{k}" for k in (-1990, -1000, -10, 980, 1970, 2960))
    with pytest.raises(PlanError, match=r"holes.ngc:7: x goes to"):
        job_of(tmp_path, f"G21 G90 F9000\n{steps}\nM2")


def test_other_depths_and_feeds_are_other_sections(tmp_path: Path) -> None:
    text = "G21 G90 G61.1\nG1 X10 F600\nX20\nX30 F900\nX40\nX50.001\nM2"
    sections = job_of(tmp_path, text).sections
    shared = [section.pipeline.shared for section in sections]
    assert shared[0] is shared[1]
    assert shared[2] is shared[3]
    assert len({id(one) for one in shared}) == 3
