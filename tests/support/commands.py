# SPDX-License-Identifier: MIT
"""`hodograph` commands: as processes in virtual time, or in the test itself. Used by tests of commands. Starts
processes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import pytest

from hodograph.bus.clock import VirtualClock
from hodograph.cli.main import main

LIMIT_S = 120.0
"""Of virtual time: for whatever a command waits for."""
LOOK_S = 0.01


class Command:
    """A command that runs beside the test; time passes for it while the test waits."""

    def __init__(self, clock: VirtualClock, words: tuple[str, ...], name: str) -> None:
        self._clock, self._name = clock, name
        self._out, self._err = tempfile.TemporaryFile(), tempfile.TemporaryFile()  # noqa: SIM115

        def start(environment: Mapping[str, str]) -> subprocess.Popen[bytes]:
            return subprocess.Popen(
                [sys.executable, "-m", "hodograph", *words],
                stdin=subprocess.DEVNULL,
                stdout=self._out,
                stderr=self._err,
                env={**os.environ, **environment},
            )

        self.child = clock.spawn(name, start)

    @property
    def out(self) -> str:
        """What it has said on stdout so far."""
        return _text(self._out)

    @property
    def err(self) -> str:
        """And on stderr."""
        return _text(self._err)

    def wait(self, limit_s: float = LIMIT_S) -> int:
        """Its exit status."""
        return self._clock.await_end(self._name, self.child, limit_s)

    def signal(self, number: int) -> None:
        """Sends a signal, which it acts on at once."""
        self._clock.signal(self._name, self.child, number)

    def kill(self) -> None:
        """As a crash would end it."""
        self._clock.kill(self._name, self.child)

    def await_text(self, text: str, limit_s: float = LIMIT_S) -> None:
        """Until it has said this, on either."""
        end_s = self._clock.now_s() + limit_s
        while text not in self.out and text not in self.err:
            assert self.child.poll() is None, f"it ended without {text!r}: {self.out}{self.err}"
            assert self._clock.now_s() < end_s, (
                f"no {text!r} in {limit_s:g} s: {self.out}{self.err}"
            )
            self._clock.sleep(LOOK_S)

    def close(self) -> None:
        """Ends it if it still runs."""
        if self.child.poll() is None:
            self.child.kill()
            self.child.wait()
        self._out.close()
        self._err.close()


@contextmanager
def running(clock: VirtualClock, *words: str, name: str = "command") -> Iterator[Command]:
    """A command that runs while the context is open. Several at once need names of their own."""
    command = Command(clock, words, name)
    try:
        yield command
    finally:
        command.close()


def run_command(clock: VirtualClock, *words: str) -> subprocess.CompletedProcess[str]:
    """A command from start to end."""
    with running(clock, *words) as command:
        status = command.wait()
        return subprocess.CompletedProcess(words, status, command.out, command.err)


def result(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    """The JSON document that a command prints, run in this thread; it has to succeed."""
    capsys.readouterr()
    status = main(arguments)
    out, err = capsys.readouterr()
    assert status == 0, err
    return json.loads(out)


def _text(file: tempfile._TemporaryFileWrapper[bytes]) -> str:
    file.seek(0)
    return file.read().decode()
