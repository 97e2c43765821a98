# SPDX-License-Identifier: MIT
"""The servo loop of one axis as a linear sampled system, and its margins; docs/theory/drives.md section 17. Used by
tune/ and report/tune_report. No I/O.

Exact for the simulated drive (sim/plant), except for its nonlinear parts: encoder increments, voltage limit, friction.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..config.axis_table import Feedforward
from ..config.drive_file import Drive

Float = NDArray[np.float64]
Complex = NDArray[np.complex128]

GRID_POINTS = 6000
"""Frequencies at which a loop is evaluated, over six decades."""
_GONE = 1e-9
"""Poles of smaller magnitude are left out: their motion is gone within a step."""


@dataclass(frozen=True)
class Loop:
    """Coefficients of one servo sample: plant from volts, loop to volts (sim/plant/motor.h, pdff.h)."""

    step_s: float
    speed_from_speed: float
    speed_from_volts: float
    position_from_speed: float
    position_from_volts: float
    k_pp_rad_s_mm: float
    k_pf_rad_mm: float
    volts_per_ref: float
    volts_per_integral: float
    volts_per_speed: float
    newton_per_volt: float
    """Force at the table for a volt of load."""
    speed_per_distance: float = 0.0
    """Speed of the loop for a mm between two samples; 0: the motor's own."""
    delay_samples: int = 0

    @property
    def nyquist_rad_s(self) -> float:
        """Half of the servo's sampling frequency."""
        return math.pi / self.step_s

    def grid(self) -> Float:
        """Frequencies for plots and margins, rad/s, ascending, in equal ratios up to Nyquist."""
        top = self.nyquist_rad_s * (1 - 1e-9)
        return np.geomspace(top * 1e-6, top, GRID_POINTS)

    def _plant(self, z: Complex) -> tuple[Complex, Complex]:
        """Speed, as in the loop, and position for a volt."""
        speed = self.speed_from_volts / (z - self.speed_from_speed)
        position = (self.position_from_speed * speed + self.position_from_volts) / (z - 1)
        if self.speed_per_distance:
            speed = self.speed_per_distance * (1 - 1 / z) * position
        return speed, position

    def _by_ref(self, z: Complex) -> Complex:
        """Volts for a rad/s of reference."""
        return self.volts_per_ref + self.volts_per_integral * self.step_s / (z - 1)

    def open(self, rad_s: Float, delay_s: float = 0.0) -> Complex:
        """The loop opened at the volts, at these frequencies: the negated response to a volt.

        `delay_s` is a dead time that the model does not have.
        """
        z = np.exp(1j * rad_s * self.step_s)
        speed, position = self._plant(z)
        back = self._by_ref(z) * self.k_pp_rad_s_mm * position
        back += self.volts_per_integral * self.step_s / (z - 1) * speed
        back += self.volts_per_speed * speed
        return np.asarray(back * z**-self.delay_samples * np.exp(-1j * rad_s * delay_s))

    def closed(self, rad_s: Float, volts_s_mm: float = 0.0, volts_s2_mm: float = 0.0) -> Complex:
        """Position for a command; the last two are the torque offset, as volts, for speed and acceleration.

        Speed and acceleration of the command are those of continuous setpoints.
        """
        z = np.exp(1j * rad_s * self.step_s)
        s = 1j * rad_s
        _, position = self._plant(z)
        volts = self._by_ref(z) * (self.k_pp_rad_s_mm + self.k_pf_rad_mm * s)
        volts += volts_s_mm * s + volts_s2_mm * s * s
        volts = volts * z**-self.delay_samples
        return np.asarray(position * volts / (1 + self.open(rad_s)))

    def compliance(self, rad_s: Float) -> Float:
        """Amount by which a load moves the table, um/N."""
        _, position = self._plant(np.exp(1j * rad_s * self.step_s))
        mm_per_volt = np.abs(position / (1 + self.open(rad_s)))
        return np.asarray(1000.0 * mm_per_volt / self.newton_per_volt)

    def poles(self) -> Complex:
        """Poles of the closed loop, as continuous ones, rad/s, slowest first; without those that decay within a
        sample.
        """
        values = np.linalg.eigvals(self._transition()[0]).astype(np.complex128)
        found = np.log(values[np.abs(values) > _GONE]) / self.step_s
        return np.asarray(found[np.argsort(np.abs(found))])

    @property
    def stable(self) -> bool:
        """Whether all poles decay."""
        return bool(np.max(self.poles().real) < 0)

    def _transition(self) -> tuple[Float, Float, Float]:
        """The next sample's state from this one's, by state, command and load (volts).

        The state is position, speed, integral, the position before, the volts computed before.
        """
        h, k_pp = self.step_s, self.k_pp_rad_s_mm
        seen: Float = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
        if self.speed_per_distance:
            seen = self.speed_per_distance * np.array([1.0, 0.0, 0.0, -1.0, 0.0])
        volts: Float = -self.volts_per_speed * seen
        volts[0] -= self.volts_per_ref * k_pp
        volts[2] += self.volts_per_integral
        by_command = self.volts_per_ref * k_pp
        plant: Float = np.array([self.position_from_volts, self.speed_from_volts, 0.0, 0.0, 0.0])
        state: Float = np.zeros((5, 5))
        state[0, :2] = 1, self.position_from_speed
        state[1, 1] = self.speed_from_speed
        state[2] = -h * seen
        state[2, 0] -= h * k_pp
        state[2, 2] += 1
        state[3, 0] = 1
        state[4] = volts
        command: Float = np.array([0.0, 0.0, h * k_pp, 0.0, by_command])
        if self.delay_samples:
            state[:, 4] += plant
        else:
            state += plant[:, np.newaxis] * volts
            command += plant * by_command
        return state, command, -plant

    def steps(self, duration_s: float) -> tuple[Float, Float, Float]:
        """Times; position after a step of the command (of 1); movement after a step of load, um/N."""
        a, command, load = self._transition()
        count = max(2, math.ceil(duration_s / self.step_s))
        states, both = np.zeros((count, 5, 2)), np.stack([command, load], axis=1)
        for i in range(1, count):
            states[i] = a @ states[i - 1] + both
        per_newton = 1000.0 / self.newton_per_volt
        t_s: Float = np.arange(count, dtype=np.float64) * self.step_s
        return t_s, states[:, 0, 0], -states[:, 0, 1] * per_newton


