# SPDX-License-Identifier: MIT
"""Commands of browsers interrupt the reading of the program, and stops wait for nobody; a program is read again after a
failure. Run by pytest; bus and controller are classes, except for virtual buses of this process; starts threads, and
writes lock files.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoCommunicationError

from hodograph.bus.address import BusAddress, parse_address
from hodograph.bus.sdo.channel_lock import TURN_WAIT_S, Turns
from hodograph.bus.sdo.stream_channel import ENDED, OPEN
from hodograph.errors import BusyError, HodographError
from hodograph.monitor.link import PATIENCE_S, Link, is_stop
from hodograph.monitor.session import _require_alive

IMAGE = bytes(range(200))
PROGRAM = {"state": "ready", "crc32": 77, "size": len(IMAGE)}


class FakeController:
    """Gives the image in segments; `happens` is done before one of them."""

    def __init__(self) -> None:
        self.sdo = self
        self.RESPONSE_TIMEOUT = 0.25
        self.aborted = 0
        self.given = 0
        self.happens: dict[int, Any] = {}
        self.wanted = False
        self.clock = self
        self._left = b""

    def now_s(self) -> float:
        """Each segment takes a second."""
        return float(self.given)

    def is_wanted(self) -> bool:
        return self.wanted

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
        self.state = "ready"
        self.stream: dict[str, int] | None = None
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
        status = {"program": PROGRAM, "state": self.state, "stream": self.stream}
        self.link._look_at_program(self.controller, status)  # type: ignore[arg-type]


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


def test_another_client_that_waits_too_long_breaks_off_the_reading() -> None:
    """The reading of a large program takes longer than other commands wait: it must not end a `run`."""
    bench = Bench()
    bench.controller.wanted = True
    for attempt, patience_s in enumerate(PATIENCE_S, 1):
        before = bench.controller.given
        bench.look()
        assert (bench.shown, bench.controller.aborted) == ([], attempt)
        assert bench.controller.given - before == 1 + patience_s
        assert patience_s < TURN_WAIT_S
    given = bench.controller.given
    for _ in range(3):
        bench.look()
    assert (bench.shown, bench.controller.given) == ([None], given), "said once, not read again"


def test_a_client_that_waits_a_little_does_not_break_off_the_reading() -> None:
    bench = Bench()
    for place in range(0, len(IMAGE), 28):
        bench.controller.happens[place] = lambda: setattr(bench.controller, "wanted", True)
        bench.controller.happens[place + 7] = lambda: setattr(bench.controller, "wanted", False)
    bench.look()
    assert (bench.shown, bench.controller.aborted) == ([IMAGE], 0)


def test_a_lock_that_another_client_waits_for_is_wanted() -> None:
    bus = BusAddress("virtual", f"link-wanted-{os.getpid()}")
    mine, other = Turns(bus, 1), Turns(bus, 1)
    found = []
    with mine.turn():
        assert not mine.is_wanted()
        other.while_waiting = lambda: found.append(mine.is_wanted())
        with pytest.raises(BusyError), other.turn(0.01):
            pass
        assert not mine.is_wanted(), "it has given up"
    assert found
    assert all(found)
    mine.close()
    other.close()


def test_after_a_streamed_job_the_program_is_shown_again() -> None:
    """When the controller has no job any more, or runs the program though it has one that is over."""
    bench = Bench()
    bench.look()
    for over in ([(None, "ready")], [({"state": ENDED}, "running")] * 2):
        bench.stream = {"state": OPEN}
        bench.look()
        bench.stream = {"state": ENDED}
        for bench.state in (
            "running",
            "ready",
            "ready",
        ):  # the first: its end was between two reads
            bench.look()
        assert bench.shown == [IMAGE]
        for bench.stream, bench.state in over:
            bench.look()
        assert bench.shown == [IMAGE, IMAGE]
        bench.shown.pop()


def test_a_stop_is_sent_while_another_command_waits_for_its_turn() -> None:
    bus = BusAddress("virtual", f"link-{os.getpid()}")
    mine, other = Turns(bus, 1), Turns(bus, 1)
    bench, executed = Bench(), []
    mine.while_waiting = lambda: bench.link._execute_stops(bench.controller)  # type: ignore[arg-type]

    def quick_stop(controller: Any) -> None:
        executed.append(("quick stop", controller.sdo.RESPONSE_TIMEOUT > 1.0))
        held.close()

    def resume(_: Any) -> None:
        stop = bench.link.submit(quick_stop, at_once=True)
        with mine.turn(10.0):
            executed.append(("resume", True))
        assert stop.done()

    with ExitStack() as held:
        held.enter_context(other.turn())
        done = bench.link.submit(resume)
        bench.link._execute(bench.controller)  # type: ignore[arg-type]
        done.result(0)
    assert executed == [("quick stop", True), ("resume", True)]
    assert bench.controller.RESPONSE_TIMEOUT == 0.25
    mine.close()
    other.close()


def test_the_connection_executes_stops_while_it_waits() -> None:
    bus = BusAddress("virtual", f"link-open-{os.getpid()}")
    link = Link(bus, 1, 1_000_000, lambda _: None, lambda _image, _note: None, given=None)
    done = link.submit(lambda _: None, at_once=True)
    other = Turns(bus, 1)
    with link._open() as controller, other.turn(), pytest.raises(HodographError):
        controller.answers(3.0, turn_wait_s=0.01)
    assert done.done()
    other.close()


def test_a_stop_overtakes_the_commands_that_wait() -> None:
    bench, executed = Bench(), []
    for name in ("resume", "override"):
        bench.link.submit(lambda _, name=name: executed.append(name))  # type: ignore[misc]
    bench.link.submit(lambda _: executed.append("hold"), at_once=True)
    bench.link._execute(bench.controller)  # type: ignore[arg-type]
    assert executed == ["hold", "resume", "override"]


def test_a_stop_fails_with_the_connection() -> None:
    bench = Bench()
    done = bench.link.submit(lambda _: None, at_once=True)
    bench.link._lost("gone")
    with pytest.raises(HodographError, match="gone"):
        done.result(0)


def test_stops_are_the_commands_that_the_controller_accepts_at_any_time() -> None:
    names = ("enable", "start", "hold", "resume", "stop", "quick-stop", "home", "override", 7, None)
    assert [name for name in names if is_stop({"name": name})] == ["hold", "stop", "quick-stop"]


@pytest.mark.parametrize(("pump", "link"), [(False, True), (True, False), (False, None)])
def test_a_broken_down_thread_ends_the_monitor(pump: bool, link: bool | None) -> None:
    class Part:
        def __init__(self, alive: bool) -> None:
            self.alive = alive

    other = None if link is None else Part(link)
    with pytest.raises(HodographError, match="broken down"):
        _require_alive(Part(pump), other)  # type: ignore[arg-type]
    _require_alive(Part(True), None if link is None else Part(True))  # type: ignore[arg-type]
