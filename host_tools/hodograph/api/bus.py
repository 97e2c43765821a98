# SPDX-License-Identifier: MIT
"""Machines on a bus: a local bus, and the controller as an object. Used by programs of users. Starts processes, reads
and writes objects of the controller by SDO, receives frames, and waits by the clock of the bus, real or virtual.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Literal

from ..bus.goto import goto, switch_on
from ..bus.hub import LocalHub
from ..bus.own_bus import bus_address
from ..bus.run import BusRun, RunSession, run_program, run_session
from ..bus.sdo import actions
from ..bus.sdo.controller import BOOT, DISABLE, HOLD, OFF, RESUME
from ..bus.sdo.status import read_status
from ..bustime import require_fit
from ..errors import InputError
from ..job_run import operator_stops, prepared, run_job
from .job import Job, JobRun
from .machine import Machine
from .program import Program, Run

Pace = Literal["real-time", "fast"]
Note = Callable[[str], None]


def _silent(text: str) -> None:
    del text


@contextmanager
def local_bus(speed: float | None = None) -> Iterator[str]:
    """A CAN bus within this computer, for simulated machines; needs neither root nor CAN in the Linux kernel.

    Gives its name, for `connect`. Its time is virtual: at most `speed` times as fast as real time (None: not limited).

    >>> with local_bus() as bus:
    ...     bus.startswith("local:")
    True
    """
    with LocalHub(speed=speed) as hub:
        yield str(hub.address)


class Controller:
    """The controller of a machine, on a bus; made by `connect`.

    Each method raises BusError if the controller does not answer, RefusedError if it refuses, RunError for a fault in
    motion.
    """

    def __init__(self, session: RunSession, machine: Machine) -> None:
        self._session, self._machine = session, machine
        self._node = session.controller

    @property
    def simulated(self) -> bool:
        """Whether `connect` started it, with simulated drives."""
        return self._session.rig is not None

    def configure(self) -> bool:
        """Writes the machine's configuration to the controller; returns whether an object was written."""
        machine = self._machine._file
        return self._node.configure(machine, machine.kernel)

    def home(self, wait_s: float = math.inf) -> None:
        """Finds the zero of each axis that has a homing method; drives are off before and after."""
        actions.home(self._node, wait_s)

    def enable(self) -> None:
        """Switches the drives on; returns at standstill. Raises RefusedError: an axis stands outside of its travel."""
        switch_on(self._node, self._machine._file)

    def disable(self) -> None:
        """Switches the drives off, at standstill."""
        self._node.command(DISABLE)
        self._node.wait_for((OFF, BOOT), actions.BOOT_S)

    def upload(self, program: Program) -> None:
        """Sends a program, which then is the loaded one. After a refusal the old program stays."""
        self._node.upload(program.image)

    def goto_start(self, program: Program, *, unhomed: bool = False) -> float:
        """Moves straight to the start of a program, with the drives on, then loads it; returns the distance in mm.

        unhomed   also if axes with a homing method are not homed

        Raises InputError for a loaded image that moves rotary axes alone: it does not contain the positions of the
        others.
        """
        start = program._start_counts()
        distance_mm = goto(self._node, self._machine._file, start, unhomed=unhomed)
        self.upload(program)
        return distance_mm

    def start(self, *, from_mm: float | None = None, unhomed: bool = False) -> None:
        """Starts the loaded program; returns at once.

        from_mm   start at this arc length, where the axes have to stand

        Raises InputError for an arc length that the path does not have.
        """
        self._node.start(from_mm=from_mm, unhomed=unhomed)

    def wait(self, wait_s: float = math.inf) -> None:
        """Returns when the program has ended, or has been stopped.

        Raises RunError for a fault, and if the drives are off.
        """
        self._node.wait_for_end(wait_s)

    def hold(self, wait_s: float = math.inf) -> bool:
        """Feed hold: waits for the standstill on the path; False: the program had ended before."""
        self._node.command(HOLD)
        return actions.hold_reached(self._node, wait_s)

    def resume(self) -> None:
        """Continues after `hold`."""
        self._node.command(RESUME)

    def stop(self) -> None:
        """Controlled stop: waits for the standstill on the path; the program ends. At standstill it ends a job of
        another client that rests, and switches the outputs off.
        """
        self._node.stop_and_wait()

    def reset(self) -> bool:
        """Resets a fault; the drives are off then. False: there was none."""
        return actions.reset(self._node)

    def override(self, percent: int) -> None:
        """Sets the feed override, 0 … 200, for this and later programs."""
        self._node.override(percent)

    def status(self) -> dict[str, Any]:
        """State of controller, drives and program, with the keys of `hodograph status --json` except `bus_load`."""
        return read_status(self._node)

    def sleep(self, seconds: float) -> None:
        """Waits by the clock of the bus, which is not this computer's on a local bus."""
        self._node.clock.sleep(seconds)

    def run(self, program: Program, *, unhomed: bool = False) -> Run:
        """Configures, switches the drives on, moves to the start, uploads, runs, records and analyses.

        Raises RunError for a fault in motion, and if the recorded setpoints are not those of the program.
        """
        moved = program._moved
        found = run_program(
            self._session,
            moved,
            program.image,
            moved.kernel,
            unhomed=unhomed,
            on=program.machine._file,
            start=program._start_counts(),
        )
        return _run_of(found)

    def run_job(
        self, job: Job, *, operator: Callable[[str], None] | None = None, unhomed: bool = False
    ) -> JobRun:
        """Runs all sections of a job: each as `run` does, with the dwells between them.

        operator   is called with the place and the code where the job waits for the operator (M0, M1, tool change), and
                   returns when the job may continue. None: such a job is refused before anything moves

        All sections are planned before the first one moves. A fault, a stop (also at rest) or a hold ends the job.
        Raises InputError, PlanError, and the errors of `run`.
        """
        made = prepared(job._job, job.machine._file.kernel)
        stops = list(operator_stops(job._job))
        if stops and operator is None:
            line, code = stops[0]
            raise InputError(
                f"{job._job.file}:{line}: {code} waits for the operator: give operator= to run_job"
            )

        def ask(text: str, check: Callable[[], None]) -> None:
            del check
            if operator is not None:
                operator(text)

        found = run_job(self._session, made, ask, unhomed=unhomed)
        return JobRun(tuple(map(_run_of, found.runs)), found.runs[0].bus)


