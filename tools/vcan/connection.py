# SPDX-License-Identifier: MIT
"""A TCP connection to a port inside user-mode Linux, which a forwarder outside has requested. Used by vcan/agent. Opens
a socket.
"""

from __future__ import annotations

import contextlib
import os
import socket

from vcan import frames
from vcan.channel import Channel


class Connection(Channel):
    """One connection; its end is reported like the exit of a command: 0, or the errno of what went wrong."""

    def __init__(self, number: int, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        # A refusal shows as an error when it is read from.
        self._socket.connect_ex(("127.0.0.1", port))
        reader = os.dup(self._socket.fileno())
        super().__init__(number, os.dup(self._socket.fileno()), {reader: frames.STDOUT})

    def close_stdin(self) -> None:
        """Informs the other side that nothing more comes."""
        if self.stdin >= 0:
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_WR)
        super().close_stdin()

    def output_ended(self, fd: int, trouble: int) -> None:
        """The other side has ended the connection, or could not be reached."""
        super().output_ended(fd, trouble)
        self.status = trouble

    def close(self) -> None:
        """Closes all descriptors."""
        super().close()
        self._socket.close()
