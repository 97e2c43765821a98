# SPDX-License-Identifier: MIT
"""Shows a line with the name and the running time of a command on the terminal while it computes, when it has written
nothing for AFTER_S seconds. Used by cli/demo_command, cli/main and cli/output. A thread writes to stderr; sys.stdout is
replaced until the command ends. Nothing happens if stderr is no terminal.

The line disappears before other output is written. It is never written to files and pipes.
"""

from __future__ import annotations

import os
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from typing import Any, TextIO

AFTER_S, EVERY_S = 2.0, 0.5


def is_terminal(stream: TextIO) -> bool:
    """Whether a stream is a terminal on which lines can be rewritten."""
    return stream.isatty() and os.environ.get("TERM") != "dumb"


class _Line:
    """The line, written by a thread of its own."""

    def __init__(self, title: str, stream: TextIO) -> None:
        self._title, self._stream = title, stream
        self._lock = threading.RLock()
        self._ended = threading.Event()
        self._begun_s = time.monotonic()
        self._due_s = self._begun_s + AFTER_S
        self._shown = False
        self._held = 0
        self._thread = threading.Thread(target=self._go_on, daemon=True)

    def _go_on(self) -> None:
        while not self._ended.wait(EVERY_S):
            with self._lock:
                if not self._held and not self._ended.is_set() and time.monotonic() >= self._due_s:
                    self._stream.write(
                        f"\r{self._title}: {time.monotonic() - self._begun_s:.0f} s\x1b[K"
                    )
                    self._stream.flush()
                    self._shown = True

    def begin(self) -> None:
        """Starts the thread."""
        self._thread.start()

    def end(self) -> None:
        """Ends the thread and removes the line."""
        self._ended.set()
        self._thread.join()
        self.remove()

    def remove(self) -> None:
        """Removes the line; it appears again if nothing else is written for AFTER_S."""
        with self._lock:
            if self._shown:
                self._stream.write("\r\x1b[K")
                self._stream.flush()
            self._shown = False
            self._due_s = time.monotonic() + AFTER_S

    def hold(self, by: int) -> None:
        """Counts other writers of lines, during which the line stays hidden."""
        with self._lock:
            self._held += by
            self.remove()


_line: _Line | None = None


class _Before:
    """A stream that removes the line before each write."""

    def __init__(self, stream: TextIO, line: _Line) -> None:
        self._stream, self._line = stream, line

    def write(self, text: str) -> int:
        """See the wrapped stream."""
        self._line.remove()
        return self._stream.write(text)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)


@contextmanager
def waiting(title: str) -> Iterator[None]:
    """Shows the line while the context is open, if stderr is a terminal."""
    global _line
    if not is_terminal(sys.stderr):
        yield
        return
    line = _line = _Line(title, sys.stderr)
    line.begin()
    out: Any = _Before(sys.stdout, line)
    try:
        with redirect_stdout(out):
            yield
    finally:
        _line = None
        line.end()


def remove_line() -> None:
    """Removes the line before a note is written."""
    if _line is not None:
        _line.remove()


@contextmanager
def held() -> Iterator[None]:
    """Hides the line while there is a progress bar."""
    if _line is None:
        yield
        return
    line = _line
    line.hold(1)
    try:
        yield
    finally:
        line.hold(-1)
