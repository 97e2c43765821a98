# SPDX-License-Identifier: MIT
"""Runs Klipper's planner in batch mode (docs/Debugging.md of Klipper), from a clone of its repository that the user
names. Used by peers/compare. Starts make and Klipper in a temporary copy of the clone, and git to read the clone's
version; writes temporary files.

Klipper is in no package registry. The clone is copied first, so that nothing is written into it. The host program gets
the micro-controller's dictionary from Klipper's own build for Linux, the program as input, and an extra module that
logs each planned move. Moves are trapezoids of velocity along straight chords.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from .motion import RATE_HZ, AxisLimits, Motion
from .process_cost import Cost, run_measured

Real = NDArray[np.float64]

_FOLDER = Path(__file__).parent / "batch_klipper"
_SLOWEST_S = 900
_ARC_CHORD_MM = 0.6
"""The chord deviates 9 um from an arc of 5 mm radius. Klipper's default is 1 mm."""
_STEPPER = """
[stepper_{axis}]
step_pin: gpiochip0/gpio{step}
dir_pin: gpiochip0/gpio{direction}
microsteps: 16
rotation_distance: 8
endstop_pin: ^gpiochip0/gpio{endstop}
position_endstop: -1000
position_min: -1000
position_max: 1000
"""


class NoKlipperError(Exception):
    """Klipper cannot be run; the message says why."""


@dataclass(frozen=True)
class Klipper:
    """A copy of a clone of Klipper, ready to run; `python` has what it needs (batch_klipper/requirements.lock)."""

    copy: Path
    python: Path
    version: str

    def run(self, program: Path, limits: AxisLimits) -> tuple[Motion, Cost]:
        """The motion of a G-code program that starts at X0 Y0, and what the batch run took; raises NoKlipperError."""
        with tempfile.TemporaryDirectory(prefix="peer-") as name:
            folder = Path(name)
            log, source, config = (
                folder / "moves.txt",
                folder / "program.gcode",
                folder / "printer.cfg",
            )
            config.write_text(_configuration(limits, log), encoding="utf-8")
            source.write_text(_own_words(program.read_text(encoding="utf-8")), encoding="utf-8")
            cost = _called(
                *(self.python, self.copy / "klippy/klippy.py", config, "-i", source),
                *("-o", folder / "serial", "-d", self.copy / "out/klipper.dict"),
            )
            moves = np.loadtxt(log, ndmin=2)
        return Motion.trimmed(_sampled(moves)), cost


@contextmanager
def copied(clone: Path, python: Path) -> Iterator[Klipper]:
    """A copy of the user's clone with our extra, and with its own build for Linux, which has the dictionary.

    Raises NoKlipperError.
    """
    if not (clone / "klippy/klippy.py").is_file():
        raise NoKlipperError(f"{clone} has no klippy/klippy.py: KLIPPER is the folder of a clone")
    with tempfile.TemporaryDirectory(prefix="peer-") as name:
        copy = Path(name, "klipper")
        left = shutil.ignore_patterns(".git", "out", "*.so", "*.pyc")
        shutil.copytree(clone, copy, ignore=left)
        shutil.copy(_FOLDER / "moves_log.py", copy / "klippy/extras")
        (copy / ".config").write_text("CONFIG_MACH_LINUX=y\n", encoding="utf-8")
        for target in ("olddefconfig", "all"):
            _called("make", "-C", copy, f"PYTHON={python}", target)
        yield Klipper(copy, python, _version(clone))


def _version(clone: Path) -> str:
    """What git calls the clone's commit."""
    command = ["git", "-C", str(clone), "describe", "--tags", "--always"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "of unknown version"


def _own_words(text: str) -> str:
    """A program as Klipper reads it: known position, no G94, no feed without a move."""
    text = re.sub(r"(?m)^F", "G1 F", text.replace(" G94", ""))
    return f"SET_KINEMATIC_POSITION X=0 Y=0 Z=0\n{text}M400\n"


def _called(*command: object) -> Cost:
    """What it took; raises NoKlipperError. Our make is not the one above theirs."""
    environment = {name: value for name, value in os.environ.items() if "MAKE" not in name}
    done, cost = run_measured(command, _SLOWEST_S, environment)
    if done.returncode != 0:
        raise NoKlipperError(f"{command[0]} failed:\n{done.stdout[-2000:]}\n{done.stderr[-2000:]}")
    return cost


def _configuration(limits: AxisLimits, log: Path) -> str:
    values = {
        "VELOCITY": f"{limits.velocity_mm_s:g}",
        "ACCELERATION": f"{limits.acceleration_mm_s2:g}",
        "CHORD": f"{_ARC_CHORD_MM:g}",
        "LOG": str(log),
        "STEPPERS": "".join(
            _STEPPER.format(axis=axis, step=3 * k, direction=3 * k + 1, endstop=3 * k + 2)
            for k, axis in enumerate("xyz")
        ),
    }
    text = (_FOLDER / "printer.cfg").read_text(encoding="utf-8")
    for name, value in values.items():
        text = text.replace(f"@{name}@", value)
    return text


def _sampled(moves: Real) -> Real:
    """Positions (n, 3) at 1 kHz of moves as `moves_log.py` writes them."""
    time, up, level, down = moves[:, :4].T
    start, direction = moves[:, 4:7], moves[:, 7:10]
    slow, fast, acceleration = moves[:, 10:].T
    t = np.arange(time[0], time[-1] + up[-1] + level[-1] + down[-1] + 2.0 / RATE_HZ, 1.0 / RATE_HZ)
    at = np.searchsorted(time, t, side="right") - 1
    since = t - time[at]
    t1 = np.clip(since, 0.0, up[at])
    t2 = np.clip(since - up[at], 0.0, level[at])
    t3 = np.clip(since - up[at] - level[at], 0.0, down[at])
    distance = slow[at] * t1 + acceleration[at] * t1**2 / 2.0 + fast[at] * (t2 + t3)
    distance -= acceleration[at] * t3**2 / 2.0
    return np.asarray(start[at] + distance[:, None] * direction[at])
