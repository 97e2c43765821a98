# SPDX-License-Identifier: MIT
"""hodograph status: once, or repeatedly with --watch. Started by cli/main. Reads objects of the controller by SDO,
receives frames, and prints to stdout.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from ..bus.address import BusAddress
from ..bus.capture.load import LEAST_LISTEN_S, BusLoad, LoadMeter
from ..bus.clock import Clock
from ..bus.own_bus import bus_address
from ..bus.sdo.controller import Controller, connect
from ..bus.sdo.status import Status, snapshot
from ..bus.status_text import Row, status_line, status_rows
from ..errors import BusError
from .output import aligned, print_json
from .targets import Target, target

_NAME_WIDTH = 12
"""Width of the longest name, so that columns do not move."""
_HOME, _CLEAR_LINE, _CLEAR_BELOW = "\x1b[H", "\x1b[K", "\x1b[J"
_ENTER, _LEAVE = "\x1b[?1049h\x1b[?25l", "\x1b[?25h\x1b[?1049l"


def status(options: Namespace) -> None:
    """hodograph status."""
    address = bus_address(options.bus)
    to = target(options)
    with ExitStack() as stack:
        controller = stack.enter_context(connect(address, to.node, to.bitrate))
        controller.require(options.wait)
        meter = _meter(address, to, controller.clock, stack)
        if options.watch:
            _watch(controller, meter, to, options)
        else:
            _once(controller, meter, to, options)


def _meter(address: BusAddress, to: Target, clock: Clock, stack: ExitStack) -> LoadMeter | None:
    """The load meter; None: the interface is not SocketCAN and has no second receiver."""
    if not address.is_raw:
        return None
    return stack.enter_context(LoadMeter(address, to.bitrate, clock))


def _once(controller: Controller, meter: LoadMeter | None, to: Target, options: Namespace) -> None:
    found = snapshot(controller)
    load = None if meter is None else meter.measure()
    if options.json:
        print_json(_document(found, load))
    else:
        print("\n".join(aligned(status_rows(found, load, to.axis_names), _NAME_WIDTH)))


def _document(found: Status, load: BusLoad | None) -> dict[str, Any]:
    return found.json() | {"bus_load": None if load is None else load.json()}


@dataclass
class _Screen:
    """The output: a terminal shows the newest view in place, other outputs get one line each time."""

    names: tuple[str, ...]
    as_json: bool
    clock: Clock

    def show(self, found: Status, load: BusLoad | None) -> None:
        if self.as_json:
            print_json({"time": self._now()} | _document(found, load))
        elif sys.stdout.isatty():
            self._draw(status_rows(found, load, self.names))
        else:
            print(f"{self._now()} {status_line(found, load)}")
        sys.stdout.flush()

    def lost(self, words: str) -> None:
        if self.as_json:
            print_json({"time": self._now(), "error": words})
        elif sys.stdout.isatty():
            self._draw([("controller", words)])
        else:
            print(f"{self._now()} {words}")
        sys.stdout.flush()

    def _draw(self, rows: list[Row]) -> None:
        lines = [*aligned([("time", self._now()), *rows], _NAME_WIDTH), "", "Ctrl-C ends"]
        sys.stdout.write(_HOME + "".join(f"{line}{_CLEAR_LINE}\n" for line in lines) + _CLEAR_BELOW)

    def _now(self) -> str:
        """Waits by the clock of the bus."""
        now = datetime.fromtimestamp(self.clock.stamp_ns() / 1e9)
        return now.astimezone().isoformat(timespec="milliseconds")


@contextmanager
def _own_screen() -> Iterator[None]:
    """On a terminal the view uses the alternate screen, so that the previous content comes back."""
    if not sys.stdout.isatty():
        yield
        return
    sys.stdout.write(_ENTER)
    try:
        yield
    finally:
        sys.stdout.write(_LEAVE)
        sys.stdout.flush()


def _watch(controller: Controller, meter: LoadMeter | None, to: Target, options: Namespace) -> None:
    screen = _Screen(to.axis_names, options.json, controller.clock)
    try:
        with _own_screen():
            if meter is not None:  # so that later readings need not wait for the load
                controller.clock.sleep(LEAST_LISTEN_S)
            while True:
                begun = controller.clock.now_s()
                _show(controller, meter, screen)
                controller.clock.sleep(begun + options.interval - controller.clock.now_s())
    except KeyboardInterrupt as error:
        if type(error) is not KeyboardInterrupt:  # SIGTERM
            raise


def _show(controller: Controller, meter: LoadMeter | None, screen: _Screen) -> None:
    try:
        if not controller.answers(LEAST_LISTEN_S):
            raise BusError(f"no answer from {controller.who()}: still trying")
        found = snapshot(controller)
        screen.show(found, None if meter is None else meter.measure())
    except BusError as error:
        screen.lost(str(error))
        _forget(meter)


def _forget(meter: LoadMeter | None) -> None:
    """Discards frames received in the meantime: other nodes may send for hours."""
    with suppress(BusError):  # the bus is down too, which the next reading reports
        if meter is not None:
            meter.measure(0.0)


COMMANDS = {"status": status}
