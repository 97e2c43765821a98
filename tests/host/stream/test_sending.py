# SPDX-License-Identifier: MIT
"""Sending chunks to a scripted controller: lost answers, wrong bytes, no room, refusals; and the journal. Run by
pytest; writes to temporary folders.
"""

from __future__ import annotations

import errno
import json
from argparse import Namespace
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from hodograph.bus.address import parse_address
from hodograph.bus.sdo import stream_channel
from hodograph.bus.sdo.controller import Controller
from hodograph.bus.sdo.objects import OFF, QUICK_STOPPING, READY, RUNNING, STOPPING, STREAM
from hodograph.bus.sdo.stream_channel import (
    ABORT_NO_ROOM,
    OPEN,
    STOPPED,
    UNDERRUN,
    StreamStatus,
    close_stream,
    send_chunk,
    stream_status,
)
from hodograph.bus.sdo.upload import ABORT_VALUE_RANGE
from hodograph.cli import stream_command
from hodograph.cli.main import main
from hodograph.cli.stream_command import _free_rate, _rests_at, journal_file
from hodograph.config import Homing, Machine, Supervision, load_machine
from hodograph.errors import BusError, InputError, PlanError, RefusedError, RunError
from hodograph.stream.chunk import largest_chunk
from hodograph.stream.journal import (
    Entry,
    Journal,
    journal_lock,
    load,
    machine_mark,
    mark,
    require_same_machine,
)
from hodograph.stream.plan import Place, PlannedSection
from hodograph.stream.resuming import Nearest
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


@pytest.mark.parametrize(("code", "named"), [(-80, True), (-81, False)])
def test_a_format_that_is_refused_each_time_names_versions(code: int, named: bool) -> None:
    node = Scripted([SdoAbortedError(ABORT_VALUE_RANGE)] * 4, wanted=5, refused=code)
    with pytest.raises(BusError, match=rf"part\.ngc:12: .*{code}.*--continue") as raised:
        _send(node)
    assert ("different versions" in str(raised.value)) == named
    assert node.transfers == 4


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
    assert (status.committed_s, status.arc_length_mm, status.remaining_s) == (2.5, 3.0, None)
    node.values[12] = 4000
    assert stream_status(node).remaining_s == 4.0


def test_the_keys_of_the_status_are_an_interface() -> None:
    """docs/reference/cli.md, `hodograph status --json`."""
    keys = "state job wanted free_bytes committed_s sequence line way_mm remaining_s underruns"
    found = _status(OPEN).json()
    assert list(found) == keys.split()
    assert found["way_mm"] == 3.0


def test_only_an_open_stream_is_closed() -> None:
    node: Any = Scripted([], wanted=0)
    close_stream(node)
    assert node.written == []
    node.values[2] = 3
    close_stream(node)
    assert node.written == [(STREAM, 15, 1)]


def _entry(file: Path) -> Entry:
    return Entry((mark(file),), "mill.toml", {"tolerance_mm": 0.01, "reading": {}}, 100)


def test_the_journal_comes_back(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "state" / "stream.json", _entry(part))
    journal.update(section=3, first=2, arc_q40=5 << 40, starts=((3, 1 << 40), (4, 9 << 40)))
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


_MACHINE = load_machine(ROOT / "examples" / "machines" / "mill.toml")


def _with_axis(**changes: Any) -> Machine:
    return replace(_MACHINE, axes=(replace(_MACHINE.axes[0], **changes), *_MACHINE.axes[1:]))


@pytest.mark.parametrize(
    "changed",
    [
        replace(_MACHINE, offset_mm=(0.0, 0.001, 0.0)),
        replace(_MACHINE, jerk_mm_s3=400_000.0),
        _with_axis(acceleration_mm_s2=1000.0),
        _with_axis(counts_per_unit=100_000),
        _with_axis(homing=Homing(35, 1.0)),
    ],
)
def test_a_job_is_not_continued_on_another_machine(changed: Machine) -> None:
    entry = Entry((), "mill.toml", {}, 100, machine_sha256=machine_mark(_MACHINE))
    require_same_machine(entry, _MACHINE)
    with pytest.raises(InputError, match=r"mill\.toml: its work offset, .* have been changed"):
        require_same_machine(entry, changed)


