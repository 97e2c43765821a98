# SPDX-License-Identifier: MIT
"""Headless Chromium, driven by the Chrome DevTools Protocol over a WebSocket. Used by tests/system. Starts a
process and sends to it; writes its profile, log and pictures to folders that it is given.
"""

from __future__ import annotations

import asyncio
import base64
import os
import shutil
import subprocess
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import aiohttp

from hodograph.bus.processes import guarded

LOST_S = 600.0
"""A browser that sends nothing for this long counts as hanging."""
MOST_LOOKS = 20_000
"""Most checks of a page, each at another frame of its screen, until a condition holds: some minutes."""
_NEXT_FRAME = "new Promise(r => { requestAnimationFrame(r); setTimeout(r, 100); })"
"""A page that is not seen has no frames."""


def _nothing() -> None:
    pass


class Browser:
    """One browser process; `errors` has what pages complained about on their console."""

    def __init__(self, folder: Path) -> None:
        program = shutil.which("chromium") or shutil.which("chromium-browser")
        assert program is not None, "chromium is not installed: tools/packages.py test installs it"
        self._folder = folder / "chromium"
        command = [
            program,
            "--headless=new",
            "--disable-gpu",
            "--disable-dev-shm-usage",
            "--no-first-run",
            "--hide-scrollbars",
            "--mute-audio",
            "--remote-debugging-port=0",
            f"--user-data-dir={self._folder}",
            *(["--no-sandbox"] if os.geteuid() == 0 else []),
            "about:blank",
        ]
        with (folder / "chromium.log").open("wb") as log:
            self._process = subprocess.Popen(
                guarded(command),
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=log,
                start_new_session=True,
            )
        self._loop = asyncio.new_event_loop()
        self._session = self._loop.run_until_complete(_session())
        self._port = self._find_port()

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self._loop.run_until_complete(self._session.close())
        self._loop.close()
        self._process.terminate()
        try:
            self._process.wait(10)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _find_port(self) -> int:
        file = self._folder / "DevToolsActivePort"
        deadline = time.monotonic() + LOST_S
        while time.monotonic() < deadline:
            assert self._process.poll() is None, "chromium ended by itself"
            if file.exists() and (text := file.read_text().split()):
                return int(text[0])
            time.sleep(0.05)
        raise AssertionError(f"chromium did not start in {LOST_S:.0f} s")

    def open(self, url: str, width: int = 1440, height: int = 1000) -> Page:
        """A new tab with this address."""
        return Page(self._loop, self._session, self._port, url, width, height)


async def _session() -> aiohttp.ClientSession:
    return aiohttp.ClientSession()


class Page:
    """A tab. Whatever it complains about is in `complaints`."""

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        session: aiohttp.ClientSession,
        port: int,
        url: str,
        width: int,
        height: int,
    ) -> None:
        self._loop, self._ids = loop, 0
        self._opened = (loop, session, port, url.partition("#")[0], width, height)
        self.complaints: list[str] = []
        self.meanwhile: Callable[[], None] = _nothing
        """Called between two checks while a condition is waited for: lets virtual time pass."""
        self._socket = loop.run_until_complete(_attach(session, port))
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **metrics)
        self.go(url)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """One command of the protocol; its result."""
        self._ids += 1
        request = {"id": self._ids, "method": method, "params": parameters}
        return self._loop.run_until_complete(asyncio.wait_for(self._ask(request), LOST_S))

    async def _ask(self, request: dict[str, Any]) -> dict[str, Any]:
        await self._socket.send_json(request)
        while True:
            answer = await self._socket.receive_json()
            self._listen(answer)
            if answer.get("id") == request["id"]:
                assert "error" not in answer, answer
                return dict(answer["result"])

    def _listen(self, event: dict[str, Any]) -> None:
        parameters = event.get("params", {})
        if event.get("method") == "Runtime.exceptionThrown":
            details = parameters["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description", str(details)))
        elif event.get("method") == "Log.entryAdded" and parameters["entry"]["level"] == "error":
            self.complaints.append(parameters["entry"]["text"])

    def go(self, url: str) -> None:
        """Loads another address."""
        assert "errorText" not in (answer := self.call("Page.navigate", url=url)), answer
        self.wait("location.href !== 'about:blank' && document.readyState === 'complete'")

    def again(self) -> Page:
        """Another tab with the same address, without what is behind the #, as a browser of its own would."""
        page = Page(*self._opened)
        page.meanwhile = self.meanwhile
        return page

    def js(self, expression: str) -> Any:
        """The value of an expression; promises are waited for."""
        result = self.call(
            "Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True
        )
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, condition: str) -> Any:
        """Waits until an expression is truthy, this tab being the one that is seen and so drawn; its value."""
        self.call("Page.bringToFront")
        for _ in range(MOST_LOOKS):
            if value := self.js(condition):
                return value
            self.meanwhile()
            self.js(_NEXT_FRAME)
        raise AssertionError(
            f"not within {MOST_LOOKS} looks: {condition}\n{self.text()}\n{self.complaints}"
        )

    def text(self, selector: str = "body") -> str:
        """The words that are to be seen."""
        return str(self.js(f"document.querySelector({selector!r})?.innerText ?? ''"))

    def click(self, selector: str) -> None:
        """A click with the mouse in the middle of an element, which must be there and enabled."""
        self.wait(f"(e => e && !e.disabled)(document.querySelector({selector!r}))")
        x, y = self.js(
            f"(e => {{ e.scrollIntoView({{block: 'center'}}); const r = e.getBoundingClientRect();"
            f" return [r.x + r.width / 2, r.y + r.height / 2]; }})(document.querySelector({selector!r}))"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def press(self, key: str, code: str = "", text: str = "") -> None:
        """A key, down and up."""
        codes = {"Tab": 9, "Enter": 13, "ArrowRight": 39, "ArrowLeft": 37, "Home": 36, "End": 35}
        common = {"key": key, "code": code or key, "windowsVirtualKeyCode": codes.get(key, 0)}
        self.call("Input.dispatchKeyEvent", type="keyDown", text=text, **common)
        self.call("Input.dispatchKeyEvent", type="keyUp", **common)

    def picture(self, file: Path) -> None:
        """A screenshot as PNG."""
        file.write_bytes(base64.b64decode(self.call("Page.captureScreenshot")["data"]))


async def _attach(session: aiohttp.ClientSession, port: int) -> aiohttp.ClientWebSocketResponse:
    async with session.put(f"http://127.0.0.1:{port}/json/new?about:blank") as answer:
        target = await answer.json()
    return await session.ws_connect(target["webSocketDebuggerUrl"], max_msg_size=0)
