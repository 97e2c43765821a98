# SPDX-License-Identifier: MIT
"""First process inside user-mode Linux: starts commands and passes their streams over the serial line.

Called by init.sh as `python3 -I -S agent.py TTY`, from the folder of this file. It serves until the line is cut, and
then stops the kernel it runs in. Written to start quickly: few imports, no others of this package than frames.
"""

from __future__ import annotations

import json
import os
import resource
import select
import signal
import sys
import termios
import tty
from typing import Any

# No pathlib here: importing it takes longer than all the rest.
sys.path.insert(0, os.path.dirname(os.path.dirname(__file__)))  # noqa: PTH120
from vcan import frames

_GRACE_S = 2.0


class Job:
    """One running command."""

    def __init__(self, channel: int, request: dict[str, Any]) -> None:
        self.channel = channel
        self.status: int | None = None
        self.stdin_queue = bytearray()
        self.stdin_ended = False
        self.credit = {frames.STDOUT: frames.WINDOW, frames.STDERR: frames.WINDOW}
        inner_in, self.stdin = os.pipe()
        self.stdout, inner_out = os.pipe()
        self.stderr, inner_err = os.pipe()
        # Signals wait until the child is a command of its own, so that an early one is not lost.
        before = signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
        self.pid = os.fork()
        if self.pid == 0:
            _become(request, inner_in, inner_out, inner_err)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for fd in (inner_in, inner_out, inner_err):
            os.close(fd)
        os.set_blocking(self.stdin, False)
        self.outputs = {self.stdout: frames.STDOUT, self.stderr: frames.STDERR}
        for fd in self.outputs:
            os.set_blocking(fd, False)

    def close_stdin(self) -> None:
        if self.stdin >= 0:
            os.close(self.stdin)
            self.stdin = -1
        self.stdin_queue.clear()

    def close(self) -> None:
        self.close_stdin()
        for fd in self.outputs:
            os.close(fd)
        self.outputs = {}

    def signal(self, number: int) -> None:
        """To the command and its children; to itself alone while it is not yet the leader of a group."""
        for send in (os.killpg, os.kill):
            try:
                send(self.pid, number)
                return
            except ProcessLookupError:
                continue


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