@pytest.mark.parametrize(
    "changed",
    [
        replace(_MACHINE, file=Path("other.toml"), start_tolerance_mm=0.1),
        replace(_MACHINE, supervision=Supervision(missed_max=3)),
        _with_axis(drive=None, following_timeout_ms=7),
    ],
)
def test_a_machine_that_gives_the_same_path_continues_a_job(changed: Machine) -> None:
    require_same_machine(Entry((), "", {}, 1, machine_sha256=machine_mark(_MACHINE)), changed)


def test_a_job_that_is_done_is_not_continued(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))
    journal.update(done=True)
    with pytest.raises(InputError, match="came to its end"):
        load(journal.file)


@pytest.mark.parametrize(
    "text", ["", "{}", "[1]", "null", '"text"', '{"version": 1}', json.dumps({"version": 9})]
)
def test_a_damaged_journal_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "stream.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"stream\.json: "):
        load(file)


def test_no_journal(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="nothing to continue"):
        load(tmp_path / "none.json")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("job0", "7"),
        ("arc_q40", None),
        ("options", {"tolerance_mm": 0.01}),
        ("options", {"tolerance_mm": "fine", "reading": {}}),
        ("options", {"tolerance_mm": 0.01, "reading": 1}),
        ("machine", 1),
        ("files", 3),
        ("starts", [1]),
        ("starts", [[0, float("inf")]]),
    ],
)
def test_a_journal_with_a_wrong_value_is_refused(tmp_path: Path, key: str, value: object) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))
    text = json.loads(journal.file.read_text()) | {key: value}
    journal.file.write_text(json.dumps(text))
    with pytest.raises(InputError, match=r"stream\.json: is no journal"):
        load(journal.file)


def test_half_a_journal_is_refused(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))
    text = journal.file.read_text()
    for end in range(len(text) - 2):
        journal.file.write_text(text[:end])
        with pytest.raises(InputError, match=r"stream\.json: is no journal"):
            load(journal.file)


def test_three_of_the_largest_chunk_fit_any_ring() -> None:
    """With the heads that the controller puts before them, in whole units: one of them at any place leaves room for
    another one.
    """
    for head in (8, 376, 384):
        for ring in range(1024, 49 * 1024, 8):
            block = -(-(largest_chunk(ring - head) + head) // 8) * 8
            assert block <= head or 3 * block <= ring


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 100_000, "null", "\0", "[]", '"a"'])
def test_other_json_is_no_journal(tmp_path: Path, text: str) -> None:
    file = tmp_path / "stream.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"stream\.json: is no journal"):
        load(file)


def test_a_journal_with_an_impossible_name(tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))
    text = json.loads(journal.file.read_text())
    for name in ("part\0.ngc", 7):
        text["files"][0]["path"] = name
        journal.file.write_text(json.dumps(text))
        with pytest.raises(InputError, match=r"stream\.json: is no journal"):
            load(journal.file)


