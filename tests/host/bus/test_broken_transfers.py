# SPDX-License-Identifier: MIT
"""Answers of a controller that are lost, or that come to a transfer which it has ended meanwhile. Run by pytest; the
node is one of python canopen on a virtual bus of this process; starts threads, and writes lock files.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from canopen_server import canopen_server
from hodograph.bus.address import BusAddress
from hodograph.bus.sdo.controller import Controller, connect
from hodograph.bus.sdo.node import _Answers
from hodograph.bus.sdo.objects import COMMAND, READY, RESUME, RUNNING, START, STATE
from hodograph.errors import BusError, RefusedError

BUS = BusAddress("virtual", "lost-answers")
TIME_OUT, UNEXPECTED, READ_ONLY = 0x05040000, 0x05040001, 0x06010002


@pytest.fixture
def controller() -> Iterator[Controller]:
    with canopen_server(BUS) as local:
        state: Any = local.sdo[STATE]
        state.raw = READY
        with connect(BUS, 1, 1_000_000) as found:
            found.require(5.0)
            found.sdo.RESPONSE_TIMEOUT = 0.2
            yield found


class Spoilt:
    """Spoils the next answers about an object: they are lost, or an abort without a name comes in their place."""

    def __init__(
        self, monkeypatch: pytest.MonkeyPatch, index: int, aborts: list[int | None]
    ) -> None:
        self.left, put = list(aborts), _Answers.put

        def spoil(answers: _Answers, answer: bytes) -> None:
            if not self.left or answer[1:3] != index.to_bytes(2, "little"):
                put(answers, answer)
                return
            code = self.left.pop(0)
            if code is not None:
                put(answers, b"\x80\0\0\0" + code.to_bytes(4, "little"))

        monkeypatch.setattr(_Answers, "put", spoil)


@pytest.mark.parametrize("spoilt", [None, TIME_OUT, UNEXPECTED])
def test_a_read_is_asked_again(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, spoilt: int | None
) -> None:
    """An unexpected command: the host was stopped in a transfer until the controller had ended it."""
    found = Spoilt(monkeypatch, STATE, [spoilt])
    assert controller.state() == READY
    assert not found.left


def test_a_refusal_is_none_of_these(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    Spoilt(monkeypatch, STATE, [READ_ONLY])
    with pytest.raises(RefusedError, match="0x2002"):
        controller.state()


@pytest.mark.parametrize("spoilt", [None, UNEXPECTED])
def test_a_write_is_given_again(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, spoilt: int | None
) -> None:
    found = Spoilt(monkeypatch, 0x2060, [spoilt])
    controller.write(0x2060, 16, 0)
    assert not found.left
    assert controller.read(0x2060, 16) == 0


@pytest.mark.parametrize("state", [RUNNING, READY])
def test_a_start_is_not_given_again(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, state: int
) -> None:
    """It might start twice: the state shows whether it was executed."""
    monkeypatch.setattr(controller, "state", lambda: state)
    Spoilt(monkeypatch, COMMAND, [None])
    if state == RUNNING:
        controller.command(START)
        assert controller.acted
        return
    with pytest.raises(BusError, match="did not answer a command"):
        controller.command(START)


def test_a_resume_is_not_given_again(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It might end a hold that another client has commanded meanwhile."""
    found = Spoilt(monkeypatch, COMMAND, [None])
    with pytest.raises(BusError, match="did not answer a command and is ready"):
        controller.command(RESUME)
    assert not found.left


def test_an_answer_that_comes_twice_is_no_refusal_of_what_is_asked_next(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The one to the probe, which reads an object that does not exist; after the first wait of a command."""
    asked, put = list[bytes](), _Answers.put

    def doubled(answers: _Answers, answer: bytes) -> None:
        if answer[1:3] == STATE.to_bytes(2, "little") and not asked:
            asked.append(answer)
            put(answers, b"\x80" + (0x5123).to_bytes(2, "little") + b"\x01\x00\x00\x02\x06")
        put(answers, answer)

    monkeypatch.setattr(_Answers, "put", doubled)
    assert controller.answers(1.0)
    assert asked
