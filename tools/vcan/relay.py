# SPDX-License-Identifier: MIT
"""Forwards TCP connections to a port beside the bus: through the broker into user-mode Linux, or into a network
namespace (`tools/with-vcan --forward`). Used by vcan/forward. Starts a thread or a process; sends and receives on TCP
sockets.
"""

from __future__ import annotations

import asyncio
import contextlib
import os
import socket
import threading
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path

from vcan import frames

Streams = tuple[asyncio.StreamReader, asyncio.StreamWriter]
Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter, int], Awaitable[None]]


def start_thread(ports: Sequence[int], listeners: Sequence[socket.socket], broker: Path) -> None:
    """To these ports inside user-mode Linux, until this process ends."""

    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int) -> None:
        line = await asyncio.open_unix_connection(str(broker))
        await _Tunnel((reader, writer), line).run(port)

    threading.Thread(
        target=lambda: asyncio.run(_serve(ports, listeners, serve)), daemon=True
    ).start()


def start_process(ports: Sequence[int], listeners: Sequence[socket.socket]) -> None:
    """To these ports of the network namespace that this process is in; see forward.beside."""
    command = os.pidfd_open(os.getpid())
    first = os.fork()
    if first == 0:
        if os.fork() == 0:  # so that the command gets no child that it knows nothing of
            _become_relay(ports, listeners, command)
        os._exit(0)
    os.waitpid(first, 0)
    os.close(command)
    for listener in listeners:
        listener.close()


def _become_relay(ports: Sequence[int], listeners: Sequence[socket.socket], command: int) -> None:
    try:
        null = os.open(os.devnull, os.O_RDWR)
        for fd in (0, 1, 2):
            os.dup2(null, fd)
        os.setsid()
        asyncio.run(_relay(ports, listeners, command))
    finally:
        os._exit(0)


async def _relay(ports: Sequence[int], listeners: Sequence[socket.socket], command: int) -> None:
    async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter, port: int) -> None:
        inner_reader, inner_writer = await asyncio.open_connection("127.0.0.1", port)
        await asyncio.gather(_copy(reader, inner_writer), _copy(inner_reader, writer))

    ended = asyncio.Event()
    asyncio.get_running_loop().add_reader(command, ended.set)
    serving = asyncio.create_task(_serve(ports, listeners, serve))
    await ended.wait()
    serving.cancel()


async def _copy(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    """One direction, its end included."""
    with contextlib.suppress(OSError):
        while data := await reader.read(65536):
            writer.write(data)
            await writer.drain()
    with contextlib.suppress(OSError):
        if writer.can_write_eof():
            writer.write_eof()


async def _serve(ports: Sequence[int], listeners: Sequence[socket.socket], serve: Serve) -> None:
    async with contextlib.AsyncExitStack() as stack:
        for port, listener in zip(ports, listeners, strict=True):
            accept = _accepting(serve, port)
            await stack.enter_async_context(await asyncio.start_server(accept, sock=listener))
        await asyncio.Event().wait()


def _accepting(
    serve: Serve, port: int
) -> Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]:
    async def accept(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            with contextlib.suppress(OSError):
                await serve(reader, writer, port)
        finally:
            writer.close()

    return accept


class _Tunnel:
    """One connection as a channel of the broker (frames.py)."""

    def __init__(self, here: Streams, line: Streams) -> None:
        self._here, self._line = here, line
        self._credit = frames.WINDOW
        self._more = asyncio.Event()

    async def run(self, port: int) -> None:
        """Until either side has ended it."""
        self._line[1].write(frames.encode(frames.CONNECT, 0, frames.PORT.pack(port)))
        inward = asyncio.create_task(self._inward())
        try:
            await self._outward()
        finally:
            inward.cancel()
            self._line[1].close()

    async def _inward(self) -> None:
        writer = self._line[1]
        data = b"-"
        with contextlib.suppress(OSError):
            while data:
                while self._credit <= 0:
                    self._more.clear()
                    await self._more.wait()
                data = await self._here[0].read(min(frames.CHUNK, self._credit))
                self._credit -= len(data)
                writer.write(frames.encode(frames.DATA, 0, bytes([frames.STDIN]) + data))
                await writer.drain()

    async def _outward(self) -> None:
        decoder = frames.Decoder()
        while data := await self._line[0].read(65536):
            for kind, _, payload in decoder.feed(data):
                if kind in (frames.EXIT, frames.FAIL):
                    return
                if kind == frames.CREDIT:
                    self._credit += frames.COUNT.unpack(payload)[1]
                    self._more.set()
                elif kind == frames.DATA:
                    await self._give(payload[1:])

    async def _give(self, data: bytes) -> None:
        self._here[1].write(data)
        await self._here[1].drain()
        credit = frames.COUNT.pack(frames.STDOUT, len(data))
        self._line[1].write(frames.encode(frames.CREDIT, 0, credit))