def test_a_disk_that_is_full_keeps_the_old_journal(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    journal = Journal(tmp_path / "stream.json", _entry(part))

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("hodograph.stream.journal.os.fsync", full)
    with pytest.raises(InputError, match="the journal cannot be written: No space left"):
        journal.update(section=3)
    assert load(journal.file).section == 0


def test_without_a_place_for_the_journal_the_message_says_what_to_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As in a container with a user of its own: no home folder, or none that can be written."""

    def no_home() -> Path:
        raise RuntimeError("Could not determine home directory.")

    (tmp_path / "home").touch()
    with (
        pytest.raises(InputError, match=r"Not a directory: name another with .* --journal FILE"),
        journal_lock(tmp_path / "home/hodograph/stream.json"),
    ):
        pass
    monkeypatch.setattr(Path, "home", no_home)
    monkeypatch.delenv("XDG_STATE_HOME", raising=False)
    with pytest.raises(InputError, match=r"no home folder: name another with .* --journal FILE"):
        journal_file(Namespace(journal=None))
    assert journal_file(Namespace(journal=tmp_path / "own.json")) == tmp_path / "own.json"
    monkeypatch.setenv("XDG_STATE_HOME", "/state")
    assert journal_file(Namespace(journal=None)) == Path("/state/hodograph/stream.json")


def test_a_journal_has_one_writer(tmp_path: Path) -> None:
    file = tmp_path / "state" / "stream.json"
    with (
        journal_lock(file),
        pytest.raises(InputError, match="another hodograph stream writes this journal"),
        journal_lock(file),
    ):
        pass
    with journal_lock(file):
        pass


class Stopped:
    """A session whose controller notes that it was stopped."""

    acted = True
    stop_after = Controller.stop_after

    def __init__(self, controller: object = None) -> None:
        self.stops = 0
        self.controller = controller or self
        self.said: list[str] = []
        self.note = self.said.append

    def stop_and_wait(self) -> None:
        self.stops += 1


def stops_after(monkeypatch: pytest.MonkeyPatch, error: BaseException, *, moved: bool) -> int:
    """How often a job that ends with the error stops the axes."""
    at: Any = Stopped()
    at.acted = moved
    nothing: Any = None

    def fail(_: Sender) -> None:
        raise error

    monkeypatch.setattr(Sender, "_run", fail)
    with pytest.raises(type(error)):
        Sender(at, nothing, nothing, lambda *_: None).run()
    return int(at.stops)


@pytest.mark.parametrize("error", [KeyboardInterrupt(), InputError("bad"), ZeroDivisionError()])
def test_whatever_ends_a_job_stops_the_axes_first(
    monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    """Before the plan is waited for, which may take a while."""
    assert stops_after(monkeypatch, error, moved=True) == 1


@pytest.mark.parametrize(("error", "stops"), [(KeyboardInterrupt(), 1), (RefusedError("no"), 0)])
def test_a_job_that_moved_nothing_stops_no_other_motion(
    monkeypatch: pytest.MonkeyPatch, error: BaseException, stops: int
) -> None:
    assert stops_after(monkeypatch, error, moved=False) == stops


def _status(state: int, underruns: int = 0) -> StreamStatus:
    return StreamStatus(state, JOB, 1, 0, 1.0, 0, 12, 3.0, None, underruns)


def test_a_job_that_cannot_be_planned_on_runs_to_its_last_chunk() -> None:
    def item(index: int, wait_s: float) -> None:
        raise PlanError(f"line 99: {index} {wait_s}")

    clock = SimpleNamespace(is_virtual=False)
    at: Any = Stopped(SimpleNamespace(wait_for=lambda *_: None, clock=clock))
    plan: Any = SimpleNamespace(item=item, reads_input=False)
    nothing: Any = None
    sender = Sender(at, nothing, plan, lambda *_: None)
    assert sender._send_one(None) is None
    assert not sender._over(_status(OPEN), all_sent=False)
    with pytest.raises(PlanError, match="line 99"):
        sender._over(_status(UNDERRUN), all_sent=False)


def _sender_of_one_chunk(journal: Any) -> Sender:
    chunk = SimpleNamespace(
        header=SimpleNamespace(
            line=12, job=JOB, sequence=5, job_start_q40=100, rest=None, last=False
        ),
        program=SimpleNamespace(length_q40=30),
        with_remaining=lambda _: SimpleNamespace(encode=lambda: b"chunk"),
    )
    section = PlannedSection(0, Path("part.ngc"), 1, ())
    clock = SimpleNamespace(is_virtual=False, now_s=lambda: 0.0)
    at: Any = Stopped(SimpleNamespace(clock=clock))
    plan: Any = SimpleNamespace(
        item=lambda *_: (section, chunk, 1.0), reads_input=False, after_s=lambda _: None
    )
    machine: Any = None
    sender = Sender(at, machine, plan, lambda *_: None, journal)
    sender._ahead.append(section)
    return sender


def test_the_journal_has_the_end_of_a_chunk_before_it_is_sent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A host that is killed before the answer leaves a motion that goes on to the end of this chunk."""
    known: dict[str, object] = {}

    def killed(*_: object) -> bool:
        raise KeyboardInterrupt

    monkeypatch.setattr("hodograph.stream.sender.send_chunk", killed)
    sender = _sender_of_one_chunk(SimpleNamespace(update=known.update))
    with pytest.raises(KeyboardInterrupt):
        sender._send_one(None)
    assert known["committed_q40"] == 130


def test_the_arc_length_in_the_journal_is_that_of_its_section() -> None:
    """Not that of the section before, which is the last one that was reported."""
    known: dict[str, object] = {}
    sender = _sender_of_one_chunk(SimpleNamespace(update=known.update))
    sender._ahead.append(PlannedSection(1, Path("part.ngc"), 2, (), start_q40=5 << 40))
    sender._note_place(arc_q40=4 << 40)
    sender._note_place(committed_q40=7 << 40)
    assert (known["section"], known["arc_q40"]) == (0, 4 << 40)
    sender._ahead.popleft()
    sender._note_place(committed_q40=9 << 40)
    assert (known["section"], known["arc_q40"]) == (1, 0)
    sender._note_place(arc_q40=2 << 40)
    sender._note_place(committed_q40=10 << 40)
    assert (known["section"], known["arc_q40"]) == (1, 2 << 40)


@pytest.mark.parametrize(("job", "state"), [(0, RUNNING), (JOB + 1, RUNNING), (JOB, OFF)])
def test_a_chunk_that_is_refused_because_the_controller_has_lost_the_job(
    monkeypatch: pytest.MonkeyPatch, job: int, state: int
) -> None:
    """The motion does not rest on the path then: the message must not say so."""

    def refused(*_: object) -> bool:
        raise RefusedError("of another job: the motion rests on the path")

    monkeypatch.setattr("hodograph.stream.sender.send_chunk", refused)
    monkeypatch.setattr(
        "hodograph.stream.sender.stream_status", lambda _: replace(_status(OPEN), job=job)
    )
    sender = _sender_of_one_chunk(None)
    controller: Any = sender.at.controller
    controller.state = lambda: state
    controller.who = lambda: "node 1"
    with pytest.raises(RunError, match=r"no longer has the job: .*--continue"):
        sender._send_one(replace(_status(OPEN), free_bytes=100))
    controller.state = lambda: RUNNING
    monkeypatch.setattr("hodograph.stream.sender.stream_status", lambda _: _status(OPEN))
    with pytest.raises(RefusedError, match="of another job"):
        sender._send_one(replace(_status(OPEN), free_bytes=100))


def test_a_job_that_the_controller_loses_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its power was gone for a moment."""
    sender = _sender_of_one_chunk(None)
    controller: Any = sender.at.controller
    controller.who = lambda: "node 1"
    found = iter([_status(OPEN), replace(_status(OPEN), job=0)])
    monkeypatch.setattr("hodograph.stream.sender.stream_status", lambda _: next(found))
    monkeypatch.setattr(Sender, "_check_bus", lambda _: None)
    monkeypatch.setattr(Sender, "_send_one", lambda *_: False)
    monkeypatch.setattr(Sender, "_may_start", lambda *_: False)
    with pytest.raises(RunError, match="no longer has the job"):
        sender._stream(JOB)


def test_underruns_of_all_jobs_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """The controller counts those of each job from 0."""
    sender = _sender_of_one_chunk(None)

    def over(_: Sender) -> None:
        raise InterruptedError

    monkeypatch.setattr(Sender, "_check_bus", over)
    for underruns in (3, 2):
        with pytest.raises(InterruptedError):
            sender._stream(JOB)
        sender._note_underruns(_status(OPEN, underruns), 0.0)
    assert sender._underruns_before + sender._underruns == 5


def test_a_quick_stop_ends_a_job_as_a_stop_does() -> None:
    """The drives are off then, and the message says how the job goes on."""
    states: list[int] = []

    def wait_for(wanted: tuple[int, ...], wait_s: float) -> int:
        states.extend(wanted)
        return OFF

    at: Any = Stopped(SimpleNamespace(wait_for=wait_for))
    nothing: Any = None
    sender = Sender(at, nothing, nothing, lambda *_: None)
    sender._ahead.append(PlannedSection(0, Path("part.ngc"), 1, ()))
    assert not sender._over(_status(OPEN), all_sent=False)
    assert QUICK_STOPPING in states
    states.clear()
    with pytest.raises(RunError, match="--continue goes on"):
        sender._over(_status(STOPPED), all_sent=False)
    assert OFF in states


@pytest.mark.parametrize(
    ("is_virtual", "reads_input", "waits"),
    [(True, False, True), (True, True, False), (False, False, False)],
)
def test_virtual_time_stands_still_for_the_planner(
    is_virtual: bool, reads_input: bool, waits: bool
) -> None:
    waited: list[float] = []
    controller = SimpleNamespace(clock=SimpleNamespace(is_virtual=is_virtual))
    at: Any = Stopped(controller)
    plan: Any = SimpleNamespace(item=lambda _, s: waited.append(s), reads_input=reads_input)
    nothing: Any = None
    assert Sender(at, nothing, plan, lambda *_: None)._send_one(None) is None
    assert (waited[0] > 10.0) == waits


def test_rests_for_want_of_chunks_are_said_now_and_then() -> None:
    at: Any = Stopped()
    nothing: Any = None
    sender = Sender(at, nothing, nothing, lambda *_: None)
    sender._ahead.append(PlannedSection(0, Path("part.ngc"), 1, ()))
    for tenth in range(121):
        sender._note_underruns(_status(OPEN, underruns=1 + tenth // 2), 0.1 * tenth)
    first, second = at.said
    assert "part.ngc:12: the next part came too late" in first
    assert "(once)" in first
    assert "(51 times so far)" in second


class Overridden:
    """A controller that takes an override, and what was said."""

    def __init__(self, percent: int = 100) -> None:
        self.percents: list[int] = []
        self.said: list[str] = []
        self.controller = SimpleNamespace(
            override=self.percents.append, read=lambda *_: [percent, *self.percents][-1]
        )
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


@pytest.mark.parametrize("operators", [0, 10])
def test_an_override_that_the_operator_has_lowered_is_not_raised(operators: int) -> None:
    """At 0 % the axes stand: they must not move again by themselves."""
    at = Overridden(operators)
    plan: Any = SimpleNamespace(greatest_rate=lambda: 20_000.0)
    known: Any = at
    nothing: Any = None
    Sender(known, nothing, plan, lambda *_: None, slow=5_000.0)._slow_down()
    assert (at.percents, at.said) == ([], [])


def test_an_override_that_the_operator_raises_again_is_lowered() -> None:
    at = Overridden(10)
    plan: Any = SimpleNamespace(greatest_rate=lambda: 20_000.0)
    known: Any = at
    nothing: Any = None
    sender = Sender(known, nothing, plan, lambda *_: None, slow=5_000.0)
    sender._slow_down()
    at.controller.read = lambda *_: 100
    sender._slow_down()
    assert at.percents == [25]


@pytest.mark.parametrize(
    ("before", "since", "state", "percents"),
    [
        (100, [], READY, [25, 100]),
        (60, [], READY, [25, 60]),
        (100, [10], READY, [25, 10]),  # by the operator
        (100, [], RUNNING, [25]),
        (10, [], READY, []),
    ],
)
@pytest.mark.parametrize("error", [None, RunError("stopped")])
def test_a_lowered_override_is_taken_back_at_the_end(
    monkeypatch: pytest.MonkeyPatch,
    before: int,
    since: list[int],
    state: int,
    percents: list[int],
    error: Exception | None,
) -> None:
    """At standstill, and if it is still the one that the job set."""
    at = Overridden(before)
    at.controller.state = lambda: state
    at.controller.stop_after = lambda _: None
    plan: Any = SimpleNamespace(greatest_rate=lambda: 20_000.0)
    known: Any = at
    nothing: Any = None

    def job(sender: Sender) -> None:
        sender._slow_down()
        at.percents.extend(since)
        if error is not None:
            raise error

    monkeypatch.setattr(Sender, "_run", job)
    with nullcontext() if error is None else pytest.raises(RunError):
        Sender(known, nothing, plan, lambda *_: None, slow=5_000.0).run()
    assert at.percents == percents


@pytest.mark.parametrize(
    ("next_bytes", "next_s", "planned_s", "slow", "at_once"),
    [
        (6000, 1.0, 1.5, 17e3, True),  # there after 0.6 s; 1 s of motion was sent
        (8000, 1.0, 1.5, 17e3, False),
        (12_000, 1.0, 5.0, 17e3, False),  # the feed override will be lowered
        (12_000, 1.0, 5.0, None, True),  # it rests at tails anyway
        (12_000, 1.0, 1.9, None, False),  # all of it is soon there
        (12_000, 1.5, 5.0, None, False),
        (None, 1.0, 5.0, None, False),
    ],
)
def test_motion_starts_when_waiting_is_of_no_use(
    next_bytes: int | None, next_s: float, planned_s: float, slow: float | None, at_once: bool
) -> None:
    """10 kB took 1 s and hold 1 s of motion."""
    item = None if next_bytes is None else (None, SimpleNamespace(size=next_bytes), next_s)
    plan: Any = SimpleNamespace(
        item=lambda *_: item,
        is_longer=lambda least_s, _: planned_s > least_s,
        reads_input=False,
    )
    at: Any = Stopped(SimpleNamespace(clock=SimpleNamespace(is_virtual=False)))
    nothing: Any = None
    sender = Sender(at, nothing, plan, lambda *_: None, slow=slow)
    sender._bytes, sender._sending_s, sender._motion_s = 10_000, 1.0, 1.0
    assert sender._need_not_wait() == at_once


def test_the_free_part_of_a_bus() -> None:
    """A virtual bus has no bit rate; of a real one the chunks get what setpoints leave, less pauses."""
    machine = load_machine(ROOT / "examples" / "machines" / "paper_alpha.toml")
    assert _free_rate(machine, parse_address("socketcan:vcan0")) is None
    rate = _free_rate(machine, parse_address("socketcan:can0"))
    assert rate is not None
    assert 10_000 < rate < 30_000


@pytest.mark.parametrize("state", [RUNNING, STOPPING])
def test_a_job_continues_where_the_axes_rest_and_not_where_they_brake(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, state: int
) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("G1 X1 F100\n")
    waits: list[float] = []

    class Braking:
        def answers(self, wait_s: float) -> bool:
            return True

        def state(self) -> int:
            return state

        def stop_and_wait(self) -> None:
            waits.append(1.0)

        def read(self, index: int, sub: int) -> int:
            return {3: 100, 11: (3 if waits else 2) << 40}.get(sub, 0)

    @contextmanager
    def connected(*_: object) -> Iterator[Braking]:
        yield Braking()

    monkeypatch.setattr(stream_command, "connect", connected)
    machine = load_machine(ROOT / "examples" / "machines" / "paper_alpha.toml")
    place = _rests_at(_entry(part), machine, parse_address("socketcan:vcan0"), 1.0)
    assert place == Place(0, 3 << 40)


def test_the_way_back_to_the_path_is_exact() -> None:
    """Far from zero too; of axes that stand off the path the last place in the journal is named, not the nearest."""
    passed = Nearest(Place(0, 0), 4, (1234.567891, -0.0000004, -0.5), 3.0)
    found = Nearest(Place(0, 5), 6, (1236.0, 0.0, -0.5), 1.5, passed)
    text = stream_command._off_the_path(_MACHINE, found)
    end = "then the same command with --z -0.5, then hodograph stream --continue: back to line 4"
    assert f"--to 1234.567891 0, {end}" in text
    assert "1.5 mm from the path of the job, at line 6" in text


@pytest.mark.parametrize(
    "words",
    [("part.ngc",), ("--tolerance", "0.1"), ("--machine", "mill.toml"), ("--feed", "600")],
)
def test_a_job_goes_on_with_its_own_files_and_options(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], words: tuple[str, ...]
) -> None:
    """Others would have no effect, which must not go unsaid."""
    journal = str(tmp_path / "stream.json")
    assert main(["stream", "--continue", "--journal", journal, *words]) == 2
    assert "of the last job: give none" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("given", "continued", "percent", "said"),
    [(None, False, 100, 0), (None, True, 30, 1), (10, True, 10, 0), (0, False, 0, 0)],
)
def test_the_override_with_which_a_job_begins(
    monkeypatch: pytest.MonkeyPatch, given: int | None, continued: bool, percent: int, said: int
) -> None:
    """One that continues keeps the present override, 30 %."""
    notes: list[str] = []
    monkeypatch.setattr(stream_command, "note", notes.append)
    at: Any = SimpleNamespace(controller=SimpleNamespace(read=lambda *_: 30))
    options = Namespace(override=given)
    assert stream_command._first_override(at, options, continued=continued) == percent
    assert len(notes) == said
