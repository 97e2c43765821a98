# SPDX-License-Identifier: MIT
"""Least squares for the plant of one axis: docs/theory/drives.md section 18. Used by cli/identify_command. No I/O.

The drive's loop, with the gains of the drive file, is simulated with the recorded setpoints and offsets. Gain, time
constant and Coulomb friction are fitted so that positions and volts are those reported.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from ..config.drive_file import Drive
from ..errors import RunError
from ..native import run_axis
from .stretches import Stretch

Float = NDArray[np.float64]

CONFIDENCE = 1.96
"""Standard errors to either side: 95 %."""
MEMORY_PERIODS = 50
"""Periods over which errors may be correlated (Newey and West)."""
_SMOOTH = 2**26
"""Increments per turn of the model's encoder: so many that small changes of the plant make small differences."""
_ROUNDS = 3
"""Rounds of the fit."""
_LEAST_MM, _LEAST_VOLTS = 1e-6, 1e-3 / np.sqrt(12.0)
_STEPS = np.array([3e-3, 3e-3, 5e-3])
"""Steps of central differences: gain and time constant over the guess, friction in V; wide, since friction is not
smooth.
"""
_LEAST_TRAVEL_MM = 0.1
"""Less travel than this identifies nothing."""
_FRICTION_GAIN = 20.0
"""Least decrease of the sum of squares by friction, in variances, to accept friction."""


@dataclass(frozen=True)
class Estimate:
    """A figure and half the width of its 95 % interval."""

    value: float
    within: float


@dataclass(frozen=True)
class Plant:
    """The fitted plant of an axis; `friction_volts` None: no friction was found. rms: of the residuals."""

    gain_rad_s_v: Estimate
    time_constant_s: Estimate
    friction_volts: Estimate | None
    rms_um: float
    rms_mv: float
    periods: int

    def drive(self, given: Drive) -> Drive:
        """The drive with this plant."""
        friction = None if self.friction_volts is None else self.friction_volts.value
        return replace(
            given,
            gain_rad_s_v=self.gain_rad_s_v.value,
            time_constant_s=self.time_constant_s.value,
            equipment=replace(given.equipment, friction_volts=friction),
        )


_LOW = np.array([1e-2, 1e-2, 0.0])
"""Least values of gain, time constant and friction in the fit."""


class _Model:
    """Residuals by period, each over its own scale, for gain, time constant (over the first guess) and friction (V)."""

    def __init__(
        self, motions: Sequence[Stretch], drive: Drive, counts_per_mm: int, period_us: int
    ) -> None:
        self._motions, self._drive = motions, replace(drive, encoder_counts_per_rev=_SMOOTH)
        self._counts_per_mm, self._period_us = counts_per_mm, period_us
        self._measured_mm = np.concatenate([m.position_counts for m in motions]) / counts_per_mm
        self._measured_volts = np.concatenate([m.volts_mv for m in motions]) / 1000.0
        self.periods = self._measured_mm.size
        self.scale_mm, self.scale_volts = _LEAST_MM, _LEAST_VOLTS

    def errors(self, figures: Float) -> tuple[Float, Float]:
        """Reported less computed, mm and V."""
        drive = self._with(figures)
        runs = [
            run_axis(drive, motion.inputs, self._counts_per_mm, self._period_us)
            for motion in self._motions
        ]
        position_mm = np.concatenate([run[0] for run in runs])
        volts = np.concatenate([run[1] for run in runs])
        return self._measured_mm - position_mm, self._measured_volts - volts

    def _with(self, figures: Float) -> Drive:
        friction = float(figures[2]) if figures.size > 2 else 0.0
        return replace(
            self._drive,
            gain_rad_s_v=self._drive.gain_rad_s_v * float(figures[0]),
            time_constant_s=self._drive.time_constant_s * float(figures[1]),
            equipment=replace(self._drive.equipment, friction_volts=max(0.0, friction)),
        )

    def residuals(self, figures: Float) -> Float:
        """All residuals, positions first."""
        mm, volts = self.errors(figures)
        return np.concatenate([mm / self.scale_mm, volts / self.scale_volts])

    def slopes(self, figures: Float) -> Float:
        """Derivatives of the residuals, by figure."""
        columns = []
        for i, step in enumerate(_STEPS[: figures.size]):
            away = np.zeros_like(figures)
            away[i] = step
            below = np.maximum(figures - away, _LOW[: figures.size])
            between = float((figures + away)[i] - below[i])
            columns.append((self.residuals(figures + away) - self.residuals(below)) / between)
        return np.stack(columns, axis=1)

    def rescale(self, figures: Float) -> None:
        """Makes the scales those of the residuals."""
        mm, volts = self.errors(figures)
        self.scale_mm = max(_LEAST_MM, float(np.sqrt(np.mean(mm**2))))
        self.scale_volts = max(_LEAST_VOLTS, float(np.sqrt(np.mean(volts**2))))


