# SPDX-License-Identifier: MIT
"""The simulated machine as processes: controller and drives on a virtual CAN bus."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

from ..errors import BusError
from ..names import INTERPOLATIONS, SPEEDS
from .address import BusAddress

if TYPE_CHECKING:
    from ..config import Drive, Machine

CONTROLLER, DRIVE = "hodograph-controller", "hodograph-drive"
_REPOSITORY = Path(__file__).resolve().parents[3]


def find_program(name: str) -> Path:
    """An executable of the build, or of $PATH. Raises BusError when there is none."""
    built = _REPOSITORY / "build" / "bin" / name
    if os.access(built, os.X_OK):
        return built
    found = shutil.which(name)
    if found is None:
        raise BusError(f"{name} is not built (looked for {built} and in PATH): run make build")
    return Path(found)


def controller_words(given: str | None) -> list[str]:
    """The program that is started as the controller, with its first arguments: `given` as a shell would take it, else
    $HODOGRAPH_CONTROLLER, else hodograph-controller. Raises BusError when there is no such program.
    """
    text = given or os.environ.get("HODOGRAPH_CONTROLLER")
    if not text:
        return [str(find_program(CONTROLLER))]
    try:
        words = shlex.split(text)
    except ValueError as error:
        raise BusError(f"controller {text!r}: {error}") from None
    if not words or shutil.which(words[0]) is None:
        raise BusError(f"controller {text!r}: there is no such program here")
    return words


def controller_command(
    machine: Machine, address: BusAddress, pace: str, controller: str | None = None
) -> list[str]:
    """Command line of the controller process; `controller` as for controller_words."""
    return [
        *controller_words(controller),
        *("--bus", address.channel),
        *("--node", str(machine.node)),
        *("--pace", pace),
    ]


def drive_command(machine: Machine, address: BusAddress) -> list[str]:
    """Command line of the one process that simulates all drives."""
    command = [str(find_program(DRIVE)), "--bus", address.channel]
    for axis, drive in zip(machine.axes, machine.models(machine.axes), strict=True):
        command += ["--axis", _axis_text(axis.node, drive, machine)]
    return command


def _axis_text(node: int, drive: Drive, machine: Machine) -> str:
    values: dict[str, float] = {
        "node": node,
        "gain_rad_s_v": drive.gain_rad_s_v,
        "time_constant_s": drive.time_constant_s,
        "screw_mm_rad": drive.screw_mm_rad,
        "torque_to_volts": drive.torque_to_volts,
        "volts_limit": drive.volts_limit,
        "k_pp_rad_s_mm": drive.k_pp_rad_s_mm,
        "k_pv_nm_s_rad": drive.k_pv_nm_s_rad,
        "k_iv_per_s": drive.k_iv_per_s,
        "k_pf_rad_mm": drive.k_pf_rad_mm,
        "k_vf": drive.k_vf,
        "encoder_counts_per_rev": drive.encoder_counts_per_rev,
        "loop_rate_hz": drive.loop_rate_hz,
        "counts_per_mm": machine.counts_per_mm,
        "position_mm": 0,
        "interpolation": INTERPOLATIONS.index(drive.interpolation),
        "speed": SPEEDS.index(drive.speed),
        "delay_samples": drive.delay_samples,
        **drive.equipment.given(),
    }
    return ",".join(f"{key}={value:.17g}" for key, value in values.items())


def guarded(command: list[str]) -> list[str]:
    """The same command, that gets SIGTERM when we die, where the system can do that."""
    guard = shutil.which("setpriv")
    return [guard, "--pdeathsig", "TERM", "--", *command] if guard else command


class Rig:
    """Controller and drives as child processes; ends them on leaving.

    The children form their own session, so that Ctrl-C reaches only us and the axes can be stopped first;
    they get SIGTERM when we die. All are pinned to one core: waking across cores costs more than it gains.
    """

    def __init__(
        self, machine: Machine, address: BusAddress, pace: str, controller: str | None = None
    ) -> None:
        self._commands = [
            drive_command(machine, address),
            controller_command(machine, address, pace, controller),
        ]
        self._children: list[tuple[subprocess.Popen[bytes], IO[bytes]]] = []

    def __enter__(self) -> Rig:
        try:
            for command in self._commands:
                self._spawn(command)
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _spawn(self, command: list[str]) -> None:
        output = tempfile.TemporaryFile()  # noqa: SIM115  (lives as long as the child)
        child = subprocess.Popen(
            guarded(command),
            stdin=subprocess.DEVNULL,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        self._children.append((child, output))
        with suppress(OSError):
            os.sched_setaffinity(child.pid, {max(os.sched_getaffinity(0))})

    @property
    def process_ids(self) -> list[int]:
        """Of the drives and of the controller, in this order."""
        return [child.pid for child, _ in self._children]

    def check(self) -> None:
        """Raises BusError with its last words when a child has ended."""
        for child, output in self._children:
            if child.poll() is not None:
                name = Path(_program(child)).name
                raise BusError(
                    f"{name} ended by itself (status {child.returncode}): {_last_line(output)}"
                )

    def end(self) -> None:
        """Ends all children: SIGTERM, and SIGKILL after five seconds."""
        for child, _ in reversed(self._children):
            if child.poll() is None:
                child.terminate()
        deadline = time.monotonic() + 5.0
        for child, output in self._children:
            try:
                child.wait(max(0.0, deadline - time.monotonic()))
            except subprocess.TimeoutExpired:
                child.kill()
                child.wait()
            output.close()
        self._children.clear()


def _program(child: subprocess.Popen[bytes]) -> str:
    words = (
        [str(word) for word in child.args] if isinstance(child.args, list) else [str(child.args)]
    )
    return words[4] if words[0].endswith("setpriv") else words[0]


def _last_line(output: IO[bytes]) -> str:
    size = output.seek(0, os.SEEK_END)
    output.seek(max(0, size - 2000))
    lines = output.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else "it said nothing"
