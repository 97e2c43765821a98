# SPDX-License-Identifier: MIT
"""First process inside user-mode Linux: starts commands, opens connections, passes their streams over the serial line.

Started by init.sh as `python3 -I -S agent.py TTY`, from the folder of this file. It serves until the line is cut, and
then stops the kernel it runs in. Written to start quickly: few imports.
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

# No pathlib here: importing it takes longer than all the rest.
sys.path.insert(0, os.path.dirname(os.path.dirname(__file__)))  # noqa: PTH120
from vcan import frames
from vcan.channel import Channel
from vcan.job import Job


class Agent:
    """The loop."""

    def __init__(self, line: int) -> None:
        self.line = line
        self.channels: dict[int, Channel] = {}
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
        readers: dict[int, Channel] = {}
        writers: dict[int, Channel] = {}
        for it in self.channels.values():
            for fd, stream in it.outputs.items():
                if it.credit[stream] > 0 and self.unacknowledged < frames.LINE_OUT:
                    readers[fd] = it
            if it.stdin_queue:
                writers[it.stdin] = it
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
                self.channels[channel] = Job(channel, json.loads(payload))
            elif kind == frames.CONNECT:
                self.channels[channel] = _connection(channel, payload)
            elif channel in self.channels:
                self._order(self.channels[channel], kind, payload)
        return bool(data)

    def _order(self, it: Channel, kind: int, payload: bytes) -> None:
        if kind == frames.DATA and it.stdin >= 0:
            it.stdin_queue += payload[1:]
            it.stdin_ended = len(payload) == 1
            self._feed(it)
        elif kind == frames.CREDIT:
            stream, count = frames.COUNT.unpack(payload)
            it.credit[stream] += count
        elif kind == frames.SIGNAL:
            it.signal(frames.STATUS.unpack(payload)[0])
        elif kind == frames.CLOSE:
            self._drop(it)

    def _feed(self, it: Channel) -> None:
        """Queue to the command's standard input."""
        if it.stdin < 0:
            return
        try:
            while it.stdin_queue:
                count = os.write(it.stdin, it.stdin_queue)
                del it.stdin_queue[:count]
                self.send(frames.CREDIT, it.number, frames.COUNT.pack(frames.STDIN, count))
        except BlockingIOError:
            return
        except OSError:  # the reader is gone
            it.close_stdin()
            return
        if it.stdin_ended:
            it.close_stdin()

    def _pass_on(self, it: Channel, fd: int) -> bool:
        """Output of the command to the line; False when there is none now."""
        stream = it.outputs.get(fd)
        if stream is None:
            return False
        trouble, data = 0, b""
        try:
            data = os.read(fd, min(frames.CHUNK, it.credit[stream]))
        except BlockingIOError:
            return False
        except OSError as error:
            trouble = error.errno or 1
        if data:
            it.credit[stream] -= len(data)
            self.send(frames.DATA, it.number, bytes([stream]) + data)
        else:
            it.output_ended(fd, trouble)
        self._finish_if_done(it)
        return bool(data)

    def _reap(self) -> None:
        while True:
            try:
                pid, status = os.waitpid(-1, os.WNOHANG)
            except ChildProcessError:
                return
            if pid == 0:
                return
            for it in list(self.channels.values()):
                if isinstance(it, Job) and it.pid == pid:
                    code = os.waitstatus_to_exitcode(status)
                    it.status = code if code >= 0 else 128 - code
                    self._finish_if_done(it)

    def _finish_if_done(self, it: Channel) -> None:
        """The command has ended and its output up to then is out: what its children hold open does not count."""
        if it.status is None or it.number not in self.channels:
            return
        for fd, stream in list(it.outputs.items()):
            if it.credit[stream] <= 0 or select.select([fd], [], [], 0)[0]:
                if it.credit[stream] <= 0:
                    return
                self._pass_on(it, fd)
                return
        if isinstance(it, Job):
            os.sync()
        self.send(frames.EXIT, it.number, frames.STATUS.pack(it.status))
        it.close()
        del self.channels[it.number]

    def _drop(self, it: Channel) -> None:
        """The client of the channel is gone."""
        del self.channels[it.number]
        it.close()
        it.abandon()


def _connection(number: int, payload: bytes) -> Channel:
    from vcan.connection import Connection  # importing what it needs takes long, and few need it

    return Connection(number, frames.PORT.unpack(payload)[0])


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
