# SPDX-License-Identifier: MIT
"""Runs a toolpath with LinuxCNC of Debian's package, without a display, and gives the motion that it commands. Used by
peers/compare. Starts dpkg-query and LinuxCNC; writes to a temporary folder.

All of LinuxCNC takes part: milltask, motmod with trivkins and simulated joints.

HAL's sampler records the joints' position commands in each servo period of 1 ms. Positions are scaled to um, since
halsampler prints six decimals. The run has its own namespaces of processes, IPC and network: LinuxCNC's shutdown script
ends processes by their names.
"""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from .motion import AxisLimits, Motion

_FOLDER = Path(__file__).parent / "headless_linuxcnc"
_NAMESPACES = ("unshare", "--pid", "--fork", "--mount-proc", "--ipc", "--net")
_NOBODY = "65534"
_SLOWEST_S = 900

_JOINT = """
[AXIS_{letter}]
MIN_LIMIT = -2000
MAX_LIMIT = 2000
MAX_VELOCITY = {velocity:g}
MAX_ACCELERATION = {acceleration:g}
[JOINT_{number}]
TYPE = LINEAR
MIN_LIMIT = -2000
MAX_LIMIT = 2000
MAX_VELOCITY = {velocity:g}
MAX_ACCELERATION = {acceleration:g}
FERROR = 1000
MIN_FERROR = 1000
HOME = 0
HOME_OFFSET = 0
HOME_SEARCH_VEL = 0
HOME_LATCH_VEL = 0
HOME_SEQUENCE = 0
"""


def version() -> str:
    """Version of the installed LinuxCNC package."""
    query = ["dpkg-query", "--show", "--showformat=${Version}", "linuxcnc-uspace"]
    return subprocess.run(query, capture_output=True, text=True, check=True).stdout


def run(program: Path, limits: AxisLimits, blending: str) -> tuple[Motion, float]:
    """The motion of a G-code program, with `blending` (such as "G64 P0.01") before its first line; memory in MiB.

    The memory is the sum of the peaks of milltask, which reads the program, and rtapi_app, which plans and runs it.
    """
    with tempfile.TemporaryDirectory(prefix="peer-") as name:
        folder = Path(name)
        folder.chmod(0o777)  # LinuxCNC's real-time part gives its privileges up
        _write_configuration(folder, limits)
        (folder / "program.ngc").write_text(
            f"G21 {blending}\n{_lines(program)}\nM2\n", encoding="utf-8"
        )
        command = [*_NAMESPACES, "linuxcnc", str(folder / "machine.ini")]
        environment = {
            **os.environ,
            "HOME": name,
            "RTAPI_UID": _NOBODY,
            "RTAPI_FIFO_PATH": str(folder / "fifo"),
            "PEER_FOLDER": name,
        }
        done = subprocess.run(
            command,
            env=environment,
            capture_output=True,
            text=True,
            timeout=_SLOWEST_S,
            check=False,
        )
        samples = folder / "samples.txt"
        if not samples.exists():
            log = "\n".join(file.read_text() for file in sorted(folder.glob("linuxcnc_*.txt")))
            raise RuntimeError(f"LinuxCNC did not run:\n{done.stdout}\n{done.stderr}\n{log}")
        memory_kib = int((folder / "memory.txt").read_text())
        return Motion.trimmed(_positions(samples)), memory_kib / 1024.0


def _lines(program: Path) -> str:
    """Without what ends the program early."""
    return re.sub(r"(?mi)^\s*(%|M2|M30)\s*$", "", program.read_text(encoding="utf-8"))


def _write_configuration(folder: Path, limits: AxisLimits) -> None:
    joints = "".join(
        _JOINT.format(
            letter=letter,
            number=number,
            velocity=limits.velocity_mm_s,
            acceleration=limits.acceleration_mm_s2,
        )
        for number, letter in enumerate("XYZ")
    )
    text = (_FOLDER / "machine.ini").read_text(encoding="utf-8")
    run_program = _FOLDER / "display.py"
    (folder / "machine.ini").write_text(
        text.replace("@DISPLAY@", str(run_program)) + joints, encoding="utf-8"
    )
    (folder / "machine.hal").write_bytes((_FOLDER / "machine.hal").read_bytes())
    (folder / "parameters.var").touch()
    (folder / "tool.tbl").write_text("T1 P1 D0 Z0\n", encoding="utf-8")


def _positions(samples: Path) -> np.ndarray:
    """Positions in mm; no sample may be missing."""
    rows = np.loadtxt(samples, usecols=(0, 1, 2, 3), ndmin=2)
    if np.any(np.diff(rows[:, 0]) != 1):
        raise RuntimeError("LinuxCNC's sampler lost samples: the machine is too busy, run again")
    return np.asarray(rows[:, 1:] / 1000.0)
