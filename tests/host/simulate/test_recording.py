# SPDX-License-Identifier: MIT
"""A recording gives the motion of the simulation, and differences are named. Run by pytest; writes to temporary
folders.
"""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest

from hodograph.errors import InputError, RunError
from hodograph.simulate import TRACE_HEADER, analyse, write_trace

from .conftest import Case


def arrays(case: Case) -> list[np.ndarray]:
    rows = case.motion.rows
    return [rows[name][:, :2].copy() for name in ("set_counts", "act_counts", "volts_mv")]


def test_a_recording_gives_what_the_simulation_gave(alpha: Case) -> None:
    motion = analyse(alpha.image, *arrays(alpha), kernel="fixed")
    assert motion.summary() == alpha.motion.summary()
    assert np.array_equal(motion.rows, alpha.motion.rows)


def test_a_wrong_setpoint_is_named(alpha: Case) -> None:
    columns = arrays(alpha)
    columns[0][500, 1] += 1
    with pytest.raises(RunError, match=r"setpoint 500 .*1 differ"):
        analyse(alpha.image, *columns, kernel="fixed")


def test_the_wrong_kernel_is_found_out(alpha: Case) -> None:
    with pytest.raises(RunError, match="this kernel"):
        analyse(alpha.image, *arrays(alpha), kernel="float")


def test_a_short_recording_is_refused(alpha: Case) -> None:
    wanted = len(alpha.motion.rows)
    with pytest.raises(RunError, match=f"{wanted - 1} of {wanted} ticks"):
        analyse(alpha.image, *(column[:-1] for column in arrays(alpha)), kernel="fixed")


def test_trace_has_one_row_a_tick_in_full_precision(alpha: Case, tmp_path: Path) -> None:
    file = tmp_path / "trace.csv"
    write_trace(alpha.motion, file)
    with file.open(newline="") as text:
        rows = list(csv.reader(text))
    assert ",".join(rows[0]) == TRACE_HEADER
    assert len(rows) == alpha.motion.ticks + 1
    row = dict(zip(rows[0], rows[724], strict=True))
    motion = alpha.motion
    assert int(row["tick"]) == 723
    assert float(row["t_s"]) == 0.723
    assert float(row["x_cmd_mm"]) * 2**40 == motion.rows["cmd_q40_mm"][723, 0]
    assert int(row["y_set_counts"]) == motion.rows["set_counts"][723, 1]
    assert round(float(row["y_act_mm"]) * 1e6) == motion.rows["act_counts"][723, 1]
    assert float(row["contour_error_um"]) == motion.contour_error_um[723]
    assert float(row["x_volts"]) == motion.volts[723, 0]


def test_trace_that_cannot_be_written(alpha: Case, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be written"):
        write_trace(alpha.motion, tmp_path / "none" / "trace.csv")
