# SPDX-License-Identifier: MIT
"""Summary of a campaign: one line for each group of runs, which differ in grid and sample only. Used by campaign/report
and cli/campaign_command. No I/O.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .execute import QUANTITIES
from .results import Results, case_texts
from .run_settings import Design

SHARES = (50.0, 95.0, 100.0)
"""Percentiles of the greatest contour error that are reported."""


@dataclass(frozen=True)
class Group:
    """One line: the common settings of the runs, their number, and their figures (NaN: none succeeded)."""

    case: tuple[str, ...]
    runs: int
    failed: int
    contour_um: tuple[float, ...]
    rms_um: float
    following_um: float
    volts: float
    duration_s: float

    @property
    def label(self) -> str:
        """The settings that differ from the files, as text."""
        path, profile, feed_mm_s, gains, fault = self.case
        feed = "own" if feed_mm_s == "own" else f"{float(feed_mm_s):g} mm/s"
        said = (path, profile, feed, gains, fault)
        return ", ".join(text for text in said if text not in ("own", "none"))

    def as_dict(self) -> dict[str, object]:
        """The line for JSON; None: no run succeeded."""
        p50, p95, greatest = (_finite(value) for value in self.contour_um)
        names = ("path", "profile", "feed_mm_s", "gains", "fault")
        return {
            **dict(zip(names, self.case, strict=True)),
            "runs": self.runs,
            "failed": self.failed,
            "contour_error_um": {"median": p50, "p95": p95, "max": greatest},
            "rms_contour_error_um": _finite(self.rms_um),
            "max_following_error_um": _finite(self.following_um),
            "max_volts": _finite(self.volts),
            "duration_s": _finite(self.duration_s),
        }


def groups(design: Design, results: Results) -> list[Group]:
    """All groups, in the order of the table."""
    size = design.group_size
    return [
        _group(
            tuple(case_texts(design, design.case(place))),
            results.values[place * size : (place + 1) * size],
        )
        for place in range(design.total // size)
    ]


def _group(case: tuple[str, ...], values: NDArray[np.float64]) -> Group:
    good = values[~np.isnan(values[:, 0])]
    column = dict(zip(QUANTITIES, good.T, strict=True))
    contour = column["max_contour_error_um"]
    return Group(
        case=case,
        runs=len(values),
        failed=len(values) - len(good),
        contour_um=tuple(
            float(np.percentile(contour, share)) if contour.size else np.nan for share in SHARES
        ),
        rms_um=_greatest(column["rms_contour_error_um"]),
        following_um=_greatest(column["max_following_error_um"]),
        volts=_greatest(column["max_volts"]),
        duration_s=_greatest(column["duration_s"]),
    )


def _greatest(values: NDArray[np.float64]) -> float:
    return float(values.max()) if values.size else float("nan")


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None


HEADER = (
    "",
    "runs",
    "failed",
    "contour um: median",
    "p95",
    "max",
    "rms",
    "following um",
    "volts",
    "s",
)


def text(found: list[Group]) -> str:
    """The lines of a table as text."""
    lines = [HEADER, *(cells(group) for group in found)]
    widths = [max(len(line[i]) for line in lines) for i in range(len(HEADER))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(line, widths, strict=True))
        ).rstrip()
        for line in lines
    )


def cells(group: Group) -> tuple[str, ...]:
    """A group as a line of that table."""
    numbers = (*group.contour_um, group.rms_um, group.following_um, group.volts, group.duration_s)
    shown = ["–" if np.isnan(value) else f"{value:.3f}" for value in numbers]
    return (group.label, str(group.runs), str(group.failed), *shown)
