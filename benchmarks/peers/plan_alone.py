# SPDX-License-Identifier: MIT
"""TOPP-RA or Ruckig in a process of its own, so that time and memory are those of this planner. Used by peers/compare.
`plan_alone` starts this file as a script; both read and write temporary files.

    plan_alone.py PLANNER PROBLEM SOLUTION

PROBLEM (npz) has the programmed path and the feed, SOLUTION (npz) gets positions at 1 kHz and the processor time.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import astuple
from pathlib import Path
from time import process_time

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from peers.motion import AxisLimits, Motion
from peers.process_cost import Cost, run_measured

SLOWEST_S = 900.0


def plan_alone(
    planner: str, path_mm: NDArray[np.float64], feed_mm_s: float, limits: AxisLimits
) -> tuple[Motion, Cost]:
    """The motion, and what planning it took; the time is that of the planner's call."""
    with tempfile.TemporaryDirectory(prefix="peer-") as folder:
        problem, solution = Path(folder, "problem.npz"), Path(folder, "solution.npz")
        np.savez(
            problem, path_mm=path_mm, feed_mm_s=feed_mm_s, limits=np.array(astuple(limits), float)
        )
        command = (sys.executable, __file__, planner, problem, solution)
        done, cost = run_measured(command, SLOWEST_S)
        if done.returncode != 0:
            raise RuntimeError(f"{planner} failed:\n{done.stderr}")
        with np.load(solution) as found:
            called = Cost(float(found["processor_s"]), cost.memory_mib)
            return Motion(found["position_mm"]), called


def main() -> int:
    """Exit status."""
    planner, problem, solution = sys.argv[1:]
    if planner == "TOPP-RA":
        from peers.toppra_spline import run  # only one of both is loaded: its memory is measured
    else:
        from peers.ruckig_stops import run
    with np.load(problem) as given:
        limits = AxisLimits(*given["limits"].tolist())
        path_mm, feed_mm_s = given["path_mm"], float(given["feed_mm_s"])
    begin = process_time()
    motion = run(path_mm, feed_mm_s, limits)
    np.savez(solution, position_mm=motion.position_mm, processor_s=process_time() - begin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
