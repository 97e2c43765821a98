# SPDX-License-Identifier: MIT
"""The SDO channel lock: clients wait for it in turn, for a bounded time. Run by pytest; opens virtual buses of this
process, starts a thread, and writes the files of locks.
"""

import os
import queue
import struct
import types
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import pytest
from canopen.sdo.exceptions import SdoCommunicationError

from hodograph.bus.address import BusAddress
from hodograph.bus.sdo.channel_lock import Turns
from hodograph.bus.sdo.controller import connect
from hodograph.bus.sdo.node import Node
from hodograph.errors import BusError

BUS = BusAddress("virtual", f"turns-{os.getpid()}")
MOST_RETRY_S = 0.002


class SteppedClock:
    """Time passes while somebody sleeps, and not otherwise; `meanwhile` is called then."""

    is_virtual = True

    def __init__(self) -> None:
        self._now_s = 0.0
        self.meanwhile: Callable[[], None] = lambda: None

    def now_s(self) -> float:
        return self._now_s

    def stamp_ns(self) -> int:
        return round(1e9 * self._now_s)

    def sleep(self, seconds: float) -> None:
        self._now_s += seconds
        self.meanwhile()


@pytest.fixture
def clock() -> SteppedClock:
    return SteppedClock()


@pytest.fixture
def other() -> Iterator[Turns]:
    turns = Turns(BUS, 1)
    yield turns
    turns.close()


def test_a_turn_that_never_comes_is_a_bus_error(other: Turns, clock: SteppedClock) -> None:
    mine = Turns(BUS, 1, clock)
    with (
        other.turn(),
        pytest.raises(BusError, match=rf"another hodograph command is using node 1 on {BUS}: "),
        mine.turn(0.1),
    ):
        raise AssertionError("the turn came while another had it")
    assert 0.1 <= clock.now_s() <= 0.1 + MOST_RETRY_S
    with mine.turn():
        pass
    mine.close()


def test_a_turn_is_waited_for_and_no_longer(other: Turns, clock: SteppedClock) -> None:
    mine = Turns(BUS, 1, clock)
    others = ExitStack()
    others.enter_context(other.turn())

    def give_back() -> None:
        if clock.now_s() >= 0.2:
            others.close()

    clock.meanwhile = give_back
    with mine.turn(30.0):
        assert 0.2 <= clock.now_s() <= 0.2 + MOST_RETRY_S
    mine.close()


def test_turns_of_another_node_are_free(other: Turns) -> None:
    mine = Turns(BUS, 2)
    with other.turn(), mine.turn(0.0):
        pass
    mine.close()


def test_whoever_asks_again_at_once_comes_after_who_waits(
    other: Turns, clock: SteppedClock
) -> None:
    """The other gives its turn back and asks for the next one while we wait: ours is before it."""
    mine = Turns(BUS, 1, clock)
    others, refused = ExitStack(), []
    others.enter_context(other.turn())

    def greedy() -> None:
        others.close()
        try:
            others.enter_context(other.turn(0.0))
        except BusError:
            refused.append(clock.now_s())

    clock.meanwhile = greedy
    with mine.turn(5.0):
        assert refused == [clock.now_s()], "at the first look after the other had done"
    with other.turn(0.0):
        pass
    mine.close()


def test_a_controller_that_another_command_uses(other: Turns) -> None:
    with (
        connect(BUS, 1, 1_000_000) as controller,
        other.turn(),
        pytest.raises(BusError, match="another hodograph command is using node 1"),
    ):
        controller.require(0.1)


class _LateSdo:
    """An SDO channel whose answers come when the test says so."""

    RESPONSE_TIMEOUT = 0.05

    def __init__(self, clock: SteppedClock) -> None:
        self._clock = clock
        self._answers: list[bytes] = []
        self.responses = self
        self.asked: list[bytes] = []
        self.answers_at_once = False

    def send_request(self, request: bytearray) -> None:
        self.asked.append(bytes(request))
        if self.answers_at_once:
            self.answer(self.asked[-1])

    def answer(self, request: bytes) -> None:
        self.put(b"\x80" + request[1:4] + struct.pack("<L", 0x06020000))

    def put(self, answer: bytes) -> None:
        self._answers.append(answer)

    def empty(self) -> bool:
        return not self._answers

    def get(self, timeout: float) -> bytes:
        if not self._answers:
            self._clock.sleep(timeout)
            raise queue.Empty
        return self._answers.pop(0)


def test_an_answer_to_nobody_that_is_late_is_not_taken_for_another(
    other: Turns, clock: SteppedClock
) -> None:
    sdo = _LateSdo(clock)
    node = Node(BUS, 1, types.SimpleNamespace(sdo=sdo), clock)
    with other.turn():
        pass
    with pytest.raises(BusError, match="stopped answering"), node.turn():
        pass
    assert len(sdo.asked) == 1
    with pytest.raises(BusError, match="stopped answering"), node.turn():
        pass  # the first answer has still not come: nothing else may be asked
    assert sdo.asked[0] != sdo.asked[1]
    sdo.answer(sdo.asked[0])
    sdo.answer(sdo.asked[1])
    sdo.answers_at_once = True
    with node.turn():
        assert sdo.empty(), "whatever came before the newest answer is gone"
    with node.turn():
        assert len(sdo.asked) == 3, "and the channel is ours until somebody else has it"
    node.close()


def test_questions_of_other_clients_differ(clock: SteppedClock) -> None:
    """In virtual time they are made from the time: 4.096 ms later too the question is another one."""
    asked = set()
    for number in range(200):
        mine, yours = Turns(BUS, 5), _LateSdo(clock)
        with mine.turn():
            pass
        node = Node(BUS, 5, types.SimpleNamespace(sdo=yours), clock)
        yours.answers_at_once = True
        with node.turn():
            pass
        asked.add(yours.asked[0])
        node.close()
        mine.close()
        clock.sleep(0.004096)
        assert len(asked) == number + 1


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next(clock: SteppedClock) -> None:
    sdo = _LateSdo(clock)
    node = Node(BUS, 4, types.SimpleNamespace(sdo=sdo), clock)
    with node.turn():
        pass
    assert not sdo.asked, "nobody had the channel before"
    with pytest.raises(SdoCommunicationError), node.turn():
        raise SdoCommunicationError("No SDO response received")
    sdo.put(bytes.fromhex("4f02200003000000"))
    sdo.answers_at_once = True
    with node.turn():
        assert sdo.empty()
    node.close()


def test_connections_of_one_process_notice_each_other() -> None:
    mine, yours = Turns(BUS, 3), Turns(BUS, 3)
    had = []
    for turns in (mine, mine, yours, mine):
        with turns.turn() as handed_over:
            had.append(handed_over)
    mine.close()
    yours.close()
    assert had[1:] == [False, True, True]
