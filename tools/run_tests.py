#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""run_tests.py: runs tests, C and Python, and counts them together: `make check`, `make test` and `make test-all`.

    --suite check   what a change can reach since it last passed, as much as the budget allows; says what remains
    --suite test    everything but the tests marked `long`
    --suite all     everything

Run by these three targets. Starts processes; writes their reports below BUILD.

The last line of its output is `N passed, N failed` (and `, N skipped` where there are any); the exit status is 0 only
when none has failed and, but for `check`, at least one has passed. A C test binary that crashes, or says nothing,
counts as one failed test. What has passed is kept in the cache (testing/cache.py), which only `check` reads.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from testing.cache import Stamps
from testing.choice import Choice, choose
from testing.groups import MARKS, Groups
from testing.reach import Reach
from testing.units import Units
from testing.verdict import Count

ROOT = Path(__file__).resolve().parent.parent
_SLOWEST = 10  # tests named at the end
_UNIT_WORKERS = 1  # beside the free Python tests, which take the other processors


@dataclass
class Run:
    """One run of a suite."""

    build: Path
    suite: str
    total: Count = field(default_factory=Count)
    times: list[tuple[str, float, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.began_s = time.time()
        is_check = self.suite == "check"
        self.units = Units(ROOT, self.build, Stamps("units", used=is_check))
        self.reach = Reach(ROOT, Stamps("python"))
        self.groups = Groups(ROOT, self.build / "tests", is_long=self.suite == "all")

    def everything(self, only: str | None) -> None:
        """All tests of the suite: C tests and those that need a bus beside the free ones, then what must be alone.

        Tests on a bus wait for its clock most of their time, and none of their verdicts depends on load.
        """
        with ThreadPoolExecutor(2) as pool:
            beside = []
            if only != "python":
                workers = _UNIT_WORKERS if only is None else os.cpu_count() or 1
                beside.append(pool.submit(self._units, self.units.binaries(), workers))
            try:
                if only != "unit":
                    beside.append(pool.submit(self._group, "bus", log=self.groups.out / "bus.log"))
                    self.total.add(self._group("free"))
                for part in beside:
                    self.total.add(part.result())
            except BaseException:
                self.groups.end()
                raise
        if only != "unit":
            print((self.groups.out / "bus.log").read_text(encoding="utf-8", errors="replace"))
            self.total.add(self._group("serial"))
            self.total.failures += self.groups.unnamed()

    def chosen(self, choice: Choice) -> None:
        """What `check` has chosen."""
        with ThreadPoolExecutor(1) as pool:
            unit = pool.submit(self._units, choice.binaries, _UNIT_WORKERS)
            for group in MARKS:
                if choice.files[group]:
                    self.total.add(self._group(group, choice.files[group]))
            self.total.add(unit.result())

    def keep(self) -> None:
        """Stamps for the Python test files that have passed."""
        self.reach.keep(self.groups.recorded(), self.began_s)
        self.units.stamps.prune()
        self.reach.stamps.prune()

    def say(self) -> None:
        """The slowest tests, the time of each group, the failures and the count, which is the last line."""
        slow = sorted(self._seconds(), reverse=True)[:_SLOWEST]
        if slow:
            print("\nslowest:")
            print("\n".join(f"  {seconds:7.1f} s  {name}" for seconds, name in slow))
        if self.times:
            print("\ngroups:")
            print("\n".join(f"  {s:7.1f} s  {name:8} {count}" for name, s, count in self.times))
        print()
        for failure in self.total.failures:
            print(f"failed: {failure}")
        print(self.total, flush=True)

    def _seconds(self) -> list[tuple[float, str]]:
        tests = self.groups.recorded().seconds.values()
        python = [(seconds, name) for file in tests for name, seconds in file.items()]
        return python + [(seconds, name) for name, seconds in self.units.seconds.items()]

    def _units(self, binaries: list[Path], workers: int) -> Count:
        began_s = time.monotonic()
        count = self.units.run(binaries, workers)
        if binaries:
            self.times.append(("C", time.monotonic() - began_s, str(count)))
        return count

    def _group(self, group: str, files: list[str] | None = None, log: Path | None = None) -> Count:
        print(f"\n== Python tests: {group}", flush=True)
        began_s = time.monotonic()
        count = self.groups.run(group, files or (), log)
        sys.stdout.flush()
        self.times.append((group, time.monotonic() - began_s, str(count)))
        return count


def _ended(number: int, _: object) -> None:
    """A signal ends what is running first; see groups.py."""
    raise SystemExit(128 + number)


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--suite", choices=("check", "test", "all"), default="test")
    parser.add_argument("--only", choices=("unit", "python"), help="not with check")
    parser.add_argument("--budget", type=float, default=60.0, help="seconds, of check")
    options = parser.parse_args()
    build = options.build.resolve()
    build.mkdir(exist_ok=True)
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, _ended)
    run = Run(build, options.suite)
    if options.suite == "check":
        choice = choose(ROOT, run.units, run.reach, options.budget)
        print(choice.text(), flush=True)
        run.chosen(choice)
    else:
        run.everything(options.only)
    run.keep()
    run.say()
    has_passed = run.total.passed > 0 or options.suite == "check"
    return 0 if has_passed and not run.total.failures else 1


if __name__ == "__main__":
    sys.exit(main())
