# SPDX-License-Identifier: MIT
"""Feed figures: peak jerk of each profile over the bang-bang limit, the search for n_c, the error of the pieces in 50
digits, and the time for planning and compiling.

    python benchmarks/feed.py [--json OUT] [--feed MM_S] [--ramp S]

Run by `make bench`. Prints to stdout, writes OUT.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path[:0] = [str(ROOT / "tests/host/feed"), str(ROOT / "host_tools")]

from test_pieces import worst_errors  # noqa: E402

from hodograph.feed import ControllerLimits, FeedRequest, Limits, plan_feed  # noqa: E402
from hodograph.feed.ramp import (  # noqa: E402
    ACCELERATION,
    JERK,
    Ramp,
    exponential_ramp,
    minimax_ramp,
    optimise_n_c,
    quintic_ramp,
)
from hodograph.program import compile_program, decode, encode  # noqa: E402
from hodograph.spline import PHSpline  # noqa: E402

CONTROLLER = ControllerLimits(500.0, 5000.0, 200000.0, 0.02)
PAPER_N_C = 8.12
SHARES = (1e-6, 0.13, 0.5, 0.77, 1.0 - 1e-6)
"""Places of each piece at which it is compared, as shares of its duration."""


def profiles(feed: float, ramp: float) -> tuple[dict[str, Any], dict[str, Any]]:
    """Peak jerk and acceleration by profile, and figures of the search."""
    best = optimise_n_c(feed, ramp)
    found: dict[str, Ramp] = {
        "quintic": quintic_ramp(feed, ramp),
        f"exponential, n_c = {PAPER_N_C} (paper)": exponential_ramp(feed, ramp, PAPER_N_C),
        f"exponential, n_c = {best.ramp.n_c:.4f} (found)": best.ramp,
    }
    for degree in range(5, 13, 2):
        found[f"minimax, degree {degree} and {degree + 1}"] = minimax_ramp(feed, ramp, degree)
    limit, plain = 4.0 * feed / ramp**2, found["quintic"].peak(JERK)
    rows = {
        name: {
            "peak_jerk_mm_s3": curve.peak(JERK),
            "over_plain": curve.peak(JERK) / plain,
            "over_bang_bang": curve.peak(JERK) / limit,
            "peak_acceleration_mm_s2": curve.peak(ACCELERATION),
        }
        for name, curve in found.items()
    }
    rows["bang-bang (limit)"] = {
        "peak_jerk_mm_s3": limit,
        "over_plain": limit / plain,
        "over_bang_bang": 1.0,
        "peak_acceleration_mm_s2": 2.0 * feed / ramp,
    }
    last = best.history[-1]
    search = {"n_c": best.ramp.n_c, "iterations": last.iteration, "evaluations": last.evaluations}
    return rows, search


def piece_errors(feed: float, ramp: float) -> dict[str, Any]:
    """Greatest error of the pieces against the exact profile, over 100 mm, in 50 digits."""
    out = {}
    for profile, degree in (
        ("quintic", 5),
        ("exponential", 5),
        *(("minimax", d) for d in (5, 7, 9, 11)),
    ):
        for period_us in (1000, 8000):
            request = FeedRequest(profile, feed, ramp, degree=degree)
            plan = plan_feed(
                100.0, request, Limits(policy="report"), CONTROLLER, period_us=period_us
            )
            length, jerk = worst_errors(plan, SHARES)
            name = f"{profile} {degree} at {period_us} us"
            out[name] = {"pieces": len(plan.pieces), "length_mm": length, "jerk_mm_s3": jerk}
    return out


def circles(count: int) -> PHSpline:
    """`count` segments of 4 mm on circles."""
    turn = np.exp(1j * np.arange(2 * count + 1) * np.pi / 500)
    w = np.asarray(
        2.0 * np.stack((turn[:-1:2], turn[1::2], turn[2::2]), axis=1), dtype=np.complex128
    )
    a, b, c = w[:, 0], w[:, 1], w[:, 2]
    distances = (3 * a * a + 3 * a * b + 2 * b * b + a * c + 3 * b * c + 3 * c * c) / 15
    return PHSpline(
        np.concatenate((np.zeros(1, dtype=np.complex128), np.cumsum(distances)[:-1])), w, False
    )


def times(count: int) -> dict[str, float]:
    """Seconds for `count` segments: plan, compile with checks, encode, decode."""
    spline = circles(count)
    marks = [time.perf_counter()]
    plan = plan_feed(spline.length_mm, FeedRequest("minimax", 100.0, 0.1), None, CONTROLLER)
    marks.append(time.perf_counter())
    program = compile_program(spline, plan)
    marks.append(time.perf_counter())
    image = encode(program)
    marks.append(time.perf_counter())
    decode(image)
    marks.append(time.perf_counter())
    names = ("plan_s", "compile_s", "encode_s", "decode_s")
    return dict(zip(names, np.diff(marks).tolist(), strict=True))


def main() -> int:
    """Exit status."""
    parser = figures_parser(__doc__)
    parser.add_argument("--feed", type=float, default=100.0)
    parser.add_argument("--ramp", type=float, default=0.1)
    arguments = parser.parse_args()
    rows, search = profiles(arguments.feed, arguments.ramp)
    print(f"feed {arguments.feed:g} mm/s within {arguments.ramp:g} s")
    print(
        f"{'profile':40s} {'jerk mm/s^3':>12s} {'/ plain':>8s} {'/ limit':>8s} {'acc mm/s^2':>11s}"
    )
    for name, row in rows.items():
        print(
            f"{name:40s} {row['peak_jerk_mm_s3']:12.1f} {row['over_plain']:8.4f} "
            f"{row['over_bang_bang']:8.4f} {row['peak_acceleration_mm_s2']:11.1f}"
        )
    print(f"search: {search['iterations']} iterations, {search['evaluations']} evaluations")
    errors = piece_errors(arguments.feed, arguments.ramp)
    for name, row in errors.items():
        print(
            f"pieces of {name:26s} {row['pieces']:4d}: distance within {row['length_mm']:.2g} mm, "
            f"jerk within {row['jerk_mm_s3']:.2g} mm/s^3"
        )
    spent = {str(count): times(count) for count in (1_000, 10_000, 100_000)}
    for count, row in spent.items():
        print(f"{count:>7s} segments: " + ", ".join(f"{k[:-2]} {v:.3f} s" for k, v in row.items()))
    figures = {"profiles": rows, "search": search, "pieces": errors, "seconds": spent}
    write_figures(arguments.json, {"feed": figures})
    return 0


if __name__ == "__main__":
    sys.exit(main())