class Agent:
    """The loop."""

    def __init__(self, line: int) -> None:
        self.line = line
        self.jobs: dict[int, Job] = {}
        self.decoder = frames.Decoder()
        self.unacknowledged = 0
        self.wake, wake_in = os.pipe()
        os.set_blocking(self.wake, False)
        os.set_blocking(wake_in, False)
        signal.set_wakeup_fd(wake_in, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)

    def send(self, kind: int, channel: int, payload: bytes = b"") -> None:
        view = memoryview(frames.encode(kind, channel, payload))
        if kind == frames.DATA:
            self.unacknowledged += len(view)
        while view:
            view = view[os.write(self.line, view) :]

    def serve(self) -> None:
        """Until the line is cut."""
        self.send(frames.READY, 0)
        while self._turn():
            pass

    def _turn(self) -> bool:
        readers: dict[int, Job] = {}
        writers: dict[int, Job] = {}
        for job in self.jobs.values():
            for fd, stream in job.outputs.items():
                if job.credit[stream] > 0 and self.unacknowledged < frames.LINE_OUT:
                    readers[fd] = job
            if job.stdin_queue:
                writers[job.stdin] = job
        ready, writable, _ = select.select([self.line, self.wake, *readers], list(writers), [])
        for fd in writable:
            self._feed(writers[fd])
        for fd in ready:
            if fd not in (self.line, self.wake):
                self._pass_on(readers[fd], fd)
        if self.wake in ready:
            os.read(self.wake, 512)
            self._reap()
        return self.line not in ready or self._receive()

    def _receive(self) -> bool:
        try:
            data = os.read(self.line, 65536)
        except OSError:
            return False
        self.send(frames.LINE_ACK, 0, frames.ACK.pack(len(data)))
        for kind, channel, payload in self.decoder.feed(data):
            if kind == frames.LINE_ACK:
                self.unacknowledged -= frames.ACK.unpack(payload)[0]
            elif kind == frames.OPEN:
                self.jobs[channel] = Job(channel, json.loads(payload))
            elif channel in self.jobs:
                self._order(self.jobs[channel], kind, payload)
        return bool(data)

    def _order(self, job: Job, kind: int, payload: bytes) -> None:
        if kind == frames.DATA and job.stdin >= 0:
            job.stdin_queue += payload[1:]
            job.stdin_ended = len(payload) == 1
            self._feed(job)
        elif kind == frames.CREDIT:
            stream, count = frames.COUNT.unpack(payload)
            job.credit[stream] += count
        elif kind == frames.SIGNAL:
            job.signal(frames.STATUS.unpack(payload)[0])
        elif kind == frames.CLOSE:
            self._drop(job)

    def _feed(self, job: Job) -> None:
        """Queue to the command's standard input."""
        if job.stdin < 0:
            return
        try:
            while job.stdin_queue:
                count = os.write(job.stdin, job.stdin_queue)
                del job.stdin_queue[:count]
                self.send(frames.CREDIT, job.channel, frames.COUNT.pack(frames.STDIN, count))
        except BlockingIOError:
            return
        except BrokenPipeError:
            job.close_stdin()
            return
        if job.stdin_ended:
            job.close_stdin()

    def _pass_on(self, job: Job, fd: int) -> bool:
        """Output of the command to the line; False when there is none now."""
        stream = job.outputs.get(fd)
        if stream is None:
            return False
        try:
            data = os.read(fd, min(frames.CHUNK, job.credit[stream]))
        except BlockingIOError:
            return False
        if data:
            job.credit[stream] -= len(data)
            self.send(frames.DATA, job.channel, bytes([stream]) + data)
        else:
            del job.outputs[fd]
            os.close(fd)
        self._finish_if_done(job)
        return bool(data)

    def _reap(self) -> None:
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return
            if pid == 0:
                return
            for job in list(self.jobs.values()):
                if job.pid == pid:
                    code = os.waitstatus_to_exitcode(status)
                    job.status = code if code >= 0 else 128 - code
                    self._finish_if_done(job)

    def _finish_if_done(self, job: Job) -> None:
        """The command has ended and its output up to then is out: what its children hold open does not count."""
        if job.status is None or job.channel not in self.jobs:
            return
        for fd, stream in list(job.outputs.items()):
            if job.credit[stream] <= 0 or select.select([fd], [], [], 0)[0]:
                if job.credit[stream] <= 0:
                    return
                self._pass_on(job, fd)
                return
        os.sync()
        self.send(frames.EXIT, job.channel, frames.STATUS.pack(job.status))
        job.close()
        del self.jobs[job.channel]

    def _drop(self, job: Job) -> None:
        """Nobody listens to this command any more: end it."""
        del self.jobs[job.channel]
        job.close()
        if job.status is None:
            job.signal(signal.SIGHUP)
            job.signal(signal.SIGTERM)
            if os.fork() == 0:
                select.select([], [], [], _GRACE_S)
                job.signal(signal.SIGKILL)
                os._exit(0)


def _raw(line: int) -> None:
    tty.setraw(line, termios.TCSANOW)
    state = termios.tcgetattr(line)
    state[2] |= termios.CLOCAL
    termios.tcsetattr(line, termios.TCSANOW, state)


def main() -> None:
    line = os.open(sys.argv[1], os.O_RDWR | os.O_NOCTTY)
    _raw(line)
    for limit in (resource.RLIMIT_RTPRIO, resource.RLIMIT_MEMLOCK, resource.RLIMIT_NICE):
        resource.setrlimit(limit, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    Agent(line).serve()


if __name__ == "__main__":
    main()
