# SPDX-License-Identifier: MIT
"""A plugin of pytest that writes down what each test file reads and starts, and how long its tests take. Used by
testing/groups, which starts pytest with it. Writes to FOLDER.

    HODOGRAPH_RECORD=FOLDER HODOGRAPH_GROUP=NAME pytest -p testing.recording ...

Every process that runs tests appends lines of JSON to a file of its own in FOLDER: at once, so that they are there
even when it ends badly. read() puts them together. Reads of this process only are seen, by Python's audit events; a
test file that starts processes is marked as such.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import FrameType
from typing import Any

import pytest

from testing.reach import Recorded

ROOT = Path(__file__).resolve().parents[2]
_PREFIX = str(ROOT) + os.sep
_PASSED_OVER = (".venv/", ".git/", ".hypothesis/", ".pytest_cache/", ".mypy_cache/", "build/tests/")
_OF_PYTHON = f"{os.sep}__pycache__{os.sep}"
# Programs that read what their arguments name and run nothing else of the tree.
_GROUPS = {"bus", "serial"}  # marks of tests that do not run with the others
_PLAIN_PROGRAMS = (
    "gcc",
    "clang",
    "qemu-system-",
    "arm-none-eabi-",
    "riscv64-unknown-elf-",
    "objdump",
)


def in_tree(path: object) -> str | None:
    """A path relative to the tree; None for what lies elsewhere or is no source of anything."""
    if not isinstance(path, str | bytes | os.PathLike):
        return None
    name = os.path.abspath(os.fsdecode(path))  # noqa: PTH100  (in an audit hook: nothing that opens files)
    if not name.startswith(_PREFIX) or _OF_PYTHON in name:
        return None
    inside = name[len(_PREFIX) :]
    return None if inside.startswith(_PASSED_OVER) else inside


class Recorder:
    """Listens to audit events for the test file that is at work."""

    def __init__(self, out: Path) -> None:
        out.mkdir(parents=True, exist_ok=True)
        self._out = out / f"{os.getpid()}-{time.monotonic_ns()}.jsonl"
        self._file: str | None = None
        self._said: set[tuple[str, ...]] = set()
        self._new: list[dict[str, Any]] = []
        self._lock = threading.RLock()
        self._busy = threading.local()

    def of(self, file: str | None) -> None:
        """From now on this file is at work; None: none."""
        self._file = file
        self.flush()

    def line(self, **fields: Any) -> None:
        """Adds a line; it is written by the next flush()."""
        with self._lock:
            self._new.append(fields)

    def flush(self) -> None:
        """Writes what is new."""
        with self._lock:
            new, self._new = self._new, []
        if new:
            with self._out.open("a", encoding="utf-8") as out:
                out.write("".join(json.dumps(fields) + "\n" for fields in new))

    def hook(self, event: str, arguments: tuple[Any, ...]) -> None:
        """For sys.addaudithook; an audit hook must not raise."""
        if self._file is None or event not in _EVENTS or getattr(self._busy, "now", False):
            return
        self._busy.now = True
        try:
            _EVENTS[event](self, arguments)
        except Exception:  # what cannot be understood may depend on anything
            self._other(())
        finally:
            self._busy.now = False

    def _open(self, arguments: tuple[Any, ...]) -> None:
        path, _, flags = arguments
        if not (isinstance(flags, int) and flags & os.O_WRONLY):
            self._reads(path)

    def _list(self, arguments: tuple[Any, ...]) -> None:
        self._reads("." if arguments[0] is None else arguments[0])

    def _reads(self, path: object) -> None:
        name = in_tree(path)
        if name is None:
            return
        module, is_import = _caller()
        if is_import:  # testing/reach.py finds imports by itself
            return
        self._say("reads", name)
        if module is not None and module != self._file:
            self._say("reads", name, module)

    def _popen(self, arguments: tuple[Any, ...]) -> None:
        program, words = arguments[0], arguments[1]
        words = [words] if isinstance(words, str | bytes) else list(words)
        for word in (program, *words):
            name = in_tree(word)
            if name is not None and os.path.isfile(_PREFIX + name):  # noqa: PTH113  (never raises)
                self._say("reads", name)
        first = in_tree(program)
        own = first is not None and first.startswith("build/")
        if not own and not Path(os.fsdecode(program)).name.startswith(_PLAIN_PROGRAMS):
            self._say("process", "")

    def _other(self, _: tuple[Any, ...]) -> None:
        self._say("process", "")

    def _say(self, what: str, name: str, module: str = "") -> None:
        assert self._file is not None
        key = (self._file if not module else "", module, what, name)
        if key not in self._said:
            self._said.add(key)
            self.line(file=self._file, what=what, name=name, module=module)


_EVENTS = {
    "open": Recorder._open,
    "os.listdir": Recorder._list,
    "os.scandir": Recorder._list,
    "subprocess.Popen": Recorder._popen,
    "os.exec": Recorder._other,
    "os.posix_spawn": Recorder._other,
    "os.system": Recorder._other,
}


def _caller() -> tuple[str | None, bool]:
    """The module of the tree that called last; whether Python's import system called, for a module."""
    frame: FrameType | None = sys._getframe(1)
    is_import = False
    while frame is not None:
        name = frame.f_code.co_filename
        is_import = is_import or name.startswith("<frozen importlib")
        if name.startswith(_PREFIX) and not name.startswith((_PREFIX + ".venv", __file__)):
            return name[len(_PREFIX) :], is_import
        frame = frame.f_back
    return None, is_import


