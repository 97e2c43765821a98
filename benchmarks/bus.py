# SPDX-License-Identifier: MIT
# bench: bus
"""Runs on the bus: seconds of motion for a second of wall time, deadline misses, hashes compared with those of
simulate.

    tools/with-vcan .venv/bin/python benchmarks/bus.py --json OUT

Run by `make bench`. Starts the simulated machine, sends to its controller and receives from the bus; writes OUT.

At full pace the next tick comes as soon as both drives have answered, so the ratio says how much faster than real time
this machine's bus, controller, drives and recorder are together. The goal is 1.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from _figures import figures_parser, write_figures

from hodograph.bus.address import parse_address
from hodograph.bus.run import run_program, run_session
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate

ROOT = Path(__file__).resolve().parent.parent
RUNS = [(name, pace) for pace in ("fast", "real-time") for name in ("alpha", "heart")]


def measure(name: str, pace: str) -> dict[str, Any]:
    """One run of an example."""
    pipeline = load_pipeline(ROOT / "examples" / f"{name}.toml")
    address = parse_address("socketcan:vcan0")
    with run_session(pipeline.machine, address, pace, 5.0, print) as at:
        run = run_program(at, pipeline.machine, pipeline.image, pipeline.machine.kernel)
    drives = pipeline.machine.models(pipeline.machine.path_axes)
    expected = simulate(pipeline.image, drives, kernel=pipeline.machine.kernel).summary()
    got = run.summary()
    return {
        "ticks": run.motion.ticks,
        "frames": run.frames,
        "wall_s": run.wall_s,
        "times_real_time": run.motion.ticks * run.motion.period_us / 1e6 / run.wall_s,
        "deadline_misses": run.deadline_misses,
        "setpoints_as_simulated": got["setpoints_sha256"] == expected["setpoints_sha256"],
        "encoders_as_simulated": got["encoders_sha256"] == expected["encoders_sha256"],
    }


def main() -> None:
    """Measure and write."""
    out: Path = figures_parser(__doc__, required=True).parse_args().json
    figures: dict[str, Any] = {}
    for name, pace in RUNS:
        figures.setdefault(pace, {})[name] = measure(name, pace)
    write_figures(out, figures)


if __name__ == "__main__":
    main()
