# SPDX-License-Identifier: MIT
"""Opens the controller of a machine on a bus, and waits for the operator at program stops. Used by cli/run_command and
cli/stream_command. On a virtual bus it may start a simulated machine; it reads stdin, and prints to stderr.
"""

from __future__ import annotations

import select
import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager

from ..bus.address import BusAddress
from ..bus.run import RunSession, run_session
from ..config import Machine
from ..errors import InputError
from ..job_run import BusCheck
from .output import note


@contextmanager
def session(machine: Machine, address: BusAddress, options: Namespace) -> Iterator[RunSession]:
    """The controller of a machine on a bus, by the options of run and stream."""
    with run_session(
        machine, address, options.pace or "real-time", options.wait, note, options.controller
    ) as at:
        if options.pace is not None and at.pace is None:
            note("--pace has no effect on a controller that is running already")
        if options.controller is not None and at.pace is None:
            note("--controller has no effect where one is running already")
        yield at


def pass_stop(text: str, check_bus: BusCheck) -> None:
    """Continues at a program stop without waiting."""
    check_bus()
    note(f"{text}: passed without waiting (--no-stops)")


def await_enter(text: str, check_bus: BusCheck) -> None:
    """Waits at a program stop until Enter is pressed."""
    note(f"{text}: waits for Enter; Ctrl-C ends the job")
    while True:
        check_bus()
        if select.select([sys.stdin], [], [], 0.0)[0]:
            if not sys.stdin.readline():
                raise InputError(f"{text}: standard input has ended: the job ends here")
            return
