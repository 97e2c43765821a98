# SPDX-License-Identifier: MIT
"""The C tests under the sanitizers: a Unity binary for each tests/unit/test_*.c, and one for each tests/fuzz/fuzz_*.c,
which replays its corpus. Used by tools/run_tests and testing/choice. Starts processes; prints to stdout, keeps stamps
in the cache folder.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from testing.cache import Stamps, content, digest, tree
from testing.verdict import Count, read_unity

_LIMIT_S = 900
# Optimised too, with all cases: the PLAIN_BINS of the Makefile.
_IN_FULL = ("test_override", "test_stm32g4_flash")
DATA = "tests/data"  # what C tests read


@dataclass
class Units:
    """The binaries of a build."""

    root: Path
    build: Path
    stamps: Stamps
    seconds: dict[str, float] = field(default_factory=dict)  # by binary, of those that were run

    def binaries(self) -> list[Path]:
        """All of them, whether built or not; those that take longest first."""
        plain = [self.build / "host/tests" / name for name in _IN_FULL]
        return plain + self.sanitized()

    def sanitized(self) -> list[Path]:
        """One for each test file, of which some run a part of their cases only."""
        units = sorted((self.root / "tests/unit").glob("test_*.c"))
        sources = units + sorted((self.root / "tests/fuzz").glob("fuzz_*.c"))
        return [self.build / "asan/tests" / source.stem for source in sources]

    def changed(self) -> list[Path]:
        """Sanitized ones that have not passed with the content that they and their data have now."""
        data = tree(self.root / DATA)
        return [b for b in self.sanitized() if self.stamps.read(self._key(b, data)) is None]

    def run(self, binaries: Iterable[Path], workers: int) -> Count:
        """Runs these binaries; what has passed is kept as a stamp."""
        total = Count()
        data = tree(self.root / DATA)
        with ThreadPoolExecutor(workers) as pool:
            for count in pool.map(lambda binary: self._one(binary, data), binaries):
                total.add(count)
        return total

    def _one(self, binary: Path, data: str) -> Count:
        key = self._key(binary, data)
        began_s = time.monotonic()
        count = run_unit(binary, self.root)
        self.seconds[str(binary.relative_to(self.build))] = time.monotonic() - began_s
        if not count.failures and key == self._key(binary, data):
            self.stamps.write(key, {"passed": count.passed})
        return count

    def _key(self, binary: Path, data: str) -> str:
        return digest(["unit", binary.name, content(binary), data])


def run_unit(binary: Path, root: Path) -> Count:
    """Runs one Unity binary in the root of the tree; prints what it says unless all is well."""
    try:
        done = subprocess.run(
            [binary],
            cwd=root,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            errors="replace",
            timeout=_LIMIT_S,
            check=False,
        )
    except OSError as error:
        return Count(failures=[f"{binary.name}: {error.strerror}"])
    except subprocess.TimeoutExpired:
        return Count(failures=[f"{binary.name}: not finished after {_LIMIT_S} s"])
    count = read_unity(binary.name, done.stdout, done.returncode)
    if count.failures:
        print(f"{binary.name}: {count}\n{done.stdout}", flush=True)
    return count
