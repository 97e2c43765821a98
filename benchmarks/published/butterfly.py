# SPDX-License-Identifier: MIT
"""Plans the butterfly NURBS with the limits of three papers, and prints the cycle times next to the published ones.

    butterfly.py [--json OUT] [--only ROW ...]

Run by `make butterfly`. Prints a row for each paper to stdout; writes OUT (JSON) and a temporary drawing. ROW is the
first author of the paper that used the limits: Jia, Liu or Erwinski.

Data of the curve: Y. Hu, X. Jiang, G. Huo and others, Int. J. Adv. Manuf. Technol. 129 (2023) 2843-2860. Limits and
times: K. Erwinski, A. Wawrzak, M. Paprocki, IEEE Trans. Ind. Informatics 18 (2022) 7560-7571, table III and figures 13
to 15. docs/validation/butterfly.md lists what is printed there, and what is inferred.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hodograph as hg

CONTROL_POINTS_MM = """\
54.493,52.139 55.507,52.139 56.082,49.615 56.780,44.971 69.575,51.358 77.786,58.573 90.526,67.081
105.973,63.801 100.400,47.326 94.567,39.913 92.369,30.485 83.440,33.757 91.892,28.509 89.444,20.393
83.218,15.446 87.621,4.830 80.945,9.267 79.834,14.535 76.074,8.522 70.183,12.550 64.171,16.865 59.993,22.122
55.680,36.359 56.925,24.995 59.765,19.828 54.493,14.940 49.220,19.828 52.060,24.994 53.305,36.359
48.992,22.122 44.814,16.865 38.802,12.551 32.911,8.521 29.152,14.535 28.040,9.267 21.364,4.830 25.768,15.447
19.539,20.391 17.097,28.512 25.537,33.750 16.602,30.496 14.199,39.803 8.668,47.408 3.000,63.794 18.465,67.084
31.197,58.572 39.411,51.358 52.204,44.971 52.904,49.614 53.478,52.139 54.492,52.139
"""
INNER_KNOTS = """\
0.0083 0.0150 0.0361 0.0855 0.1293 0.1509 0.1931 0.2273 0.2435 0.2561 0.2692 0.2889 0.3170 0.3316 0.3482
0.3553 0.3649 0.3837 0.4005 0.4269 0.4510 0.4660 0.4891 0.5000 0.5109 0.5340 0.5489 0.5731 0.5994 0.6163
0.6351 0.6447 0.6518 0.6683 0.6830 0.7111 0.7307 0.7439 0.7565 0.7729 0.8069 0.8491 0.8707 0.9145 0.9639
0.9850 0.9917
"""
WEIGHTS = {3: 1.2, 11: 2.0, 14: 5.0, 15: 3.0, 17: 1.1, 33: 1.1, 35: 3.0, 36: 5.0, 39: 2.0, 47: 1.2}
"""Weights by index of the control point, from 0; all others are 1."""
DEGREE = 3
TOLERANCE_MM = 0.001
"""The chord error of figures 13 to 15."""


@dataclass(frozen=True)
class Printed:
    """A row of table III: the limits that another paper uses, and two cycle times. Both axes have these limits.

    name      first author of the other paper
    theirs_s  cycle time of the method of Erwinski and others (2022)
    cited_s   cycle time of the method of the other paper
    """

    name: str
    feed_mm_s: float
    acceleration_mm_s2: float
    jerk_mm_s3: float
    theirs_s: float
    cited_s: float


PRINTED = (
    Printed("Jia", 40.0, 500.0, 20_000.0, 4.61, 8.7),
    Printed("Liu", 250.0, 2000.0, 20_000.0, 6.31, 6.86),
    Printed("Erwinski", 300.0, 2500.0, 50_000.0, 8.8, 9.2),
)


def control_points_mm() -> NDArray[np.float64]:
    """The control points (51, 2), as printed."""
    return np.array([pair.split(",") for pair in CONTROL_POINTS_MM.split()], dtype=np.float64)


def weights() -> NDArray[np.float64]:
    """The weight of each control point."""
    found = np.ones(len(control_points_mm()))
    found[list(WEIGHTS)] = list(WEIGHTS.values())
    return found


def knots() -> NDArray[np.float64]:
    """All knots (55,): the inner ones, and DEGREE + 1 equal ones at each end."""
    inner = np.array(INNER_KNOTS.split(), dtype=np.float64)
    ends = np.zeros(DEGREE + 1)
    return np.concatenate((ends, inner, ends + 1.0))


def drawing() -> str:
    """The curve as DXF, in mm. It is moved to begin at the origin, because the machine stands there."""
    points = control_points_mm()
    points = points - points[0]
    numbers = [(70, 4), (71, DEGREE), (72, len(knots())), (73, len(points)), (74, 0)]
    tags: list[tuple[int, object]] = [(0, "SECTION"), (2, "HEADER"), (9, "$ACADVER"), (1, "AC1015")]
    tags += [(9, "$INSUNITS"), (70, 4), (0, "ENDSEC"), (0, "SECTION"), (2, "ENTITIES")]
    tags += [(0, "SPLINE"), (5, "1F"), (100, "AcDbEntity"), (8, "0"), (100, "AcDbSpline"), *numbers]
    tags += [(40, f"{knot:.4f}") for knot in knots()]
    tags += [(41, f"{weight:.1f}") for weight in weights()]
    for x, y in points:
        tags += [(10, f"{x:.6f}"), (20, f"{y:.6f}"), (30, "0.0")]
    tags += [(0, "ENDSEC"), (0, "EOF")]
    return "".join(f"{code}\n{value}\n" for code, value in tags)


def machine(printed: Printed) -> hg.Machine:
    """A machine whose two axes have the printed limits. Its limits along the path are so large that none is reached."""
    axis = {
        "travel_mm": (-200, 200),
        "velocity_mm_s": printed.feed_mm_s,
        "acceleration_mm_s2": printed.acceleration_mm_s2,
        "jerk_mm_s3": printed.jerk_mm_s3,
    }
    controller = {
        "feed_mm_s": 2.0 * printed.feed_mm_s,
        "acceleration_mm_s2": 4.0 * printed.acceleration_mm_s2,
        "jerk_mm_s3": 10.0 * printed.jerk_mm_s3,
        "stop_time_ms": 20_000,
    }
    axes = [axis | {"name": "x", "node": 2}, axis | {"name": "y", "node": 3}]
    return hg.Machine.of({"controller": controller, "axis": axes}, name=printed.name)


def measured(printed: Printed, file: Path) -> dict[str, Any]:
    """Numbers of our plan and the printed ones.

    least_s   length of the curve over feed: the least cycle time without other limits
    possible  whether the printed cycle time is at least least_s
    """
    job = hg.load_job(
        file, machine(printed), tolerance_mm=TOLERANCE_MM, feed_mm_s=printed.feed_mm_s
    )
    (section,) = job.sections
    plan, program = section.plan, section.program()
    usage = {name: one.ratio for name, one in plan.usage().items()}
    least_s = job.length_mm / printed.feed_mm_s
    return {
        "row": printed.name,
        "length_mm": job.length_mm,
        "deviation_um": job.deviation_um,
        "printed_s": printed.theirs_s,
        "cited_s": printed.cited_s,
        "ours_s": plan.duration_s,
        "least_s": least_s,
        "possible": printed.theirs_s >= least_s,
        "program_bytes": len(program.image),
        "acceleration_usage": max(v for k, v in usage.items() if k.startswith("axis.acceleration")),
        "jerk_usage": max(v for k, v in usage.items() if k.startswith("axis.jerk")),
    }


def main(words: list[str] | None = None) -> int:
    """Plans and prints the rows; returns the exit status. Without `words` it reads the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--json", type=Path)
    names = [printed.name for printed in PRINTED]
    parser.add_argument("--only", nargs="+", choices=names, default=names, help="these rows")
    options = parser.parse_args(words)
    rows = []
    print(
        f"{'limits of':<10}{'printed s':>10}{'cited s':>9}{'ours s':>8}{'length/feed s':>15}{'axis usage %':>18}"
    )
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "butterfly.dxf")
        file.write_text(drawing(), encoding="ascii")
        for printed in PRINTED:
            if printed.name not in options.only:
                continue
            row = measured(printed, file)
            rows.append(row)
            shares = f"{100 * row['acceleration_usage']:.1f}, {100 * row['jerk_usage']:.1f}"
            remark = "" if row["possible"] else "  printed time is shorter than length/feed"
            print(
                f"{row['row']:<10}{row['printed_s']:>10.2f}{row['cited_s']:>9.2f}{row['ours_s']:>8.2f}"
                f"{row['least_s']:>15.2f}{shares:>18}{remark}",
                flush=True,
            )
    print(
        f"length {rows[0]['length_mm']:.3f} mm, off the printed curve by less than {rows[0]['deviation_um']:.2f} um"
    )
    if options.json is not None:
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