def _run_of(found: BusRun) -> Run:
    return Run(found.motion, found.bus, found.deadline_misses)


@contextmanager
def connect(
    machine: Machine,
    bus: str | None = None,
    *,
    pace: Pace = "real-time",
    wait_s: float = 2.0,
    note: Note | None = None,
) -> Iterator[Controller]:
    """The machine's controller on a bus. On a virtual bus without one a simulated machine runs until the context ends.

    bus      "socketcan:can0", a name from `local_bus`, or another name for `hodograph --bus`; None: the bus of commands
             without --bus
    pace     of a controller started here: "fast" ticks as soon as the drives have answered
    wait_s   how long to wait for the controller
    note     takes lines for the user; None: they are dropped

    On an error the axes are stopped. Raises BusError, RefusedError if the axes already move or another process runs a
    job, and InputError for a machine whose frames do not fit its period.

    >>> from hodograph import load_plan, example_file
    >>> program = load_plan(example_file("star")).program()
    >>> with local_bus() as bus, connect(program.machine, bus) as controller:
    ...     run = controller.run(program)
    >>> run.setpoints_sha256 == program.simulate().setpoints_sha256
    True
    """
    require_fit(machine._file)
    with run_session(machine._file, bus_address(bus), pace, wait_s, note or _silent) as session:
        yield Controller(session, machine)
