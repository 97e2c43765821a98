# SPDX-License-Identifier: MIT
"""The results of a tuning: gains and margins of each axis, contour errors of each path and case; as text and as JSON.
Used by cli/tune_command, report/tune_report and tune/tuning. No I/O.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ..config import Machine
from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from .cases import Case, Outcome
from .design import Poles
from .loop import Margins


@dataclass(frozen=True)
class Side:
    """One axis with one set of gains. Margins are those with the dead time of the model only."""

    drive: Drive
    feedforward: Feedforward
    margins: Margins
    stiffness_n_um: float


@dataclass(frozen=True)
class AxisResult:
    """One axis before and after."""

    name: str
    given: Side
    tuned: Side


@dataclass(frozen=True)
class CaseResult:
    """One plant: contour errors with the given gains, with the tuned gains without torque offsets, and with both."""

    case: Case
    given: Outcome
    plain: Outcome
    tuned: Outcome


@dataclass(frozen=True, eq=False)
class PathResult:
    """One path: its program, and the runs."""

    name: str
    image: bytes
    cases: tuple[CaseResult, ...]


@dataclass(frozen=True, eq=False)
class Tuning:
    """The whole result; `tried`: number of loops that the search for the least contour error tried, 0: no search."""

    machine: Machine
    poles: Poles
    axes: tuple[AxisResult, AxisResult]
    paths: tuple[PathResult, ...]
    tried: int

    @property
    def drives(self) -> tuple[Drive, Drive]:
        """The tuned drives."""
        return self.axes[0].tuned.drive, self.axes[1].tuned.drive

    @property
    def feedforward(self) -> tuple[Feedforward, Feedforward]:
        """The feedforward of the controller."""
        return self.axes[0].tuned.feedforward, self.axes[1].tuned.feedforward


COLUMNS = ("as given", "no offsets", "tuned")
"""The columns of the table of contour errors."""

_ROWS: tuple[tuple[str, str, Callable[[Side], float]], ...] = (
    ("k_pp", "rad/(s mm)", lambda s: s.drive.k_pp_rad_s_mm),
    ("k_pv", "N m s/rad", lambda s: s.drive.k_pv_nm_s_rad),
    ("k_iv", "1/s", lambda s: s.drive.k_iv_per_s),
    ("k_pf", "rad/mm", lambda s: s.drive.k_pf_rad_mm),
    ("k_vf", "", lambda s: s.drive.k_vf),
    ("velocity offset", "of the setpoints'", lambda s: s.feedforward.velocity),
    ("torque offset, 1 m/s^2", "per mille", lambda s: s.feedforward.torque_permille_s2_m),
    ("torque offset, 1 m/s", "per mille", lambda s: s.feedforward.torque_permille_s_m),
    ("crossover", "Hz", lambda s: s.margins.crossover_hz),
    ("phase margin", "deg", lambda s: s.margins.phase_deg),
    ("dead time allowed", "us", lambda s: 1e6 * s.margins.delay_s),
    ("gain may rise to", "times", lambda s: s.margins.gain_up),
    ("gain may fall to", "times", lambda s: s.margins.gain_down),
    ("modulus margin", "", lambda s: s.margins.modulus),
    ("least stiffness", "N/um", lambda s: s.stiffness_n_um),
)
"""Name, unit, value of one side of an axis."""


def axis_table(tuning: Tuning) -> tuple[list[str], list[list[str]]]:
    """Head and rows: gains, feedforward and margins of both axes, before and after."""
    sides = [side for axis in tuning.axes for side in (axis.given, axis.tuned)]
    head = ["", *(f"{a.name}: {which}" for a in tuning.axes for which in ("given", "tuned")), ""]
    rows = [[name, *(_shown(value(side)) for side in sides), unit] for name, unit, value in _ROWS]
    places = ["interpolation", *(side.drive.interpolation for side in sides), ""]
    return head, [*rows, places]


def case_table(tuning: Tuning) -> tuple[list[str], list[list[str]]]:
    """Head and rows: greatest contour error of each path and plant, um."""
    head = ["contour error, um", *(f"{p.name}: {c}" for p in tuning.paths for c in COLUMNS)]
    if not tuning.paths:
        return head, []
    rows = []
    for index, first in enumerate(tuning.paths[0].cases):
        results = [path.cases[index] for path in tuning.paths]
        cells = [_error(o) for r in results for o in (r.given, r.plain, r.tuned)]
        rows.append([first.case.name, *cells])
    return head, rows


SATURATED = "*: the voltage limit was met: no gains help there"


def poles_text(tuning: Tuning) -> str:
    """The closed loop, in a line."""
    poles = tuning.poles
    best = f" (best of {tuning.tried})" if tuning.tried else ""
    return (
        f"closed loop of both axes: {poles.natural_rad_s / (2 * math.pi):.4g} Hz, damping {poles.damping:.3g}, "
        f"real pole {poles.real_rad_s / (2 * math.pi):.4g} Hz{best}"
    )


def tuning_text(tuning: Tuning) -> str:
    """The whole result as text."""
    lines = [poles_text(tuning), "", *_aligned(*axis_table(tuning))]
    head, rows = case_table(tuning)
    if rows:
        lines += ["", *_aligned(head, rows)]
        if any("*" in cell for row in rows for cell in row[1:]):
            lines.append(SATURATED)
    return "\n".join(lines)


def _aligned(head: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
    table = [head, *rows]
    widths = [max(len(row[i]) for row in table) for i in range(len(head))]
    return [
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    ]


def _shown(value: float) -> str:
    return "any" if math.isinf(value) else f"{value:.6g}" if value >= 1e4 else f"{value:.4g}"


def _error(outcome: Outcome) -> str:
    return f"{outcome.contour_error_um:.3f}{'*' if outcome.saturated else ''}"


def tuning_json(tuning: Tuning) -> dict[str, Any]:
    """The keys that tools may rely on."""
    return {
        "natural_hz": tuning.poles.natural_rad_s / (2 * math.pi),
        "damping": tuning.poles.damping,
        "real_pole_hz": tuning.poles.real_rad_s / (2 * math.pi),
        "tried": tuning.tried,
        "axes": [
            {"name": axis.name, "given": _side_json(axis.given), "tuned": _side_json(axis.tuned)}
            for axis in tuning.axes
        ],
        "paths": [
            {
                "name": path.name,
                "cases": [
                    {
                        "case": row.case.name,
                        "given": asdict(row.given),
                        "no_offsets": asdict(row.plain),
                        "tuned": asdict(row.tuned),
                    }
                    for row in path.cases
                ],
            }
            for path in tuning.paths
        ],
    }


def _side_json(side: Side) -> dict[str, Any]:
    names = ("k_pp_rad_s_mm", "k_pv_nm_s_rad", "k_iv_per_s", "k_pf_rad_mm", "k_vf", "interpolation")
    found = asdict(side.margins)
    return {
        **{name: getattr(side.drive, name) for name in names},
        "feedforward": asdict(side.feedforward),
        "margins": {k: None if math.isinf(v) else v for k, v in found.items()},
        "stiffness_n_um": side.stiffness_n_um,
    }
