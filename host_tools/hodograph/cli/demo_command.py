# SPDX-License-Identifier: MIT
"""hodograph demo: path, program, run and report once, with nothing but what the package brings."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import webbrowser
from argparse import Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from typing import IO

from ..bus.address import BusAddress
from ..bus.hub import LocalHub
from ..bus.processes import guarded
from ..bus.run import run_program, run_session
from ..data import EXAMPLES
from ..errors import BusError
from ..pipeline import load_pipeline
from ..report import write_report
from .motion_commands import print_run
from .output import note, print_json, progress

_PROGRAM = EXAMPLES / "alpha.toml"
_WAIT_S = 10.0
_URL = "http://"


def demo(options: Namespace) -> None:
    """hodograph demo."""
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
            input("Enter ends the live page. ")


@contextmanager
def _live_page(address: BusAddress) -> Iterator[str]:
    """`hodograph monitor` on this bus as a process of its own; its address. Raises BusError when it does not start."""
    command = [sys.executable, "-m", "hodograph", "monitor", "--bus", str(address)]
    command += ["--program", str(_PROGRAM), "--port", str(_free_port())]
    with tempfile.TemporaryFile("w+") as said:
        page = subprocess.Popen(
            guarded(command), stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
        )
        try:
            yield _url(page, said)
        finally:
            page.terminate()
            page.wait()
            if page.stderr is not None:
                page.stderr.close()


def _url(page: subprocess.Popen[str], said: IO[str]) -> str:
    assert page.stderr is not None
    for line in page.stderr:
        said.write(line)
        if _URL in line:
            return line[line.index(_URL) :].strip()
    said.seek(0)
    lines = said.read().strip().splitlines()
    raise BusError(
        f"demo: the live page did not start: {lines[-1] if lines else 'it said nothing'}"
    )


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


COMMANDS = {"demo": demo}
