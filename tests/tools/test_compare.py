# SPDX-License-Identifier: MIT
"""What `make compare` measures: processor time and memory of a process, and the figure of a corner. Run by pytest;
starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

from peers import picture  # noqa: E402
from peers.motion import AxisLimits  # noqa: E402
from peers.plan_alone import plan_alone  # noqa: E402
from peers.process_cost import run_measured  # noqa: E402

LIMITS = AxisLimits(200.0, 2000.0, 50_000.0)
CORNER_MM = np.array([[0.0, 0.0, 0.0], [10.0, 0.0, 0.0], [10.0, 10.0, 0.0]])
MIB = 2**20


def test_memory_is_that_of_the_command_alone() -> None:
    """Also where the process that starts it is large: 200 MiB here, 100 MiB there."""
    own = bytearray(200 * MIB)
    own[::1024] = b"x" * len(own[::1024])
    fill = f"x = bytearray({100 * MIB}); x[::1024] = b'x' * len(x[::1024]); print(len(x))"
    done, cost = run_measured((sys.executable, "-I", "-S", "-c", fill), 60.0)
    assert (done.returncode, done.stdout) == (0, f"{100 * MIB}\n")
    assert 100 < cost.memory_mib < 140


def test_status_of_the_command() -> None:
    done, _ = run_measured((sys.executable, "-c", "import sys; sys.exit('no')"), 60.0)
    assert (done.returncode, done.stderr) == (1, "no\n")


def test_a_planner_in_a_process_of_its_own(tmp_path: Path) -> None:
    """Ruckig rests in the corner: twice the time of one leg, which is known in closed form; and it can be drawn."""
    motion, cost = plan_alone("Ruckig", CORNER_MM, 100.0, LIMITS)
    # Ramps with jerk j and greatest acceleration a, up to v: v / a + a / j.
    leg_s = 10.0 / 100.0 + 100.0 / 2000.0 + 2000.0 / 50_000.0
    assert motion.duration_s == pytest.approx(2.0 * leg_s, abs=0.004)
    assert cost.processor_s is not None
    assert cost.processor_s > 0
    assert cost.memory_mib > 10
    picture.draw({"Ruckig": motion}, 0.01, 50_000.0, tmp_path / "corner.svg")
    assert "<svg" in (tmp_path / "corner.svg").read_text()


def test_a_planner_that_fails_says_why() -> None:
    with pytest.raises(RuntimeError, match=r"Ruckig failed:\n.*"):
        plan_alone("Ruckig", np.full((2, 3), np.nan), 100.0, LIMITS)
