# SPDX-License-Identifier: MIT
"""The HTTP and WebSocket server of the live page: serves the page, sends it messages, takes its commands.

Runs in the asyncio loop of session.py and does not access the bus: commands go to a function of the caller.

Used by monitor/session. Reads the files of the page; receives and sends on sockets.
"""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable
from contextlib import suppress
from importlib.resources import files
from typing import Any

from aiohttp import WSMsgType, web

from ..errors import HodographError, InputError
from .clients import Broadcaster, Client, ClientSlots
from .messages import encode
from .security import HEADERS, Guard

_MOST_REQUEST = 4096
"""Greatest request, bytes."""
_HELLO_S = 10.0
"""Time in which a client has to send its first message."""
REQUEST_S = 10.0
"""Longest time for a whole request to come, on a new connection and between two requests; aiohttp counts its keep-alive
time from there.
"""
_WRONG_TOKEN_S = 0.5
"""Delay of the answer to a wrong token, so that tokens cannot be tried quickly."""
_BEAT_S = 10.0
"""Time between two pings, which show that a client is still there."""
MOST_COMMANDS = 512
"""Commands of all browsers that wait for the controller: a slider gives ten a second, and a wait ends after 30 s."""
_POLICY, _TOKEN_NEEDED = 1008, 4401
"""Close codes: not from this page, or no slot is free; the token is missing or wrong."""

_TYPES = {
    ".html": "text/html",
    ".css": "text/css",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
}

Execute = Callable[[dict[str, Any]], Awaitable[str]]
"""Executes the request of a browser that may command; returns a text. Raises HodographError."""


