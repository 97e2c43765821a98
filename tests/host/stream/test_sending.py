# SPDX-License-Identifier: MIT
"""Sending chunks to a scripted controller: lost answers, wrong bytes, no room, refusals; and the journal."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from hodograph.bus.address import parse_address
from hodograph.bus.sdo import stream_channel
from hodograph.bus.sdo.objects import STREAM
from hodograph.bus.sdo.stream_channel import ABORT_NO_ROOM, close_stream, send_chunk, stream_status
from hodograph.bus.sdo.upload import ABORT_VALUE_RANGE
from hodograph.cli.stream_command import _free_rate
from hodograph.config import load_machine
from hodograph.errors import BusError, InputError, RefusedError
from hodograph.stream.journal import Entry, Journal, load, mark
from hodograph.stream.sender import Sender

ROOT = Path(__file__).resolve().parents[3]
JOB = 7


class Scripted:
    """A node whose transfers go as the script says; each step is an error, or None for success."""

    def __init__(self, script: list[Exception | None], wanted: int, refused: int = 0) -> None:
        self.script = script
        self.values = {3: JOB, 4: wanted, 5: refused, 6: 3}
        self.transfers = 0
        self.written: list[tuple[int, int, int]] = []
        self.sdo = SimpleNamespace(RESPONSE_TIMEOUT=1.0)

    def patiently(self, index: int, sub: int, action: Callable[[], None]) -> None:
        assert (index, sub) == (STREAM, 1)
        action()

    def read(self, index: int, sub: int) -> int:
        assert index == STREAM
        return self.values.get(sub, 0)

    def write(self, index: int, sub: int, value: int) -> None:
        self.written.append((index, sub, value))

    def who(self) -> str:
        return "node 1"


@pytest.fixture(autouse=True)
def _scripted_download(monkeypatch: pytest.MonkeyPatch) -> None:
    def download(node: Any, index: int, data: bytes) -> None:
        assert (index, data) == (STREAM, b"chunk")
        node.transfers += 1
        error = node.script.pop(0)
        if error is not None:
            raise error

    monkeypatch.setattr(stream_channel, "block_download", download)


def _send(node: Any) -> bool:
    return send_chunk(node, b"chunk", JOB, 5, "part.ngc:12")


def test_a_chunk_is_sent_once() -> None:
    node = Scripted([None], wanted=6)
    assert _send(node)
    assert node.transfers == 1


def test_no_room_is_no_error() -> None:
    assert not _send(Scripted([SdoAbortedError(ABORT_NO_ROOM)], wanted=5))


def test_a_lost_transfer_is_sent_again() -> None:
    node = Scripted([SdoCommunicationError("lost"), SdoCommunicationError("lost"), None], wanted=5)
    assert _send(node)
    assert node.transfers == 3
    assert node.sdo.RESPONSE_TIMEOUT == 1.0


def test_a_lost_answer_is_found_by_the_wanted_sequence() -> None:
    node = Scripted([SdoCommunicationError("no answer")], wanted=6)
    assert _send(node)
    assert node.transfers == 1


@pytest.mark.parametrize("code", [-4, -80, -81])
def test_wrong_bytes_are_sent_again(code: int) -> None:
    node = Scripted([SdoAbortedError(ABORT_VALUE_RANGE), None], wanted=5, refused=code)
    assert _send(node)
    assert node.transfers == 2


def test_a_refusal_names_file_and_line() -> None:
    node = Scripted([SdoAbortedError(ABORT_VALUE_RANGE)], wanted=5, refused=-72)
    with pytest.raises(RefusedError, match=r"part\.ngc:12: node 1 refused .*-72"):
        _send(node)
    assert node.transfers == 1


def test_what_never_comes_through_ends_with_a_way_on() -> None:
    node = Scripted([SdoCommunicationError("lost")] * 4, wanted=5)
    with pytest.raises(BusError, match=r"part\.ngc:12: .*--continue"):
        _send(node)


def test_the_status_knows_what_is_not_known() -> None:
    node: Any = Scripted([], wanted=5)
    node.values |= {2: 1, 7: 1000, 8: 2500, 11: 3 << 40, 12: 0xFFFFFFFF}
    status = stream_status(node)
    assert (status.committed_s, status.way_mm, status.remaining_s) == (2.5, 3.0, None)
    node.values[12] = 4000
    assert stream_status(node).remaining_s == 4.0


def test_only_an_open_stream_is_closed() -> None:
    node: Any = Scripted([], wanted=0)
    close_stream(node)
    assert node.written == []
    node.values[2] = 3
    close_stream(node)
    assert node.written == [(STREAM, 15, 1)]


def _entry(file: Path) -> Entry:
    return Entry((mark(file),), "mill.toml", {"tolerance_mm": 0.01}, 100)


def test_the_journal_comes_back(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "state" / "stream.json", _entry(part))
    journal.update(section=3, first=2, way_q40=5 << 40, starts=((3, 1 << 40), (4, 9 << 40)))
    found = load(journal.file)
    assert found == journal.entry
    assert found.job == 102
    assert not list(journal.file.parent.glob("*.new"))


def test_a_changed_file_is_not_continued(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))
    part.write_text("G1 X2 F100 \n")
    with pytest.raises(InputError, match="has been changed"):
        load(journal.file)


def test_a_job_that_is_done_is_not_continued(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))
    journal.update(done=True)
    with pytest.raises(InputError, match="came to its end"):
        load(journal.file)


@pytest.mark.parametrize("text", ["", "{}", "[1]", '{"version": 1}', json.dumps({"version": 9})])
def test_a_damaged_journal_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "stream.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"stream\.json: "):
        load(file)


def test_no_journal(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing to continue"):
        load(tmp_path / "none.json")


class Overridden:
    """A controller that takes an override, and what was said."""

    def __init__(self) -> None:
        self.percents: list[int] = []
        self.said: list[str] = []
        self.controller = SimpleNamespace(override=self.percents.append)
        self.note = self.said.append


@pytest.mark.parametrize(
    ("rates", "slow", "percents"),
    [
        ([20_000.0], 5_000.0, [25]),
        ([4_000.0], 5_000.0, []),
        ([20_000.0], None, []),
        ([6_000.0, 6_001.0, 12_000.0], 5_000.0, [83, 41]),
        ([1e9], 5_000.0, [1]),
    ],
)
def test_feed_is_lowered_to_what_the_bus_carries(
    rates: list[float], slow: float | None, percents: list[int]
) -> None:
    """And never raised again: what was planned first may need less than what comes."""
    at, rate = Overridden(), iter(rates)
    plan: Any = SimpleNamespace(greatest_rate=lambda: next(rate))
    machine: Any = None
    known: Any = at
    sender = Sender(known, machine, plan, lambda *_: None, slow=slow)
    for _ in rates:
        sender._slow_down()
    assert at.percents == percents
    assert len(at.said) == len(percents)
    assert all("the bus has 5.0 for it: feed override set to" in text for text in at.said)


def test_the_free_part_of_a_bus() -> None:
    """A virtual bus has no bit rate; of a real one the chunks get what setpoints leave, less pauses."""
    machine = load_machine(ROOT / "examples" / "machines" / "paper_alpha.toml")
    assert _free_rate(machine, parse_address("socketcan:vcan0")) is None
    rate = _free_rate(machine, parse_address("socketcan:can0"))
    assert rate is not None
    assert 10_000 < rate < 30_000
