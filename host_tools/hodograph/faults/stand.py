# SPDX-License-Identifier: MIT
"""The machine under test as processes: controller on one bus, drives on another, the injector between them."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..bus.address import BusAddress
from ..bus.processes import controller_command, drive_command, find_program, guarded
from ..config import Machine

INJECTOR = "hodograph-injector"


class Process:
    """A child and what it says."""

    def __init__(self, command: list[str]) -> None:
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  (lives as long as the child)
        self.child = subprocess.Popen(
            guarded(command),
            stdin=subprocess.DEVNULL,
            stdout=self._output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
        with suppress(OSError):
            os.sched_setaffinity(self.child.pid, {max(os.sched_getaffinity(0))})

    def kill(self) -> None:
        """As a crash would end it."""
        self.child.send_signal(signal.SIGKILL)
        self.child.wait()

    def ended(self) -> bool:
        """Whether it has ended, by itself or by us."""
        return self.child.poll() is not None

    def text(self) -> str:
        """All it has said."""
        self._output.seek(0)
        return self._output.read().decode(errors="replace")

    def end(self) -> None:
        """SIGTERM, SIGKILL after two seconds."""
        if not self.ended():
            self.child.terminate()
            try:
                self.child.wait(2.0)
            except subprocess.TimeoutExpired:
                self.kill()
        self._output.close()


class Stand:
    """Processes of one case; a context manager that ends them."""

    def __init__(
        self, machine: Machine, bus: BusAddress, drives_bus: BusAddress, rules: str, *, apart: bool
    ) -> None:
        """`apart`: each drive is a process of its own."""
        self.machine, self.bus, self.drives_bus = machine, bus, drives_bus
        self._apart = apart
        self._folder = tempfile.TemporaryDirectory(prefix="hodograph-faults-")
        self._rules = Path(self._folder.name) / "rules"
        self._rules.write_text(rules)
        self.drives: list[Process] = []
        self._others: list[Process] = []
        self._gone: list[Process] = []

    def __enter__(self) -> Stand:
        try:
            self.injector = self._start(
                [
                    str(find_program(INJECTOR)),
                    *("--bus", self.bus.channel, "--bus", self.drives_bus.channel),
                    *("--rules", str(self._rules), "--verbose"),
                ]
            )
            self.start_drives(faulty=True)
            self.start_controller()
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _start(self, command: list[str]) -> Process:
        process = Process(command)
        self._others.append(process)
        return process

    def start_controller(self) -> None:
        """A fresh controller."""
        self.controller = self._start(controller_command(self.machine, self.bus, "fast"))

    def start_drives(self, *, faulty: bool) -> None:
        """Fresh drives, with the rules or without."""
        more = ["--faults", str(self._rules)] if faulty else []
        axes = self.machine.axes
        groups = [(axis,) for axis in axes] if self._apart else [axes]
        self._gone += self.drives
        self.drives = [
            Process(drive_command(replace(self.machine, axes=group), self.drives_bus) + more)
            for group in groups
        ]

    def injections(self) -> list[dict[str, Any]]:
        """What injector and drives say they did (sim/faults/fault_log.h), in time."""
        lines = []
        for process in (self.injector, *self._gone, *self.drives):
            lines += [line for line in process.text().splitlines() if line.startswith("{")]
        return sorted((json.loads(line) for line in lines), key=lambda event: int(event["t_ns"]))

    def complaints(self) -> list[str]:
        """What a process said that ended by itself."""
        return [
            f"a process ended by itself (status {process.child.returncode}): {process.text()[-300:]}"
            for process in (*self._others, *self.drives)
            if process.ended() and process.child.returncode not in (0, -signal.SIGKILL)
        ]

    def end(self) -> None:
        """Ends everything, the controller first."""
        for process in (*reversed(self._others), *self.drives, *self._gone):
            process.end()
        self._folder.cleanup()
