# SPDX-License-Identifier: MIT
"""A machine of six axes: the five of examples/machines/mill_five_axes.toml, and b, which turns like a. Used by tests of
machines with six axes. Writes the file of the machine.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
NAMES = ("x", "y", "z", "a", "b", "c")
Limits = tuple[float, float, float]
"""Velocity, acceleration and jerk of an axis, in mm or degrees."""


def six_axis_machine(
    folder: Path, limits: Mapping[str, Limits] | None = None, stop_time_ms: int = 250
) -> Path:
    """Writes its file to a folder. `limits`: of all axes, in place of the example's."""
    text = (EXAMPLES / "machines" / "mill_five_axes.toml").read_text()
    text = text.replace("../drives", str(EXAMPLES / "drives"))
    text = text.replace('"a", "c"]', '"a", "b", "c"]').replace(
        "[0, 0, 0, 0, 0]", "[0, 0, 0, 0, 0, 0]"
    )
    text = text.replace("[controller]\n", f"[controller]\nstop_time_ms = {stop_time_ms}\n")
    head, *axes = text.split("[[axis]]")
    b = axes[3].replace('name = "a"', 'name = "b"')
    axes.insert(4, b.replace("node = 5", "node = 7"))
    if limits is not None:
        axes = [_limited(axis, limits[name]) for axis, name in zip(axes, NAMES, strict=True)]
    file = folder / "six_axes.toml"
    file.write_text("[[axis]]".join([head, *axes]))
    return file


def _limited(axis: str, limits: Limits) -> str:
    for key, value in zip(("velocity", "acceleration", "jerk"), limits, strict=True):
        axis = re.sub(rf"^({key}_\w+) = .*$", rf"\1 = {value:g}", axis, count=1, flags=re.MULTILINE)
    return axis


def six_axis_path(
    folder: Path, machine: Path, points: Sequence[Sequence[float]], limits: str = ""
) -> Path:
    """Writes a path through points [x, y, z, a, b, c] with profile optimal; `limits`: lines of [limits]."""
    file = folder / "path.toml"
    file.write_text(
        f"[path]\nclosed = false\nthrough = {[list(point) for point in points]}\n"
        f'[feed]\nprofile = "optimal"\n[limits]\nreserve = 0.2\n{limits}\n[machine]\nfile = "{machine}"\n'
    )
    return file
