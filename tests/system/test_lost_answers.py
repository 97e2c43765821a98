# SPDX-License-Identifier: MIT
"""Lost answers of the controller to writes and commands: what may be repeated is, and of a start or a resume the state
tells whether it has been executed. A start that names its program is refused if another one is loaded. Run by pytest;
starts a controller and drives on a local bus.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from bench import EXAMPLES
from hodograph.bus.goto import line_image
from hodograph.bus.sdo.controller import HELD, READY, RUNNING, Controller
from hodograph.bus.sdo.node import Node, _Answers
from hodograph.bus.sdo.objects import COMMAND, ENABLE, NAMED_START, OVERRIDE
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.errors import RefusedError
from hodograph.pipeline import load_pipeline

ALPHA = EXAMPLES / "alpha.toml"
LIMIT_S = 60.0
OTHER = line_image((0.0, 0.0), (1.0, 0.0), load_machine(EXAMPLES / "machines" / "paper_alpha.toml"))


class Losing:
    """Loses the first answer to a write of an object, or the request itself."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, index: int, *, request: bool) -> None:
        self.lost = 0
        named, put = index.to_bytes(2, "little"), _Answers.put
        send = Node._put

        def answered(this: _Answers, answer: bytes) -> None:
            if not request and answer[0] == 0x60 and answer[1:3] == named and not self.lost:
                self.lost += 1
                return
            put(this, answer)

        def sent(this: Node, at: int, sub: int | None, value: int) -> None:
            if request and at == index and not self.lost:
                self.lost += 1
                raise SdoCommunicationError("no answer")
            send(this, at, sub, value)

        monkeypatch.setattr(_Answers, "put", answered)
        monkeypatch.setattr(Node, "_put", sent)


@pytest.mark.parametrize("lost", ["answer", "request"])
def test_a_write_is_repeated(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, lost: str
) -> None:
    losing = Losing(monkeypatch, OVERRIDE, request=lost == "request")
    controller.override(70)
    assert (losing.lost, controller.read(OVERRIDE, 1)) == (1, 70)


@pytest.mark.parametrize("lost", ["answer", "request"])
def test_enabling_is_repeated(
    controller: Controller, monkeypatch: pytest.MonkeyPatch, lost: str
) -> None:
    losing = Losing(monkeypatch, COMMAND, request=lost == "request")
    controller.command(ENABLE)
    assert losing.lost == 1
    assert controller.wait_for((READY,), LIMIT_S) == READY


def test_a_start_whose_answer_is_lost_runs(
    controller: Controller, slow_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    losing = Losing(monkeypatch, COMMAND, request=False)
    assert main(["start"]) == 0
    assert (losing.lost, controller.state()) == (1, RUNNING)


def test_a_start_that_is_lost_is_said_to_have_begun_nothing(
    controller: Controller,
    slow_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["goto", str(slow_file)]) == 0
    losing = Losing(monkeypatch, COMMAND, request=True)
    capsys.readouterr()
    assert main(["start"]) == 4
    assert "did not answer a command and is ready: the command did not reach it" in (
        capsys.readouterr().err
    )
    assert (losing.lost, controller.state()) == (1, READY)


def test_a_start_after_a_refused_upload_says_so(
    controller: Controller, slow_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """What is started is not what was uploaded last."""
    assert main(["goto", str(slow_file)]) == 0
    image = load_pipeline(ALPHA).image
    with pytest.raises(RefusedError):
        controller.upload(image[:1000] + bytes([image[1000] ^ 4]) + image[1001:])
    capsys.readouterr()
    assert main(["start"]) == 0
    assert "a program has been refused (" in capsys.readouterr().err
    assert main(["status"]) == 0
    assert "; refused last: " in capsys.readouterr().out


@pytest.mark.parametrize(("lost", "status"), [("answer", 0), ("request", 4)])
def test_a_resume_is_not_repeated(
    controller: Controller,
    slow_file: Path,
    monkeypatch: pytest.MonkeyPatch,
    lost: str,
    status: int,
) -> None:
    """A second one could end the hold of another command."""
    assert main(["goto", str(slow_file)]) == 0
    assert main(["start"]) == 0
    assert main(["hold"]) == 0
    losing = Losing(monkeypatch, COMMAND, request=lost == "request")
    assert main(["resume"]) == status
    assert losing.lost == 1
    assert controller.state() == (HELD if status else RUNNING)


def test_doubled_answers_during_an_upload(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """CAN repeats a frame whose acknowledgement was disturbed in its last bit."""
    put = _Answers.put

    def twice(self: _Answers, answer: bytes) -> None:
        put(self, answer)
        if answer[0] == 0xA2:
            put(self, answer)

    monkeypatch.setattr(_Answers, "put", twice)
    image = load_pipeline(ALPHA).image
    controller.upload(image)
    assert controller.program_crc() == int.from_bytes(image[12:16], "little")


@pytest.mark.parametrize("command", ["goto", "run"])
def test_another_computer_uploads_just_before_the_start(
    controller: Controller,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    command: str,
) -> None:
    """Nothing that the command could have read before shows it."""
    assert main(["goto", str(ALPHA)]) == 0
    at, put = controller.targets(2), Node._put
    capsys.readouterr()

    def overtaken(self: Controller, index: int, *more: Any) -> None:
        if index in (COMMAND, NAMED_START) and more != (None, ENABLE):
            monkeypatch.undo()
            self.upload(OTHER)
        put(self, index, *more)

    monkeypatch.setattr(Node, "_put", overtaken)
    words = ("goto", str(ALPHA), "--to", "5", "5") if command == "goto" else ("run", str(ALPHA))
    assert main(words) == 5
    assert "another command has loaded another program" in capsys.readouterr().err
    assert controller.targets(2) == at


def test_a_controller_that_knows_no_named_start(
    controller: Controller, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One of an older minor version."""
    put = Node._put

    def refused(self: Node, index: int, sub: int | None, value: int) -> None:
        if index == NAMED_START:
            raise SdoAbortedError(0x06020000)
        put(self, index, sub, value)

    monkeypatch.setattr(Node, "_put", refused)
    assert main(["goto", str(ALPHA), "--to", "5", "5"]) == 0
    assert controller.targets(2) == [5_000_000, 5_000_000]
