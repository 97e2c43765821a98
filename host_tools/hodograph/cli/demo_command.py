# SPDX-License-Identifier: MIT
"""hodograph demo: path, program, run and report of one example that the package contains. Started by cli/main. Starts
processes, opens a browser, writes the report, prints to stdout and stderr, and reads stdin.
"""

from __future__ import annotations

import re
import socket
import sys
import time
import webbrowser
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager

from ..bus.address import BusAddress
from ..bus.hub import LocalHub
from ..bus.processes import Process
from ..bus.run import run_program, run_session
from ..data import EXAMPLES
from ..pipeline import load_pipeline
from ..report import write_report
from .motion_commands import print_run
from .output import note, print_json, progress, require_places
from .waiting import held

_PROGRAM = EXAMPLES / "alpha.toml"
_WAIT_S = 10.0
_LOOK_S = 0.02
_URL = re.compile(r"http://\S+(?=\s)")


def demo(options: Namespace) -> None:
    """hodograph demo."""
    require_places(folders=[options.output])
    pipeline = load_pipeline(_PROGRAM)
    machine = pipeline.machine
    with LocalHub(speed=1.0) as hub, _live_page(hub.address) as url:
        note(f"live page: {url}")
        opened = not options.no_browser and webbrowser.open(url)
        with (
            run_session(machine, hub.address, "real-time", _WAIT_S, note) as at,
            progress("demo", "tick", pipeline.program.ticks) as bar,
        ):
            result = run_program(at, machine, pipeline.image, machine.kernel, bar)
        report = write_report([(pipeline, result.motion, result)], options.output)
        note(f"report: {report}")
        if options.json:
            print_json(result.summary() | {"page": url, "report": str(report)})
        else:
            print_run("alpha, the first example of the paper", result)
        sys.stdout.flush()
        if opened and sys.stdin.isatty():
            with held():
                input("Enter ends the live page. ")


@contextmanager
def _live_page(address: BusAddress) -> Iterator[str]:
    """Starts `hodograph monitor` on this bus as a process; returns its address. Raises BusError: it does not start."""
    command = [sys.executable, "-m", "hodograph", "monitor", "--bus", str(address)]
    command += ["--program", str(_PROGRAM), "--port", str(_free_port())]
    page = Process("live page", command)
    try:
        while (found := _URL.search(page.text())) is None:
            page.check()
            time.sleep(_LOOK_S)
        yield found[0]
    finally:
        page.end()


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


COMMANDS = {"demo": demo}
