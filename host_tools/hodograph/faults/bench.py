# SPDX-License-Identifier: MIT
"""The test bench of fault cases as processes: controller on one bus, drives on another, the injector between them. Used
by faults/case_runner, faults/disturb and faults/uploads. Starts and ends processes; writes the fault rules into a
temporary folder.
"""

from __future__ import annotations

import json
import signal
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

from ..bus.address import BusAddress
from ..bus.processes import (
    Process,
    controller_command,
    drive_command,
    find_program,
    virtual_clock,
)
from ..config import Machine

INJECTOR = "hodograph-injector"


class FaultBench:
    """Processes of one case; a context manager that ends them."""

    def __init__(
        self,
        machine: Machine,
        bus: BusAddress,
        drives_bus: BusAddress,
        rules: str,
        *,
        one_process_each: bool,
    ) -> None:
        """`rules`: fault rules as text. `one_process_each`: each drive is a process; else one process has all."""
        self.machine, self.bus, self.drives_bus = machine, bus, drives_bus
        self._one_process_each = one_process_each
        self._folder = tempfile.TemporaryDirectory(prefix="hodograph-faults-")
        self._rules = Path(self._folder.name) / "rules"
        self._rules.write_text(rules)
        self.drives: list[Process] = []
        self._others: list[Process] = []
        self._gone: list[Process] = []

    def __enter__(self) -> FaultBench:
        self.clock = virtual_clock(self.bus)
        try:
            self.injector = self._start(
                "injector",
                [
                    str(find_program(INJECTOR)),
                    *("--bus", self.bus.channel, "--bus", self.drives_bus.channel),
                    *("--rules", str(self._rules), "--verbose"),
                ],
            )
            self.start_drives(faulty=True)
            self.start_controller()
        except BaseException:
            self.end()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self.end()

    def _start(self, name: str, command: list[str]) -> Process:
        process = Process(name, command, self.clock)
        self._others.append(process)
        return process

    def start_controller(self) -> None:
        """Starts a new controller."""
        pace = "fast" if self.clock is None else "real-time"
        command = controller_command(self.machine, self.bus, pace)
        self.controller = self._start(f"controller-{self.machine.node}", command)

    def start_drives(self, *, faulty: bool) -> None:
        """Starts new drives; `faulty`: with the fault rules."""
        more = ["--faults", str(self._rules)] if faulty else []
        axes = self.machine.axes
        groups = [(axis,) for axis in axes] if self._one_process_each else [axes]
        outputs = [
            self.machine.outputs,
            *[None] * len(axes),
        ]  # the I/O module is with the first drives
        self._gone += self.drives
        self.drives = [
            Process(
                f"drive-{group[0].node}",
                drive_command(replace(self.machine, axes=group, outputs=module), self.drives_bus)
                + more,
                self.clock,
            )
            for group, module in zip(groups, outputs, strict=False)
        ]

    def injections(self) -> list[dict[str, Any]]:
        """The faults that injector and drives have logged (sim/faults/fault_log.h), by time."""
        lines = []
        for process in (self.injector, *self._gone, *self.drives):
            lines += [line for line in process.text().splitlines() if line.startswith("{")]
        return sorted((json.loads(line) for line in lines), key=lambda event: int(event["t_ns"]))

    def complaints(self) -> list[str]:
        """The last output of each process that ended by itself."""
        return [
            f"a process ended by itself (status {process.child.returncode}): {process.text()[-300:]}"
            for process in (*self._others, *self.drives)
            if process.ended() and process.child.returncode not in (0, -signal.SIGKILL)
        ]

    def end(self) -> None:
        """Ends everything, the controller first."""
        for process in (*reversed(self._others), *self.drives, *self._gone):
            process.end()
        if self.clock is not None:
            self.clock.release()
        self._folder.cleanup()
