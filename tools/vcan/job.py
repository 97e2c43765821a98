# SPDX-License-Identifier: MIT
"""A command that runs inside user-mode Linux, with its streams: one channel of the agent. Used by vcan/agent. Starts
the process, sends signals to it.
"""

from __future__ import annotations

import os
import select
import signal
from typing import Any

from vcan import frames
from vcan.channel import Channel

_GRACE_S = 2.0
"""Time that the processes have to end."""


class Job(Channel):
    """One running command."""

    def __init__(self, number: int, request: dict[str, Any]) -> None:
        inner_in, stdin = os.pipe()
        stdout, inner_out = os.pipe()
        stderr, inner_err = os.pipe()
        super().__init__(number, stdin, {stdout: frames.STDOUT, stderr: frames.STDERR})
        # Signals wait until the child is a command of its own, so that an early one is not lost.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        self.pid = os.fork()
        if self.pid == 0:
            _become(request, inner_in, inner_out, inner_err)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for fd in (inner_in, inner_out, inner_err):
            os.close(fd)
        for fd in (stdin, stdout, stderr):
            os.set_blocking(fd, False)

    def signal(self, number: int) -> None:
        """To the command and its children; to itself alone while it is not yet the leader of a group."""
        for send in (os.killpg, os.kill):
            try:
                send(self.pid, number)
                return
            except ProcessLookupError:
                continue

    def abandon(self) -> None:
        """Ends the command, at last by SIGKILL."""
        if self.status is not None:
            return
        self.signal(signal.SIGHUP)
        self.signal(signal.SIGTERM)
        if os.fork() == 0:
            select.select([], [], [], _GRACE_S)
            self.signal(signal.SIGKILL)
            os._exit(0)


def _become(request: dict[str, Any], stdin: int, stdout: int, stderr: int) -> None:
    """In the child: turns into the command, as the caller's user with its folder and environment."""
    status = 127
    try:
        os.setsid()
        for number, fd in enumerate((stdin, stdout, stderr)):
            os.dup2(fd, number)
        os.closerange(3, 256)
        signal.set_wakeup_fd(-1)
        for number in (signal.SIGCHLD, signal.SIGPIPE, signal.SIGINT, signal.SIGTERM):
            signal.signal(number, signal.SIG_DFL)
        signal.pthread_sigmask(signal.SIG_SETMASK, [])
        os.umask(request["umask"])
        os.setgroups(request["groups"])
        os.setgid(request["gid"])
        os.setuid(request["uid"])
        os.chdir(request["cwd"])
        os.execvpe(request["argv"][0], request["argv"], request["env"])
    except FileNotFoundError as error:
        os.write(2, f"with-vcan: cannot run {request['argv'][0]}: {error.strerror}\n".encode())
    except OSError as error:
        status = 126
        os.write(2, f"with-vcan: cannot run {request['argv'][0]}: {error.strerror}\n".encode())
    finally:
        os._exit(status)
