# SPDX-License-Identifier: MIT
"""One stream of bytes between `tools/with-vcan` and user-mode Linux: base class of a command (vcan/job) and of a TCP
connection (vcan/connection). Used by vcan/agent, vcan/connection and vcan/job, inside of that kernel. Closes
descriptors; no other I/O.
"""

from __future__ import annotations

import os

from vcan import frames


class Channel:
    """One channel of the line. Descriptors do not block."""

    def __init__(self, number: int, stdin: int, outputs: dict[int, int]) -> None:
        self.number = number
        self.stdin = stdin
        self.outputs = outputs
        """Descriptors to read from, and their streams."""
        self.status: int | None = None
        """Once it is known how it ended."""
        self.stdin_queue = bytearray()
        self.stdin_ended = False
        self.credit = {frames.STDOUT: frames.WINDOW, frames.STDERR: frames.WINDOW}

    def close_stdin(self) -> None:
        """Closes the input."""
        if self.stdin >= 0:
            os.close(self.stdin)
            self.stdin = -1
        self.stdin_queue.clear()

    def output_ended(self, fd: int, trouble: int) -> None:
        """Nothing more comes from this descriptor, because of errno `trouble` or in order (0)."""
        del self.outputs[fd]
        os.close(fd)

    def close(self) -> None:
        """Closes all descriptors."""
        self.close_stdin()
        for fd in self.outputs:
            os.close(fd)
        self.outputs = {}

    def signal(self, number: int) -> None:
        """Sends a signal to the command."""

    def abandon(self) -> None:
        """The client is gone: closes the channel."""
