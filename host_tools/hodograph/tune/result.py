# SPDX-License-Identifier: MIT
"""What a tuning found: by axis, and by path and case."""

from __future__ import annotations

from dataclasses import dataclass

from ..config import Machine
from ..config.axis_table import Feedforward
from ..config.drive_file import Drive
from .cases import Case, Outcome
from .design import Poles
from .margins import Margins


@dataclass(frozen=True)
class Side:
    """One axis with one set of gains. Margins are those with no more dead time than the model has."""

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
    """One plant: contour errors as given, with the tuned gains without torque offsets, and with all."""

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
    """All of it; `tried` is how many loops the search for the least contour error looked at, 0 when none was made."""

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
        """What the controller is to send."""
        return self.axes[0].tuned.feedforward, self.axes[1].tuned.feedforward
