# SPDX-License-Identifier: MIT
"""The server of the live page, with requests of browsers and of other clients. Run by pytest; starts the server on a
free port of this computer.
"""

from __future__ import annotations

import asyncio
import json
import struct
from collections.abc import Awaitable, Callable
from socket import SO_LINGER, SOL_SOCKET
from typing import Any

import aiohttp
import pytest
from aiohttp import WSMsgType, web
from aiohttp.test_utils import TestClient, TestServer

from hodograph.errors import InputError, RefusedError
from hodograph.monitor import server as server_module
from hodograph.monitor.clients import MOST_CLIENTS, MOST_WAITING, Broadcaster
from hodograph.monitor.link import read_command
from hodograph.monitor.security import Guard
from hodograph.monitor.server import Server

HANGS_S = 600.0  # of real time: none of these takes a second
TOKEN = "a-token-for-these-tests"

Browser = TestClient[Any, Any]


class Case:
    """A server, and what it was requested to do."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        self.executed: list[dict[str, Any]] = []
        self.guard = Guard(host, TOKEN)
        self.broadcaster: Broadcaster
        self.free = asyncio.Event()  # until then a resume waits

    async def execute(self, request: dict[str, Any]) -> str:
        if request.get("name") == "refuse":
            raise RefusedError("not now")
        if request.get("name") == "resume":
            await self.free.wait()
        self.executed.append(request)
        return "done"

    def run(self, scenario: Callable[[Browser], Awaitable[None]]) -> None:
        async def whole() -> None:
            self.broadcaster = Broadcaster(asyncio.get_running_loop())
            server = Server(self.guard, self.broadcaster, {"mode": "live"}, self.execute)
            async with TestClient(TestServer(server.app)) as browser:
                await scenario(browser)

        asyncio.run(whole())


def origin(browser: Browser) -> str:
    return str(browser.make_url("/")).rstrip("/")


async def hello(browser: Browser, **more: Any) -> aiohttp.ClientWebSocketResponse:
    socket = await browser.ws_connect("/ws", headers={"Origin": origin(browser)})
    await socket.send_json({"type": "hello"} | more)
    return socket


async def answer(socket: aiohttp.ClientWebSocketResponse, kind: str) -> Any:
    while True:
        message = await socket.receive_json(timeout=HANGS_S)
        if message["type"] == kind:
            return message


def test_the_page_and_nothing_else_is_served() -> None:
    async def scenario(browser: Browser) -> None:
        for name in ("/", "/index.html", "/page.js", "/style.css", "/icon.svg"):
            found = await browser.get(name)
            assert found.status == 200, name
            assert "default-src 'none'" in found.headers["Content-Security-Policy"]
            assert found.headers["X-Frame-Options"] == "DENY"
            assert TOKEN not in await found.text()
        for name in ("/server.py", "/../server.py", "/%2e%2e/server.py", "/page/page.js", "/x"):
            assert (await browser.get(name)).status == 404, name
        assert (await browser.post("/")).status == 405

    Case().run(scenario)


def test_foreign_hosts_and_origins_get_nothing() -> None:
    async def scenario(browser: Browser) -> None:
        for path in ("/", "/ws"):
            found = await browser.get(path, headers={"Host": "evil.example:8402"})
            assert found.status == 421
        for foreign in ("http://evil.example", "null", "http://localhost:1"):
            with pytest.raises(aiohttp.WSServerHandshakeError) as caught:
                await browser.ws_connect("/ws", headers={"Origin": foreign})
            assert caught.value.status == 403
        with pytest.raises(aiohttp.WSServerHandshakeError):
            await browser.ws_connect("/ws")

    Case().run(scenario)


def test_a_stop_does_not_wait_for_the_answer_to_another_command() -> None:
    case = Case()

    async def scenario(browser: Browser) -> None:
        socket = await hello(browser, token=TOKEN)
        await socket.send_json({"type": "command", "id": 1, "name": "resume"})
        await socket.send_json({"type": "command", "id": 2, "name": "quick-stop"})
        assert (await answer(socket, "answer"))["id"] == 2
        case.free.set()
        assert (await answer(socket, "answer"))["id"] == 1

    case.run(scenario)
    assert [one["name"] for one in case.executed] == ["quick-stop", "resume"]


def test_waiting_commands_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(server_module, "MOST_COMMANDS", 3)
    case = Case()

    async def scenario(browser: Browser) -> None:
        socket = await hello(browser, token=TOKEN)
        for number in range(4):
            await socket.send_json({"type": "command", "id": number, "name": "resume"})
        refused = await answer(socket, "answer")
        assert (refused["id"], refused["ok"]) == (3, False)
        case.free.set()
        assert [(await answer(socket, "answer"))["ok"] for _ in range(3)] == [True] * 3

    case.run(scenario)


def test_with_the_token_commands_are_executed() -> None:
    case = Case()

    async def scenario(browser: Browser) -> None:
        socket = await hello(browser, token=TOKEN)
        assert (await answer(socket, "hello"))["may_command"] is True
        await socket.send_json({"type": "command", "id": 7, "name": "hold"})
        found = await answer(socket, "answer")
        assert found == {"type": "answer", "id": 7, "ok": True, "text": "done"}
        await socket.send_json({"type": "command", "id": 8, "name": "refuse"})
        assert (await answer(socket, "answer"))["text"] == "not now"

    case.run(scenario)
    assert [request["name"] for request in case.executed] == ["hold"]


def test_without_the_token_loopback_may_look_on_only() -> None:
    case = Case()

    async def scenario(browser: Browser) -> None:
        socket = await hello(browser)
        assert (await answer(socket, "hello"))["may_command"] is False
        for name in ("hold", "override", "quick-stop"):
            await socket.send_json({"type": "command", "id": 1, "name": name, "token": TOKEN})
            found = await answer(socket, "answer")
            assert not found["ok"]
            assert "token" in found["text"]
        case.broadcaster.publish({"type": "rows", "i": 1})
        assert (await answer(socket, "rows"))["i"] == 1

    case.run(scenario)
    assert case.executed == []


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])
@pytest.mark.parametrize("token", ["wrong", TOKEN + "x", 5, [TOKEN]])
def test_a_wrong_token_is_refused(host: str, token: Any) -> None:
    async def scenario(browser: Browser) -> None:
        socket = await hello(browser, token=token)
        message = await socket.receive(timeout=HANGS_S)
        assert message.type is WSMsgType.CLOSE
        assert socket.close_code == 4401

    Case(host).run(scenario)


def test_an_open_server_shows_nothing_without_the_token() -> None:
    case = Case("0.0.0.0")

    async def scenario(browser: Browser) -> None:
        socket = await hello(browser)
        assert (await socket.receive(timeout=HANGS_S)).type is WSMsgType.CLOSE
        assert socket.close_code == 4401
        socket = await hello(browser, token=TOKEN)
        assert (await answer(socket, "hello"))["may_command"] is True

    case.run(scenario)


@pytest.mark.parametrize(
    "text", ["no json", "[]", "5", "x" * 10000, "[" * 4000, '{"type":"hello","token":']
)
def test_nonsense_ends_the_connection_and_not_the_server(text: str) -> None:
    async def scenario(browser: Browser) -> None:
        for first in (True, False):
            socket = await browser.ws_connect("/ws", headers={"Origin": origin(browser)})
            if not first:
                await socket.send_json({"type": "hello", "token": TOKEN})
                await answer(socket, "hello")
            await socket.send_str(text)
            while (message := await socket.receive(timeout=HANGS_S)).type is WSMsgType.TEXT:
                assert json.loads(message.data)["type"] == "history"
            assert message.type is WSMsgType.CLOSE
            too_big = len(text) > 4096
            assert socket.close_code == (1009 if too_big else 4401 if first else 1008)
        assert (await browser.get("/")).status == 200

    Case().run(scenario)


def test_several_browsers_but_not_any_number() -> None:
    async def scenario(browser: Browser) -> None:
        sockets = [await hello(browser) for _ in range(MOST_CLIENTS)]
        for socket in sockets:
            await answer(socket, "hello")
        one_more = await hello(browser)
        assert (await one_more.receive(timeout=HANGS_S)).type is WSMsgType.CLOSE
        await sockets[0].close()
        await asyncio.sleep(0.1)
        assert (await answer(await hello(browser), "hello"))["mode"] == "live"

    Case().run(scenario)


def test_who_has_the_token_always_gets_in() -> None:
    async def scenario(browser: Browser) -> None:
        headers = {"Origin": origin(browser)}
        idle = [await browser.ws_connect("/ws", headers=headers) for _ in range(MOST_WAITING)]
        lookers = [await hello(browser) for _ in range(MOST_CLIENTS)]
        for socket in lookers:
            await answer(socket, "hello")
        operators = [await hello(browser, token=TOKEN) for _ in range(MOST_CLIENTS + 1)]
        for socket in operators[1:]:
            assert (await answer(socket, "hello"))["may_command"] is True
        await answer(operators[0], "hello")
        await answer(operators[0], "history")
        assert (await operators[0].receive(timeout=HANGS_S)).type is WSMsgType.CLOSE
        assert (await idle[0].receive(timeout=HANGS_S)).type is WSMsgType.CLOSE

    Case().run(scenario)


def test_pings_come_back() -> None:
    async def scenario(browser: Browser) -> None:
        socket = await hello(browser)
        await socket.send_json({"type": "ping", "at": 12.5})
        assert (await answer(socket, "pong"))["at"] == 12.5

    Case().run(scenario)


@pytest.mark.parametrize(
    "request_",
    [
        {},
        {"name": "format"},
        {"name": ["hold"]},
        {"name": "override"},
        {"name": "override", "percent": 201},
        {"name": "override", "percent": -1},
        {"name": "override", "percent": 12.5},
        {"name": "override", "percent": True},
        {"name": "override", "percent": "100"},
    ],
)
def test_what_is_no_command_is_refused(request_: dict[str, Any]) -> None:
    with pytest.raises(InputError):
        read_command(request_)


def test_commands_are_the_controllers() -> None:
    class Recorded:
        def __init__(self) -> None:
            self.reported: list[Any] = []

        def command(self, number: int) -> None:
            self.reported.append(number)

        def override(self, percent: int) -> None:
            self.reported.append(("override", percent))

    controller: Any = Recorded()
    names = ("enable", "start", "stop", "disable", "reset", "hold", "resume", "quick-stop", "home")
    for name in names:
        read_command({"name": name})(controller)
    read_command({"name": "override", "percent": 150})(controller)
    assert controller.reported == [1, 2, 3, 4, 5, 6, 7, 9, 10, ("override", 150)]


def test_half_a_request_is_not_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor one that comes a byte at a time."""
    monkeypatch.setattr(server_module, "REQUEST_S", 0.2)

    async def scenario(host: str, port: int) -> None:
        streams = [await asyncio.open_connection(host, port) for _ in range(20)]
        for _, writer in streams:
            writer.write(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX:")
        # A byte that comes after the end resets the connection: then it is an error that ends it.
        async with asyncio.timeout(20.0):
            while not all(reader.at_eof() or reader.exception() for reader, _ in streams):
                for _, writer in streams:
                    writer.write(b"x")
                await asyncio.sleep(0.05)
        for _, writer in streams:
            writer.close()

    async def whole() -> None:
        served = Server(
            Guard("127.0.0.1", TOKEN), Broadcaster(asyncio.get_running_loop()), {}, nobody
        )
        runner = served.runner()
        await runner.setup()
        try:
            await web.TCPSite(runner, "127.0.0.1", 0).start()
            await scenario(*runner.addresses[0])
        finally:
            await runner.cleanup()

    asyncio.run(whole())


async def nobody(request: dict[str, Any]) -> str:
    raise AssertionError(request)


def test_a_browser_that_leaves_in_the_middle(caplog: pytest.LogCaptureFixture) -> None:
    """With a reset, while the page or messages are on their way: nothing is printed, least of all a traceback."""
    case = Case()

    def leave(writer: asyncio.StreamWriter) -> None:
        taken = writer.get_extra_info("socket")
        taken.setsockopt(SOL_SOCKET, SO_LINGER, struct.pack("ii", 1, 0))
        writer.transport.abort()

    async def scenario(browser: Browser) -> None:
        host, port = browser.host, browser.port
        handshake = (
            f"GET /ws HTTP/1.1\r\nHost: {host}:{port}\r\nOrigin: http://{host}:{port}\r\n"
            "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
            "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
        ).encode()
        hello = json.dumps({"type": "hello"}).encode()
        masked = bytes([0x81, 0x80 | len(hello), 0, 0, 0, 0]) + hello
        ping = json.dumps({"type": "ping", "at": 1}).encode()
        pings = (bytes([0x81, 0x80 | len(ping), 0, 0, 0, 0]) + ping) * 200
        requests = (
            handshake,
            handshake + masked,
            handshake + masked + pings,
            b"GET /page.js HTTP/1.1\r\n" + f"Host: {host}:{port}\r\n\r\n".encode(),
        )
        for request in requests * 5:
            for turns in (0, 1, 3, 10):
                _, writer = await asyncio.open_connection(host, port)
                writer.write(request)
                for _ in range(turns):
                    await asyncio.sleep(0)
                    case.broadcaster.publish({"type": "fill", "text": "x" * 100_000})
                leave(writer)
        await asyncio.sleep(0.2)

    case.run(scenario)
    assert [record.getMessage() for record in caplog.records if record.levelname == "ERROR"] == []
