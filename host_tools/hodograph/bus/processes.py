# SPDX-License-Identifier: MIT
"""The simulated machine as processes: controller and drives on a vcan interface or a local bus. Used by bus/, cli/,
faults/ and latency. Starts, signals and ends processes; their output goes to temporary files.
"""

from __future__ import annotations

import os
import platform
import shlex
import shutil
import signal
import subprocess
import tempfile
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from ..errors import BusError
from ..names import INTEGRALS, INTERPOLATIONS, SPEEDS
from .address import BusAddress
from .clock import VirtualClock, hub_clock

if TYPE_CHECKING:
    from ..config import Axis, Drive, Machine

CONTROLLER, DRIVE = "hodograph-controller", "hodograph-drive"
END_S = 8.0
"""Longest wait for the end of a process: a controller stops the axes and switches them off within 6 s."""
_PACKAGE = Path(__file__).resolve().parents[1]
_REPOSITORY = _PACKAGE.parents[1]


def find_program(name: str) -> Path:
    """An executable that was installed with this package, or is in build/bin, or on $PATH. Raises BusError when there
    is none.
    """
    for folder in (_PACKAGE / "bin", _REPOSITORY / "build" / "bin"):
        if os.access(folder / name, os.X_OK):
            return folder / name
    found = shutil.which(name)
    if found is None and platform.system() != "Linux":
        raise BusError(
            f"{name} runs on Linux only: use the container or a Linux computer (docs/guides/windows-macos.md)"
        )
    if found is None:
        raise BusError(
            f"{name} is not there (looked for {_REPOSITORY / 'build' / 'bin' / name} and in PATH): "
            "install the package, or run make build in the source tree"
        )
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
    """Command line of the one process that simulates all drives, and the I/O module."""
    command = [str(find_program(DRIVE)), "--bus", address.channel]
    for axis, drive in zip(machine.axes, machine.models(machine.axes), strict=True):
        command += ["--axis", _axis_text(axis, drive)]
    if machine.outputs is not None:
        command += ["--module", str(machine.outputs.node)]
    return command


def _axis_text(axis: Axis, drive: Drive) -> str:
    values: dict[str, float] = {
        "node": axis.node,
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
        "counts_per_mm": axis.counts_per_unit,
        "position_mm": 0,
        "interpolation": INTERPOLATIONS.index(drive.interpolation),
        "speed": SPEEDS.index(drive.speed),
        "delay_samples": drive.delay_samples,
        "integral": INTEGRALS.index(drive.integral),
        **drive.equipment.given(),
    }
    return ",".join(f"{key}={value:.17g}" for key, value in values.items())


def guarded(command: list[str]) -> list[str]:
    """The command, changed so that the process gets SIGTERM when this one dies, if the operating system can do that."""
    guard = shutil.which("setpriv")
    return [guard, "--pdeathsig", "TERM", "--", *command] if guard else command


class Process:
    """A child process with its output. In virtual time (`clock`) it takes part under `name`.

    It has its own session, so that Ctrl-C reaches only this process and the axes can be stopped first. It gets SIGTERM
    when this process dies. All are pinned to one core: wake-ups across cores cost more than they gain.
    """

    def __init__(self, name: str, command: list[str], clock: VirtualClock | None = None) -> None:
        self.name = name
        self._clock = clock
        self._program = Path(command[0]).name
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  (lives as long as the child)

        def start(environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
            return subprocess.Popen(
                guarded(command),
                stdin=subprocess.DEVNULL,
                stdout=self._output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env={**os.environ, **environment},
            )

        self.child = start({}) if clock is None else clock.spawn(name, start)
        with suppress(OSError):
            os.sched_setaffinity(self.child.pid, {max(os.sched_getaffinity(0))})

    def ended(self) -> bool:
        """Whether it has ended."""
        return self.child.poll() is not None

    def check(self) -> None:
        """Raises BusError with the end of its output if it has ended."""
        if self.ended():
            raise BusError(
                f"{self._program} ended by itself (status {self.child.returncode}): {self._last_line()}"
            )

    def kill(self) -> None:
        """Kills it, like a crash."""
        if self._clock is not None and not self.ended():
            self._clock.kill(self.name, self.child)
        else:
            self.child.kill()
            self.child.wait()

    def text(self) -> str:
        """Whole output of the process."""
        self._output.seek(0)
        return self._output.read().decode(errors="replace")

    def _last_line(self) -> str:
        lines = self.text()[-2000:].strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def ask_to_end(self) -> None:
        """Sends SIGTERM."""
        if self.ended():
            return
        if self._clock is not None:
            self._clock.signal(self.name, self.child, signal.SIGTERM)
        else:
            self.child.terminate()

    def end(self, wait_s: float = END_S) -> None:
        """Sends SIGTERM, and SIGKILL after `wait_s`."""
        try:
            self.ask_to_end()
            if self._clock is not None:
                self._clock.await_end(self.name, self.child, wait_s)
            else:
                self.child.wait(wait_s)
        except (subprocess.TimeoutExpired, BusError):
            self.child.kill()
            self.child.wait()
        self._output.close()


def virtual_clock(address: BusAddress) -> VirtualClock | None:
    """The participant in the virtual time of a bus; the caller has to release it. None: its time is real. Raises
    BusError.
    """
    if not address.is_local:
        return None
    try:
        return hub_clock(address.channel)
    except OSError as error:
        raise BusError(
            f"{address}: no hub serves it: start hodograph-hub {address.channel} ({error})"
        ) from None


class SimulatedMachine:
    """Controller and drives as child processes; ends them on leaving."""

    def __init__(
        self, machine: Machine, address: BusAddress, pace: str, controller: str | None = None
    ) -> None:
        self._machine, self._address, self._pace = machine, address, pace
        self._program = controller
        self._clock: VirtualClock | None = None
        self._children: list[Process] = []

    def __enter__(self) -> SimulatedMachine:
        self._clock = virtual_clock(self._address)
        # In virtual time a tick takes only its computing time, so skipping the time between ticks gains nothing.
        pace = self._pace if self._clock is None else "real-time"
        try:
            self._spawn("drives", drive_command(self._machine, self._address))
            command = controller_command(self._machine, self._address, pace, self._program)
            self._spawn(f"controller-{self._machine.node}", command)
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _spawn(self, name: str, command: list[str]) -> None:
        self._children.append(Process(name, command, self._clock))

    @property
    def processes(self) -> tuple[Process, Process]:
        """The drives and the controller."""
        drives, controller = self._children
        return drives, controller

    def check(self) -> None:
        """Raises BusError with the end of its output if a child has ended."""
        for child in self._children:
            child.check()

    def end(self) -> None:
        """Ends all children, the controller first."""
        for child in reversed(self._children):
            child.end()
        self._children.clear()
        if self._clock is not None:
            self._clock.release()
            self._clock = None