def loop_of(drive: Drive) -> Loop:
    """The loop of a drive file."""
    h, t, g = 1.0 / drive.loop_rate_hz, drive.time_constant_s, drive.screw_mm_rad
    decay = math.exp(-h / t)
    lost = -math.expm1(-h / t)
    volts = drive.torque_to_volts * drive.k_pv_nm_s_rad
    present = drive.k_iv_per_s * h if drive.integral == "backward" else 0.0
    return Loop(
        step_s=h,
        speed_from_speed=decay,
        speed_from_volts=drive.gain_rad_s_v * lost,
        position_from_speed=g * t * lost,
        position_from_volts=g * drive.gain_rad_s_v * (h - t * lost),
        k_pp_rad_s_mm=drive.k_pp_rad_s_mm,
        k_pf_rad_mm=drive.k_pf_rad_mm,
        volts_per_ref=volts * (drive.k_vf + present),
        volts_per_integral=volts * drive.k_iv_per_s,
        volts_per_speed=volts * (1 + present),
        newton_per_volt=1000.0 / (drive.torque_to_volts * g),
        speed_per_distance=0.0 if drive.speed == "exact" else 1 / (h * g),
        delay_samples=drive.delay_samples,
    )


def offset_volts(drive: Drive, feedforward: Feedforward) -> tuple[float, float]:
    """The volts of the torque offset, V for a mm/s and V for a mm/s^2."""
    volts = drive.rated_torque_nm * drive.torque_to_volts * 1e-6
    return feedforward.torque_permille_s_m * volts, feedforward.torque_permille_s2_m * volts


@dataclass(frozen=True)
class Margins:
    """Margins of the loop opened at the volts.

    The loop's gain may rise by the factor `gain_up` or fall to `gain_down`, its phase may lag by `phase_deg` more, and
    its dead time may grow by `delay_s`. `modulus` is the least distance from -1 (1 / peak of the sensitivity).
    `crossover_hz` is the highest frequency where the gain is 1.
    """

    gain_up: float
    gain_down: float
    phase_deg: float
    delay_s: float
    modulus: float
    crossover_hz: float


def margins(loop: Loop, delay_s: float = 0.0) -> Margins:
    """The margins with an additional dead time, for a stable loop only."""
    rad_s = loop.grid()
    response = loop.open(rad_s, delay_s)
    size, phase = np.log(np.abs(response)), np.unwrap(np.angle(response))
    phase += (
        2 * math.pi * round((-math.pi - phase[0]) / (2 * math.pi))
    )  # two integrators: from -180 degrees
    crossing = _crossings(size)
    angles = [_between(phase, *place) + math.pi for place in crossing]
    speeds = [math.exp(_between(np.log(rad_s), *place)) for place in crossing]
    turns = math.pi * np.arange(-9, 10, 2)
    gains = [_between(size, *place) for turn in turns for place in _crossings(phase - turn)]
    return Margins(
        gain_up=math.exp(min((-g for g in gains if g < 0), default=math.inf)),
        gain_down=math.exp(max((-g for g in gains if g >= 0), default=-math.inf)),
        phase_deg=math.degrees(min((abs(a) for a in angles), default=math.pi)),
        delay_s=min(
            (a % (2 * math.pi) / w for a, w in zip(angles, speeds, strict=True)), default=math.inf
        ),
        modulus=float(np.abs(1 + response).min()),
        crossover_hz=max(speeds, default=0.0) / (2 * math.pi),
    )


def _crossings(values: Float) -> list[tuple[int, float]]:
    """Sign changes of values: index of the value before, and share of the step."""
    at = np.flatnonzero((values[:-1] < 0) != (values[1:] < 0))
    return [(int(i), float(values[i] / (values[i] - values[i + 1]))) for i in at]


def _between(values: Float, index: int, part: float) -> float:
    return float(values[index] + part * (values[index + 1] - values[index]))
