# SPDX-License-Identifier: MIT
"""Reading the program to draw: commands interrupt it, and it is tried again after a failure."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoCommunicationError

from hodograph.bus.address import parse_address
from hodograph.errors import HodographError
from hodograph.monitor.link import Link
from hodograph.monitor.session import _require_alive

IMAGE = bytes(range(200))
PROGRAM = {"state": "ready", "crc32": 77, "size": len(IMAGE)}


class FakeController:
    """Gives the image in segments; `happens` is done before one of them."""

    def __init__(self) -> None:
        self.sdo = self
        self.aborted = 0
        self.given = 0
        self.happens: dict[int, Any] = {}
        self._left = b""

    @contextmanager
    def turn(self) -> Iterator[None]:
        yield

    def who(self) -> str:
        return "node 1"

    def open(self, *_: Any, **__: Any) -> FakeController:
        self._left = IMAGE
        return self

    def read(self, size: int) -> bytes:
        self.happens.pop(len(IMAGE) - len(self._left), lambda: None)()
        segment, self._left = self._left[:size], self._left[size:]
        self.given += 1
        return segment

    def abort(self) -> None:
        self.aborted += 1


class Bench:
    def __init__(self) -> None:
        self.shown: list[bytes | None] = []
        self.link = Link(
            parse_address("socketcan:vcan0"),
            1,
            1_000_000,
            lambda _: None,
            lambda image, _: self.shown.append(image),
            given=None,
        )
        self.controller = FakeController()

    def look(self) -> None:
        self.link._look_at_program(self.controller, PROGRAM)  # type: ignore[arg-type]


def test_a_command_does_not_wait_for_a_program_that_is_being_fetched() -> None:
    bench, executed = Bench(), []
    bench.controller.happens[70] = lambda: bench.link.submit(lambda _: executed.append("hold"))
    bench.look()
    assert (bench.shown, bench.controller.aborted, bench.controller.given) == ([], 1, 11)
    bench.link._execute(bench.controller)  # type: ignore[arg-type]
    assert executed == ["hold"]
    bench.look()
    bench.look()
    assert (bench.shown, bench.controller.aborted) == ([IMAGE], 1)


def test_a_program_that_could_not_be_fetched_is_fetched_at_the_next_look() -> None:
    def fails() -> None:
        raise SdoCommunicationError("no answer")

    bench = Bench()
    bench.controller.happens[70] = fails
    bench.look()
    assert bench.shown == []
    bench.look()
    assert bench.shown == [IMAGE]


@pytest.mark.parametrize(("pump", "link"), [(False, True), (True, False), (False, None)])
def test_a_broken_down_thread_ends_the_monitor(pump: bool, link: bool | None) -> None:
    class Part:
        def __init__(self, alive: bool) -> None:
            self.alive = alive

    other = None if link is None else Part(link)
    with pytest.raises(HodographError, match="broken down"):
        _require_alive(Part(pump), other)  # type: ignore[arg-type]
    _require_alive(Part(True), None if link is None else Part(True))  # type: ignore[arg-type]