def _processor_s() -> float:
    """Processor time of this process and of the children it has waited for."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


class Plugin:
    """Gives the recorder the test file that is at work."""

    def __init__(self, recorder: Recorder, group: str) -> None:
        self.recorder = recorder
        self.group = group

    @pytest.hookimpl(wrapper=True)
    def pytest_make_collect_report(self, collector: pytest.Collector) -> Iterator[None]:
        """While a file is imported it is at work."""
        if isinstance(collector, pytest.Module):
            self.recorder.of(in_tree(collector.path))
        try:
            return (yield)
        finally:
            self.recorder.of(None)

    def pytest_deselected(self, items: list[pytest.Item]) -> None:
        """Which files have tests for other groups."""
        left: dict[str, list[str]] = {}
        for item in items:
            file = in_tree(item.path)
            if file is not None:
                marks = {mark.name for mark in item.iter_markers()} & _GROUPS
                left[file] = sorted({*left.get(file, ()), *marks})
        self.recorder.line(what="left", files=left)

    @pytest.hookimpl(trylast=True)
    def pytest_collection_finish(self, session: pytest.Session) -> None:
        """How many tests of each file have been chosen."""
        chosen: dict[str, int] = {}
        for item in session.items:
            file = in_tree(item.path)
            if file is not None:
                chosen[file] = chosen.get(file, 0) + 1
        self.recorder.line(what="chosen", group=self.group, files=chosen)
        self.recorder.flush()

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
        """A test from its set-up to its tear-down."""
        file = in_tree(item.path)
        began_s, began_cpu_s = time.monotonic(), _processor_s()
        self.recorder.line(what="begins", file=file, test=item.nodeid, at=time.time())
        self.recorder.of(file)
        try:
            return (yield)
        finally:
            fields = {
                "seconds": round(time.monotonic() - began_s, 3),
                "cpu_s": round(_processor_s() - began_cpu_s, 3),
            }
            self.recorder.line(what="ended", file=file, test=item.nodeid, **fields)
            self.recorder.of(None)

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_makereport(self, item: pytest.Item) -> Iterator[None]:
        """Any phase that failed."""
        report: Any = yield
        if report.failed:
            self.recorder.line(what="failed", file=in_tree(item.path))
        return report  # type: ignore[no-any-return]


def pytest_configure(config: pytest.Config) -> None:
    """Where a folder is given, everything is written there."""
    out = os.environ.get("HODOGRAPH_RECORD")
    if out is None:
        return
    recorder = Recorder(Path(out))
    sys.addaudithook(recorder.hook)
    plugin = Plugin(recorder, os.environ.get("HODOGRAPH_GROUP", ""))
    config.pluginmanager.register(plugin, "hodograph-recording")


def _lines(out: Path) -> Iterator[dict[str, Any]]:
    for path in sorted(out.glob("*.jsonl")):
        for text in path.read_text(encoding="utf-8").splitlines():
            try:
                yield json.loads(text)
            except ValueError:  # cut off where a process was killed
                continue


def read(out: Path) -> Recorded:
    """All that was written to a folder."""
    recorded = Recorded()
    for line in _lines(out):
        what, file = line["what"], line.get("file")
        if what == "chosen":
            for name, tests in line["files"].items():
                recorded.groups.setdefault(name, {})[line["group"]] = tests
        elif what == "left":
            for name, marks in line["files"].items():
                recorded.marks.setdefault(name, set()).update(marks)
        elif file is None:
            continue
        elif what == "failed":
            recorded.failed.add(file)
        elif what == "ended":
            recorded.seconds.setdefault(file, {})[line["test"]] = line["seconds"]
            recorded.cpu_s[file] = recorded.cpu_s.get(file, 0.0) + line["cpu_s"]
        elif what == "process":
            recorded.processes.add(file)
        elif what == "reads" and line["module"]:
            recorded.module_reads.setdefault(line["module"], set()).add(line["name"])
        elif what == "reads":
            recorded.reads.setdefault(file, set()).add(line["name"])
    return recorded


def unfinished(out: Path) -> list[tuple[str, float]]:
    """Tests that have begun and not ended, and when (time.time())."""
    open_: dict[tuple[str, str], float] = {}
    for path in sorted(out.glob("*.jsonl")):
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                fields = json.loads(line)
            except ValueError:
                continue
            if fields["what"] == "begins":
                open_[path.name, fields["test"]] = fields["at"]
            elif fields["what"] == "ended":
                open_.pop((path.name, fields["test"]), None)
    return [(test, at) for (_, test), at in open_.items()]
