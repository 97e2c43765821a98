# SPDX-License-Identifier: MIT
"""Runs Python tests in groups, by what they need of the machine. Used by tools/run_tests and testing/choice. Starts and
ends processes; keeps their logs and reports in the build folder.

`free` tests run in parallel; those marked `serial` measure time and run alone; those marked `bus` run one at a time
inside tools/with-vcan, which gives all of them one vcan0. Tests marked `long` run only if all tests are requested.

Importing all test files takes as long as many tests. So pytest gets only the files whose text contains the mark of the
group. `unnamed` finds the files whose tests have the mark in another way, by what another group has recorded.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from pathlib import Path

from testing import recording
from testing.reach import Recorded, test_files
from testing.verdict import Count, read_junit

MARKS = {
    "free": "not bus and not serial",
    "serial": "serial and not bus",
    "bus": "bus",
}
# pytest-timeout (pyproject.toml, tests/conftest.py) ends a test that hangs. It cannot end a test that hangs outside
# Python: when a test has run for this time, the whole group is ended. A long test may take two hours.
LAST_LIMIT_S = 1800.0
LONG_LAST_LIMIT_S = 8100.0
_LOOK_S = 5.0


@dataclass
class Groups:
    """Runs groups of one tree and keeps what they recorded."""

    root: Path
    out: Path  # reports and records go here
    is_long: bool = False
    last_limit_s: float | None = None  # None: LAST_LIMIT_S, or LONG_LAST_LIMIT_S with is_long
    records: list[Path] = field(default_factory=list)
    _running: list[subprocess.Popen[bytes]] = field(default_factory=list)

    def run(self, group: str, files: Sequence[str] = (), log: Path | None = None) -> Count:
        """One group: all of its tests, or those of some files. `log`: a file that takes what pytest prints."""
        record = self.out / f"record-{group}"
        report = self.out / f"pytest-{group}.xml"
        self.out.mkdir(parents=True, exist_ok=True)
        report.unlink(missing_ok=True)
        for old in record.glob("*.jsonl"):
            old.unlink()
        self.records.append(record)
        environment = _with_bytecode(os.environ) | {
            "HODOGRAPH_RECORD": str(record),
            "HODOGRAPH_GROUP": group,
            "OPENBLAS_NUM_THREADS": "1",  # a group has a process for each core
            "PYTHONPATH": os.pathsep.join(
                [str(self.root / "tools"), *filter(None, [os.environ.get("PYTHONPATH")])]
            ),
        }
        with open(log, "wb") if log else nullcontext() as out:
            process = subprocess.Popen(
                self._command(group, report, files or self.marked(group)),
                cwd=self.root,
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=out,
                process_group=0,
            )
        self._running.append(process)
        hung = self._wait(process, record)
        self._running.remove(process)
        count = read_junit(report, group, process.returncode)
        count.failures += [f"{test}: hung" for test in hung]
        return count

    def end(self) -> None:
        """Ends the groups that run in other threads."""
        for process in list(self._running):
            _end(process)

    def marked(self, group: str) -> list[str]:
        """Test files that name the mark of a group; none for `free`: it has those of all files."""
        if group == "free":
            return []
        mark = re.compile(rf"\bmark\.{group}\b")
        return [
            file
            for file in test_files(self.root)
            if mark.search((self.root / file).read_text(encoding="utf-8"))
        ]

    def unnamed(self) -> list[str]:
        """Failures: files with tests of a group, as a group that collected them saw, that do not name its mark."""
        return [
            f"{file}: its tests marked {group} do not run: write pytest.mark.{group} in this file"
            for file, groups in sorted(self.recorded().marks.items())
            for group in sorted(groups)
            if file not in self.marked(group)
        ]

    def recorded(self) -> Recorded:
        """What all groups that have run wrote down."""
        whole = Recorded()
        for record in self.records:
            whole.add(recording.read(record))
        return whole

    def _command(self, group: str, report: Path, files: Sequence[str]) -> list[str]:
        marks = MARKS[group] if self.is_long else f"({MARKS[group]}) and not long"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "testing.recording"]
        command += [f"--junitxml={report}", "-m", marks]
        if group == "free":
            # One more than there are cores: for a quarter of their time, tests wait for processes and devices.
            workers = min((os.cpu_count() or 1) + 1, 8)
            # In their order: a process makes once what the tests of a file share. At the end, from each other.
            command += ["-n", str(workers), "--dist", "worksteal"]
        if group == "bus":
            own = ["--own", "--name", f"test-{os.getpid()}"]
            command = [str(self.root / "tools/with-vcan"), *own, *command]
        return [*command, *files]

    def _wait(self, process: subprocess.Popen[bytes], record: Path) -> list[str]:
        """Waits for the end; names of tests because of which the group had to be ended."""
        limit_s = self.last_limit_s or (LONG_LAST_LIMIT_S if self.is_long else LAST_LIMIT_S)
        try:
            while True:
                try:
                    process.wait(_LOOK_S)
                    return []
                except subprocess.TimeoutExpired:
                    limit = time.time() - limit_s
                    hung = [test for test, at in recording.unfinished(record) if at < limit]
                if hung:
                    _end(process)
                    return hung
        except BaseException:
            _end(process)
            raise


def _with_bytecode(environment: Mapping[str, str]) -> dict[str, str]:
    """Without the variable that keeps Python from writing bytecode: else each of some hundred processes compiles all
    modules that it imports.
    """
    return {name: text for name, text in environment.items() if name != "PYTHONDONTWRITEBYTECODE"}


def _end(process: subprocess.Popen[bytes]) -> None:
    for number in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(process.pid, number)
            process.wait(_LOOK_S)
        except ProcessLookupError:
            process.wait()
            return
        except subprocess.TimeoutExpired:
            continue
