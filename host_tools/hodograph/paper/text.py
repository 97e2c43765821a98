# SPDX-License-Identifier: MIT
"""The comparison as a text table. Used by cli/report_commands and report/html. No I/O."""

from __future__ import annotations

from typing import Any

_NAMES = {
    "n_c": "n_c found",
    "search_iterations": "pattern search: iterations",
    "search_evaluations": "pattern search: evaluations",
    "peak_jerk_plain_mm_s3": "peak jerk, plain quintic",
    "peak_jerk_modified_mm_s3": "peak jerk, modified",
    "peak_jerk_reduction_percent": "reduction",
    "peak_jerk_at_paper_n_c_mm_s3": "peak jerk with the paper's n_c 8.12",
    "reduction_at_paper_n_c_percent": "reduction with the paper's n_c",
    "peak_acceleration_mm_s2": "peak acceleration, modified",
    "joint_acceleration_mm_s2": "acceleration disturbance at joints",
    "joint_jerk_mm_s3": "jerk disturbance at joints",
    "chord_acceleration_mm_s2": "same differences, worst of the path",
    "chord_jerk_mm_s3": "same differences, worst of the path (jerk)",
    "contour_error_um": "largest contour error",
    "max_volts": "largest drive voltage",
    "contour_error_delayed_um": "contour error, one sample of delay",
    "max_volts_delayed": "voltage, one sample of delay",
    "vector_acceleration_mm_s2": "acceleration vector at constant feed",
    "axis_acceleration_mm_s2": "acceleration of one axis",
    "vector_jerk_mm_s3": "jerk vector at constant feed",
    "axis_jerk_mm_s3": "jerk of one axis",
}
_LEFT_OUT = "vector_acceleration_mm_s2"


def quantity_name(key: str) -> str:
    """A quantity in words."""
    if key.endswith("_over_limit"):
        limit = "a_max" if "acceleration" in key else "J_max"
        return f"  over {limit}"
    return _NAMES[key]


def comparison_text(comparison: dict[str, Any]) -> str:
    """All curves side by side."""
    curves = list(comparison)
    head = f"{'':<44}" + "".join(
        f"{name:>12} paper {name + ' ours':>13}{'1 ms loop':>12}" for name in curves
    )
    lines = [head]
    for key in comparison[curves[0]]:
        if key == _LEFT_OUT:
            lines.append("What the paper does not limit (a_max 2000 mm/s^2, J_max 50000 mm/s^3):")
        unit = comparison[curves[0]][key]["unit"]
        title = quantity_name(key) + (f", {unit}" if unit else "")
        cells = "".join(
            f"{shown(comparison[name][key]['paper']):>18} {shown(comparison[name][key]['ours']):>13}"
            f"{shown(comparison[name][key]['ours_1ms']):>12}"
            for name in curves
        )
        lines.append(f"{title:<44}{cells}")
    lines.append("Why they differ, as far as we know: docs/validation/paper.md")
    return "\n".join(lines)


def shown(value: float | None) -> str:
    """A number with its significant digits; a dash: there is none."""
    if value is None:
        return "-"
    if isinstance(value, int) or float(value).is_integer():
        return f"{value:.0f}"
    if abs(value) >= 1000:
        return f"{value:.0f}"
    return f"{value:.4g}"