class Server:
    """The web application; `hello` is the first message to a page."""

    def __init__(
        self, guard: Guard, broadcaster: Broadcaster, hello: dict[str, Any], execute: Execute
    ) -> None:
        self._guard, self._broadcaster, self._hello, self._execute = (
            guard,
            broadcaster,
            hello,
            execute,
        )
        self._pages = _load_pages()
        self._slots: ClientSlots[web.WebSocketResponse] = ClientSlots()
        self._closing: set[asyncio.Task[None]] = set()
        self._commands: set[asyncio.Task[None]] = set()
        self.app = web.Application(middlewares=[self._check], client_max_size=_MOST_REQUEST)
        self.app.router.add_get("/ws", self._socket)
        self.app.router.add_get("/{name:[a-z_.]*}", self._page)
        self.app.on_shutdown.append(self._shut_down)

    def runner(self) -> web.AppRunner:
        """The runner of the application, which closes a connection whose request does not come within REQUEST_S."""
        return web.AppRunner(
            self.app, access_log=None, shutdown_timeout=2.0, keepalive_timeout=REQUEST_S
        )

    @web.middleware
    async def _check(
        self,
        request: web.Request,
        handler: Callable[[web.Request], Awaitable[web.StreamResponse]],
    ) -> web.StreamResponse:
        if not self._guard.knows_host(request.headers.get("Host")):
            return web.Response(
                status=421,
                headers=HEADERS,
                text="This name is not one of the monitor's machine: use the printed address.\n",
            )
        try:
            return await handler(request)
        except ConnectionError:  # the browser has left in the middle
            return web.Response(status=400, headers=HEADERS)

    async def _page(self, request: web.Request) -> web.Response:
        name = request.match_info["name"] or "index.html"
        if name not in self._pages:
            return web.Response(status=404, headers=HEADERS, text="There is no such page.\n")
        kind, body = self._pages[name]
        return web.Response(body=body, content_type=kind, charset="utf-8", headers=HEADERS)

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        origin, host = request.headers.get("Origin"), request.headers.get("Host")
        if not self._guard.knows_origin(origin, host):
            return web.Response(status=403, headers=HEADERS, text="Not from the monitor's page.\n")
        socket = web.WebSocketResponse(
            heartbeat=_BEAT_S, max_msg_size=_MOST_REQUEST, compress=False
        )
        if not socket.can_prepare(request).ok:
            return web.Response(status=426, headers=HEADERS, text="A WebSocket is wanted here.\n")
        await socket.prepare(request)
        try:
            self._send_away(self._slots.enter(socket))
            await self._serve(socket)
        finally:
            self._slots.leave(socket)
        return socket

    async def _serve(self, socket: web.WebSocketResponse) -> None:
        may_command = await self._authorise(socket)
        if may_command is None:
            return
        too_many = self._slots.take_slot(socket, may_command=may_command)
        if too_many is socket:
            await _close_full(socket)
            return
        self._send_away(too_many)
        await socket.send_str(encode({"type": "hello", "may_command": may_command, **self._hello}))
        client = self._broadcaster.join()
        sender = asyncio.create_task(_send(socket, client))
        try:
            async for message in socket:
                if message.type is WSMsgType.TEXT:
                    await self._answer(socket, message.data, may_command, client)
        finally:
            self._broadcaster.leave(client)
            sender.cancel()
            with suppress(asyncio.CancelledError, ConnectionError):
                await sender

    def _send_away(self, socket: web.WebSocketResponse | None) -> None:
        """Closes a socket without waiting for it, since it may not answer."""
        if socket is not None:
            closing = asyncio.create_task(_close_full(socket))
            self._closing.add(closing)
            closing.add_done_callback(self._closing.discard)

    async def _authorise(self, socket: web.WebSocketResponse) -> bool | None:
        """Whether a browser may command, from its hello message; None: it may not even watch."""
        with suppress(asyncio.TimeoutError, TypeError, ValueError):
            hello = _read(await socket.receive_str(timeout=_HELLO_S))
            token = hello.get("token") if hello.get("type") == "hello" else None
            if self._guard.knows_token(token):
                return True
            if token:
                await asyncio.sleep(_WRONG_TOKEN_S)
            elif self._guard.open_to_see and hello.get("type") == "hello":
                return False
        await socket.close(code=_TOKEN_NEEDED, message=b"token")
        return None

    async def _answer(
        self, socket: web.WebSocketResponse, text: str, may_command: bool, client: Client
    ) -> None:
        try:
            request = _read(text)
        except ValueError:
            await socket.close(code=_POLICY, message=b"not understood")
            return
        if request.get("type") == "ping":
            pong = {"type": "pong", "at": _number(request.get("at")), "dropped": client.dropped}
            await socket.send_str(encode(pong))
        elif request.get("type") == "command":
            refusal = self._refusal(may_command)
            if refusal is None:
                self._begin_command(socket, request)
            else:
                await socket.send_str(encode(_answer_to(request, False, refusal)))

    def _refusal(self, may_command: bool) -> str | None:
        """Why no command of this browser is carried out; None: it is."""
        if not may_command:
            return "this page was opened without the token: it may only look on"
        if len(self._commands) >= MOST_COMMANDS:
            return "too many commands wait for the controller: nothing was sent"
        return None

    def _begin_command(self, socket: web.WebSocketResponse, request: dict[str, Any]) -> None:
        """Carries out a command in a task of its own: one that waits does not hold up the next, which may be a stop.

        It is not cancelled when the browser leaves: it may be under way.
        """

        async def carry_out() -> None:
            with suppress(ConnectionError):
                await socket.send_str(encode(await self._command(request)))

        command = asyncio.create_task(carry_out())
        self._commands.add(command)
        command.add_done_callback(self._commands.discard)

    async def _command(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            return _answer_to(request, True, await self._execute(request))
        except HodographError as error:
            return _answer_to(request, False, str(error))

    async def _shut_down(self, _: web.Application) -> None:
        for socket in self._slots.everybody():
            await socket.close(code=1001, message=b"the monitor ends")


def _answer_to(request: dict[str, Any], ok: bool, text: str) -> dict[str, Any]:
    return {"type": "answer", "id": _number(request.get("id")), "ok": ok, "text": text}


async def _close_full(socket: web.WebSocketResponse) -> None:
    with suppress(ConnectionError):
        await socket.close(code=_POLICY, message=b"too many browsers")


async def _send(socket: web.WebSocketResponse, client: Client) -> None:
    """Sends the queued messages to a browser, at its pace."""
    with suppress(ConnectionError):
        while True:
            await socket.send_str(await client.get())


def _read(text: str) -> dict[str, Any]:
    """A JSON object. Raises ValueError."""
    try:
        request = json.loads(text)
    except RecursionError as error:
        raise ValueError("nested too deeply") from error
    if not isinstance(request, dict):
        raise ValueError("not an object")
    return request


def _number(value: object) -> float | int:
    if type(value) in (int, float) and abs(value) < 1e15:  # type: ignore[arg-type]
        return value  # type: ignore[return-value]
    return 0


def _load_pages() -> dict[str, tuple[str, bytes]]:
    """The files of the page by name: nothing else can be requested."""
    pages = {}
    for file in (files(__package__) / "page").iterdir():
        ending = "." + file.name.rpartition(".")[2]
        if ending in _TYPES:
            pages[file.name] = (_TYPES[ending], file.read_bytes())
    if "index.html" not in pages:
        raise InputError(
            "hodograph.monitor: the page's files are missing: install the package anew"
        )
    return pages
