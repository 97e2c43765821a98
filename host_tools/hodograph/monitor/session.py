# SPDX-License-Identifier: MIT
"""A monitor from start to end: bus or recording, page, commands. Used by cli/monitor_command. Serves HTTP, starts the
threads of pump.py and link.py, and handles SIGINT and SIGTERM.
"""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from aiohttp import web

from .. import __version__
from ..bus.address import BusAddress
from ..errors import HodographError, InputError
from .clients import Broadcaster
from .link import Link, is_stop, read_command
from .pump import Layout, Pump
from .security import Guard, is_loopback
from .server import Server
from .source import Source, open_source


class Usage:
    """Share of a processor since the last message, and memory."""

    def __init__(self) -> None:
        self._last = (time.monotonic(), sum(os.times()[:2]))

    def message(self, clients: int) -> dict[str, Any]:
        """For the page's last line. `clients`: browsers that are connected."""
        now = (time.monotonic(), sum(os.times()[:2]))
        passed_s = max(now[0] - self._last[0], 1e-3)
        percent = 100 * (now[1] - self._last[1]) / passed_s
        self._last = now
        import resource  # not on Windows

        return {
            "type": "usage",
            "cpu_percent": round(percent, 1),
            "memory_mib": round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024),
            "clients": clients,
        }


@dataclass(frozen=True)
class Live:
    """A bus and the controller on it."""

    address: BusAddress
    node: int


@dataclass(frozen=True)
class Replay:
    """A recording; `open` restarts it."""

    name: str
    speed: float
    open: Callable[[], Source]


@dataclass(frozen=True)
class PageAddress:
    """Where the page is served."""

    host: str
    port: int
    token: str

    @property
    def url(self) -> str:
        """Address of the page that may command: the token follows the #, and browsers do not send that part."""
        host = "127.0.0.1" if self.host in ("0.0.0.0", "::") else self.host
        host = f"[{host}]" if ":" in host else host
        return f"http://{host}:{self.port}/#token={self.token}"


class LivePage:
    """Serves the page until SIGINT or SIGTERM.

    image     the program on the command line; None: none was given
    note      prints a line on the terminal
    toolpath  the view of a toolpath (job_view.curve_view); None: none was given
    """

    def __init__(
        self,
        what: Live | Replay,
        layout: Layout,
        place: PageAddress,
        image: bytes | None,
        note: Callable[[str], None],
        toolpath: dict[str, object] | None = None,
    ) -> None:
        self._what, self._layout, self._place = what, layout, place
        self._image, self._note, self._toolpath = image, note, toolpath

    async def serve(self) -> None:
        """Raises InputError: the address is in use. Raises HodographError: a thread has failed."""
        loop = asyncio.get_running_loop()
        ending = asyncio.Event()
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.add_signal_handler(number, ending.set)
        broadcaster = Broadcaster(loop)
        pump = Pump(self._opener(), self._layout, broadcaster.publish)
        link = self._link(broadcaster, pump)
        server = Server(
            Guard(self._place.host, self._place.token),
            broadcaster,
            self._hello(),
            _execute(link, pump),
        )
        runner = server.runner()
        await runner.setup()
        usage = Usage()
        try:
            await self._listen(runner)
            if self._image is not None:
                pump.show(self._image)
            if self._toolpath is not None:
                broadcaster.publish({"type": "toolpath", **self._toolpath})
            pump.start()
            self._note(f"monitor: {self._place.url}")
            if link is not None:
                link.start()
            while not ending.is_set():
                _require_alive(pump, link)
                broadcaster.publish(usage.message(broadcaster.count))
                with_timeout = asyncio.wait_for(ending.wait(), 1.0)
                try:
                    await with_timeout
                except TimeoutError:
                    continue
        finally:
            await asyncio.to_thread(_close, link, pump)
            await runner.cleanup()

    async def _listen(self, runner: web.AppRunner) -> None:
        site = web.TCPSite(runner, self._place.host, self._place.port)
        try:
            await site.start()
        except OSError as error:
            raise InputError(
                f"{self._place.host}:{self._place.port}: cannot be served: {error.strerror or error}: "
                "choose another --port or --host"
            ) from error

    def _opener(self) -> Callable[[], Source]:
        what, bitrate = self._what, self._layout.bitrate
        if isinstance(what, Replay):
            return what.open
        return lambda: open_source(what.address, bitrate)

    def _link(self, broadcaster: Broadcaster, pump: Pump) -> Link | None:
        if isinstance(self._what, Replay):
            return None
        return Link(
            self._what.address,
            self._what.node,
            self._layout.bitrate,
            broadcaster.publish,
            pump.show,
            given=self._image,
        )

    def _hello(self) -> dict[str, Any]:
        what = self._what
        return {
            "version": __version__,
            "mode": "replay" if isinstance(what, Replay) else "live",
            "what": f"{what.name}, speed {what.speed:g}"
            if isinstance(what, Replay)
            else str(what.address),
            "axes": list(self._layout.names),
            "nodes": list(self._layout.nodes),
            "units": list(self._layout.units),
            "drawn": self._layout.drawn,
            "path_axes": self._layout.path_axes,
            "period_us": self._layout.period_us,
            "loopback": is_loopback(self._place.host),
        }


def _execute(link: Link | None, pump: Pump) -> Callable[[dict[str, Any]], Any]:
    async def execute(request: dict[str, Any]) -> str:
        name = str(request.get("name"))
        if link is None:
            if name != "replay":
                raise InputError("a recording takes no commands")
            pump.restart()
            return "from the beginning"
        command = read_command(request)
        await asyncio.wrap_future(link.submit(command, at_once=is_stop(request)))
        return f"{name}: done"

    return execute


def _require_alive(pump: Pump, link: Link | None) -> None:
    """Raises HodographError: a thread has failed. The page ends then, since it would show old data without a sign."""
    if not (pump.alive and (link is None or link.alive)):
        raise HodographError(
            "monitor: a part of it has broken down, see above: start it again, and report this bug"
        )


def _close(link: Link | None, pump: Pump) -> None:
    if link is not None:
        link.close()
    pump.close()
