# SPDX-License-Identifier: MIT
"""Planning with profile `optimal`: time and memory by number of segments, and the verifier's result for each plan.

    python benchmarks/planning.py [--json OUT] [--segments N…]

Run by `make bench`. Prints to stdout, writes OUT.

Paths are random walks of control points, legs of 7.5 to 22.5 mm, turns of 40 degrees rms; 2000 mm/s^2 and 50 000
mm/s^3 for each axis, controller 500 mm/s, 5000 mm/s^2, 200 000 mm/s^3 less 10 %. Each is planned in a process of its
own, by one thread. Other work on the computer changes the wall time, and less the processor time.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import subprocess
import sys
import time
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures

SEGMENTS = (100, 1000, 10_000)
SEED = 1
"""Of all walks."""


def measure(segments: int) -> dict[str, Any]:
    """Plans one path in this process."""
    from hodograph.feed import AxisLimits, ControllerLimits, FeedRequest, Limits
    from hodograph.feed.optimal import plan_optimal
    from hodograph.program import compile_program
    from hodograph.spline import from_control_polygon
    from hodograph.verify import verify_program

    random = np.random.default_rng(SEED)
    turns = np.cumsum(random.normal(0.0, 0.7, segments + 2))
    legs = random.uniform(7.5, 22.5, segments + 2) * np.exp(1j * turns)
    spline = from_control_polygon(np.cumsum(legs), False).spline
    limits = Limits(axis=AxisLimits(None, (2000.0, 2000.0), (50_000.0, 50_000.0)))
    controller = ControllerLimits(500.0, 5000.0, 200_000.0, 0.1)
    begun, used = time.perf_counter(), time.process_time()
    plan = plan_optimal(spline, FeedRequest("optimal"), limits, controller)
    figures: dict[str, Any] = {
        "planning_s": time.perf_counter() - begun,
        "planning_processor_s": time.process_time() - used,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }
    program = compile_program(spline, plan)
    used = time.process_time()
    found = verify_program(program, limits)
    return figures | {
        "duration_s": plan.duration_s,
        "pieces": len(program.pieces),
        "verify_processor_s": time.process_time() - used,
        "worst_ratio": max(peak.usage for peak in found.peaks),
    }


def main() -> None:
    """Prints the figures, and writes them."""
    parser = figures_parser(__doc__)
    parser.add_argument("--segments", type=int, nargs="+", default=SEGMENTS)
    parser.add_argument("--one", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one is not None:
        print(json.dumps(measure(options.one)))
        return
    figures = {}
    single = os.environ | {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    for segments in options.segments:
        command = [sys.executable, __file__, "--one", str(segments)]
        done = subprocess.run(command, env=single, stdout=subprocess.PIPE, text=True, check=True)
        found = figures[str(segments)] = json.loads(done.stdout)
        print(
            f"{segments:6} segments: {found['planning_s']:.2f} s, of a processor "
            f"{found['planning_processor_s']:.2f} s, {found['memory_mb']:.0f} MB, {found['pieces']} pieces, "
            f"worst ratio {found['worst_ratio']:.5f}, verified in {found['verify_processor_s']:.2f} s",
            flush=True,
        )
    write_figures(options.json, figures)


if __name__ == "__main__":
    main()
