# SPDX-License-Identifier: MIT
"""Turns at a controller's SDO channel: a lock that is waited for, but not for ever."""

import os
import queue
import struct
import threading
import time
import types
from collections.abc import Iterator

import pytest
from canopen.sdo.exceptions import SdoCommunicationError

from hodograph.bus.address import BusAddress
from hodograph.bus.sdo.controller import connect
from hodograph.bus.sdo.node import Node
from hodograph.bus.sdo.turns import Turns
from hodograph.errors import BusError

BUS = BusAddress("virtual", f"turns-{os.getpid()}")


@pytest.fixture
def other() -> Iterator[Turns]:
    turns = Turns(BUS, 1)
    yield turns
    turns.close()


def test_a_turn_that_never_comes_is_a_bus_error(other: Turns) -> None:
    mine = Turns(BUS, 1)
    begun = time.monotonic()
    with (
        other.turn(),
        pytest.raises(BusError, match=rf"another hodograph command is using node 1 on {BUS}: "),
        mine.turn(0.1),
    ):
        pass
    assert 0.1 <= time.monotonic() - begun < 3.0
    with mine.turn():
        pass
    mine.close()


def test_a_turn_is_waited_for(other: Turns) -> None:
    mine = Turns(BUS, 1)
    held = threading.Event()

    def hold() -> None:
        with other.turn():
            held.set()
            time.sleep(0.2)

    thread = threading.Thread(target=hold)
    thread.start()
    assert held.wait(10.0)
    begun = time.monotonic()
    with mine.turn():
        waited_s = time.monotonic() - begun
    thread.join()
    mine.close()
    assert waited_s > 0.05


def test_turns_of_another_node_are_free(other: Turns) -> None:
    mine = Turns(BUS, 2)
    with other.turn(), mine.turn(0.0):
        pass
    mine.close()


def test_whoever_asks_again_and_again_lets_others_in(other: Turns) -> None:
    done = threading.Event()

    def greedy() -> None:
        while not done.is_set():
            with other.turn():
                time.sleep(0.005)

    thread = threading.Thread(target=greedy)
    thread.start()
    mine = Turns(BUS, 1)
    try:
        for _ in range(20):
            with mine.turn(5.0):
                pass
    finally:
        done.set()
        thread.join()
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

    def __init__(self) -> None:
        self.responses: queue.Queue[bytes] = queue.Queue()
        self.asked: list[bytes] = []

    def send_request(self, request: bytearray) -> None:
        self.asked.append(bytes(request))

    def answer(self, request: bytes) -> None:
        self.responses.put(b"\x80" + request[1:4] + struct.pack("<L", 0x06020000))


def test_an_answer_to_nobody_that_is_late_is_not_taken_for_another(
    other: Turns, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hodograph.bus.sdo.node.LET_PASS_S", 0.05)
    sdo = _LateSdo()
    node = Node(BUS, 1, types.SimpleNamespace(sdo=sdo))
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
    answered = threading.Timer(0.02, lambda: sdo.answer(sdo.asked[-1]))
    answered.start()
    with node.turn():
        assert sdo.responses.empty(), "whatever came before the newest answer is gone"
    answered.join()
    with node.turn():
        assert len(sdo.asked) == 3, "and the channel is ours until somebody else has it"
    node.close()


def test_an_answer_that_comes_too_late_is_not_taken_for_the_next() -> None:
    sdo = _LateSdo()
    node = Node(BUS, 4, types.SimpleNamespace(sdo=sdo))
    with node.turn():
        pass
    assert not sdo.asked, "nobody had the channel before"
    with pytest.raises(SdoCommunicationError), node.turn():
        raise SdoCommunicationError("No SDO response received")
    sdo.responses.put(bytes.fromhex("4f02200003000000"))
    answered = threading.Timer(0.02, lambda: sdo.answer(sdo.asked[-1]))
    answered.start()
    with node.turn():
        assert sdo.responses.empty()
    answered.join()
    node.close()


def test_connections_of_one_process_are_told_of_each_other() -> None:
    mine, yours = Turns(BUS, 3), Turns(BUS, 3)
    had = []
    for turns in (mine, mine, yours, mine):
        with turns.turn() as handed_over:
            had.append(handed_over)
    mine.close()
    yours.close()
    assert had[1:] == [False, True, True]
