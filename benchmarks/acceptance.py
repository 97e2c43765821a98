# SPDX-License-Identifier: MIT
"""Share of plans that the controller accepts: its proof of the axis limits needs a little headroom.

    python benchmarks/acceptance.py [--json OUT] [--plans N] [--first SEED]

Run by `make bench`. Prints to stdout; writes OUT and temporary path files.

Random paths in the plane, in space and of five axes, with random limits of the machine's axes, in all profiles. A plan
keeps 0.998 of these limits. It is checked against the limits themselves (0.2 % of headroom), and against limits with
0.5 %. Stops are searched with few trials: the proof does not depend on them.
"""

from __future__ import annotations

import sys
import tempfile
from collections import Counter
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "host_tools")]

from hodograph.config import Machine, load_machine, load_path_file  # noqa: E402
from hodograph.errors import HodographError  # noqa: E402
from hodograph.feed.limits import MACHINE_SHARE  # noqa: E402
from hodograph.machine_limits import program_limits  # noqa: E402
from hodograph.native.program import NativeLimits, NativeProgram  # noqa: E402
from hodograph.pipeline import Pipeline  # noqa: E402
from hodograph.program import ProgramOptions, StopTerms, compile_path, encode  # noqa: E402

MACHINES = {2: "paper_alpha", 3: "mill", 5: "mill_five_axes"}
PROFILES = ("optimal", "quintic", "exponential", "minimax")
ROOM = 1.005
"""Limits over what a plan keeps."""


def random_case(seed: int, folder: Path) -> Pipeline:
    """A path file and a machine, by the seed only."""
    rng = np.random.default_rng([seed, 99])
    axes = int(rng.choice([2, 2, 3, 5]))
    drawn = min(axes, 3)
    count = int(rng.integers(3, 10))
    legs = rng.uniform(2.0, 25.0, (count, 1))
    along = np.cumsum(rng.uniform(-0.9, 0.9, (count, drawn)), axis=0) + np.eye(drawn)[0]
    points = np.cumsum(legs * along / np.linalg.norm(along, axis=1)[:, None], axis=0)
    turned = np.cumsum(rng.uniform(-15.0, 15.0, (count, axes - drawn)), axis=0)
    listed = np.concatenate((points, turned), axis=1).round(4).tolist()
    profile = str(rng.choice(PROFILES))
    feed = f'profile = "{profile}"\n'
    if profile == "exponential":
        feed += "n_c = 8.12\n"
    if profile != "optimal":
        feed += f"nominal_mm_s = {rng.uniform(20, 300):.2f}\nramp_time_s = {rng.uniform(0.03, 0.3):.3f}\n"
    file = folder / "case.toml"
    file.write_text(f"[path]\nclosed = false\nthrough = {listed}\n[feed]\n{feed}", encoding="utf-8")
    machine = load_machine(ROOT / f"examples/machines/{MACHINES[axes]}.toml")
    shares = rng.uniform(0.2, 1.0, (len(machine.axes), 3))
    limited = tuple(
        replace(
            axis,
            velocity_mm_s=float(share[0]) * axis.velocity_mm_s,
            acceleration_mm_s2=float(share[1]) * axis.acceleration_mm_s2,
            jerk_mm_s3=float(share[2]) * axis.jerk_mm_s3,
        )
        for axis, share in zip(machine.axes, shares, strict=True)
    )
    return Pipeline(load_path_file(file), replace(machine, axes=limited, stop_time_ms=0))


def accepted(program: NativeProgram, machine: Machine, share: float) -> bool:
    """By a controller whose axes have this share of the limits of the machine."""
    fields = asdict(program_limits(machine))
    for name in ("axis_velocity_um_s", "axis_acceleration_um_s2", "axis_jerk_mm_s3"):
        fields[name] = tuple(round(share * value) for value in fields[name])
    return program.check(NativeLimits(**fields)) is None


def measure(seeds: range, folder: Path) -> dict[str, float]:
    """Counts: plans, plans without a feed or refused by the compiler, and accepted plans at both headrooms."""
    counts: Counter[str] = Counter()
    for done, seed in enumerate(seeds, 1):
        pipeline = random_case(seed, folder)
        machine = pipeline.machine
        options = ProgramOptions(period_us=machine.period_us, stops=_quick(pipeline))
        try:
            made = compile_path(pipeline.curve, pipeline.plan, options)
        except HodographError:
            counts["refused"] += 1
            continue
        program = NativeProgram(encode(made.program))
        counts["plans"] += 1
        at_half, at_whole = (
            accepted(program, machine, share) for share in (MACHINE_SHARE * ROOM, 1.0)
        )
        counts["accepted_half_percent"] += at_half
        counts["accepted"] += at_whole
        if not at_half:
            print(f"  seed {seed}: not accepted with 0.5 %", flush=True)
        if done % 1000 == 0:
            print(f"  {done}: {dict(counts)}", flush=True)
    share = 100.0 * counts["accepted_half_percent"] / counts["plans"]
    return {**counts, "accepted_half_percent_of_plans": share}


def _quick(pipeline: Pipeline) -> StopTerms:
    return replace(pipeline.stop_terms, quick=True, only_fault=True, stop_time_ms=0)


def main() -> int:
    """Exit status."""
    parser = figures_parser(__doc__)
    parser.add_argument("--plans", type=int, default=300)
    parser.add_argument("--first", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        counts = measure(range(options.first, options.first + options.plans), Path(folder))
    print(
        f"{counts['plans']} plans ({counts.get('refused', 0)} not possible): accepted with 0.5 % of room "
        f"{counts['accepted_half_percent']}, with 0.2 % {counts['accepted']}"
    )
    write_figures(options.json, counts)
    return 0


if __name__ == "__main__":
    sys.exit(main())