def identify_axis(
    motions: Sequence[Stretch], drive: Drive, counts_per_mm: int, period_us: int
) -> Plant:
    """The plant of the axis that made these motions with the loop of `drive`.

    Raises RunError: it moves too little, or no plant fits.
    """
    guess = _first_guess(motions, drive, counts_per_mm, period_us)
    model = _Model(motions, guess, counts_per_mm, period_us)
    figures = _fit(model, np.ones(2))
    plain = float(np.sum(model.residuals(figures) ** 2))
    rubbing = _fit(model, np.append(figures, 0.01 * drive.volts_limit), rounds=1)
    if plain - float(np.sum(model.residuals(rubbing) ** 2)) > _FRICTION_GAIN:
        figures = _fit(model, rubbing)
    within = CONFIDENCE * _standard_errors(model, figures)
    mm, volts = model.errors(figures)
    gain, time = guess.gain_rad_s_v, guess.time_constant_s
    friction = None
    if figures.size > 2:
        friction = Estimate(float(figures[2]), float(within[2]))
    return Plant(
        gain_rad_s_v=Estimate(gain * float(figures[0]), gain * float(within[0])),
        time_constant_s=Estimate(time * float(figures[1]), time * float(within[1])),
        friction_volts=friction,
        rms_um=1e3 * float(np.sqrt(np.mean(mm**2))),
        rms_mv=1e3 * float(np.sqrt(np.mean(volts**2))),
        periods=model.periods,
    )


def _first_guess(
    motions: Sequence[Stretch], drive: Drive, counts_per_mm: int, period_us: int
) -> Drive:
    """A first guess from volts over speed, acceleration and the sign of speed; rough, since volts between two SYNCs are
    not known.
    """
    period_s = period_us * 1e-6
    rows, volts = [], []
    for motion in motions:
        mm = motion.position_counts / counts_per_mm
        speed = (mm[2:] - mm[:-2]) / (2 * period_s)
        acceleration = (mm[2:] - 2 * mm[1:-1] + mm[:-2]) / period_s**2
        rows.append(np.stack([speed, acceleration, np.sign(np.round(speed, 3))], axis=1))
        volts.append(motion.volts_mv[1:-1] / 1000.0)
    table = np.concatenate(rows)
    if not len(table) or np.sum(np.abs(table[:, 0])) * period_s < _LEAST_TRAVEL_MM:
        raise RunError(f"the axis travels less than {_LEAST_TRAVEL_MM:g} mm: nothing can be fitted")
    by_speed, by_acceleration, _ = np.linalg.lstsq(table, np.concatenate(volts), rcond=None)[0]
    if not (by_speed > 0 and by_acceleration > 0):
        return drive
    return replace(
        drive,
        gain_rad_s_v=1 / (by_speed * drive.screw_mm_rad),
        time_constant_s=float(by_acceleration / by_speed),
    )


def _fit(model: _Model, start: Float, rounds: int = _ROUNDS) -> Float:
    """The fitted figures; between the rounds the scales of both kinds of residuals are set to those of the remaining
    residuals.
    """
    low, figures = _LOW[: start.size], start
    for again in range(rounds):
        found = least_squares(
            model.residuals,
            np.maximum(figures, low),
            jac=model.slopes,
            bounds=(low, np.inf),
            x_scale="jac",
            xtol=1e-8,
            ftol=1e-8,
        )
        if not found.success:
            raise RunError(f"no plant fits: {found.message}")
        figures = np.asarray(found.x)
        if again < rounds - 1:
            model.rescale(figures)
    return figures


def _standard_errors(model: _Model, figures: Float) -> Float:
    """The greater of two covariances: of independent errors, and of errors correlated over MEMORY_PERIODS (Newey,
    West).
    """
    residuals, jacobian = model.residuals(figures), model.slopes(figures)
    bread = np.linalg.inv(jacobian.T @ jacobian)
    scores = (jacobian * residuals[:, np.newaxis]).reshape(2, model.periods, -1).sum(axis=0)
    meat = scores.T @ scores
    for lag in range(1, min(MEMORY_PERIODS, model.periods - 1) + 1):
        weight = 1 - lag / (MEMORY_PERIODS + 1)
        both = scores[lag:].T @ scores[:-lag]
        meat += weight * (both + both.T)
    together = np.diag(bread @ meat @ bread)
    return np.sqrt(np.maximum(together, np.diag(bread)))


def plant_text(name: str, plant: Plant) -> str:
    """The sections of a drive file that the fit found, with 95 % intervals."""
    lines = [
        f"# axis {name}: {plant.periods} periods; left over {plant.rms_um:.3f} um, {plant.rms_mv:.1f} mV rms; +- 95 %",
        "[plant]",
        _line("gain_rad_s_v", plant.gain_rad_s_v),
        _line("time_constant_s", plant.time_constant_s),
    ]
    if plant.friction_volts is not None:
        lines += ["", "[equipment]", _line("friction_volts", plant.friction_volts)]
    return "\n".join(lines)


def _line(key: str, estimate: Estimate) -> str:
    text = f"{key} = {estimate.value:.6g}"
    return f"{text:<32}# +- {estimate.within:.2g}"


def plant_json(name: str, plant: Plant) -> dict[str, Any]:
    """The keys that tools may rely on."""
    return {"name": name, **asdict(plant)}
