# SPDX-License-Identifier: MIT
"""The result of one planted mistake, and the file that keeps results until the source changes. Used by tools/mutants,
mutation/c_tests, mutation/native_module and mutation/python_tests. Reads this file and appends to it.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

KILLED = "killed"  # a test failed, or did not end in time
SURVIVED = "survived"  # every test passed
SAME = "same"  # the compiler makes the same machine code of it: no mistake
INVALID = "invalid"  # it does not compile: no mistake that could be committed


@dataclass(frozen=True)
class Outcome:
    """`by` is the test that noticed a killed mutant."""

    key: str
    path: str
    line: int
    kind: str
    diff: str
    result: str
    by: str = ""


class Ledger:
    """Outcomes by key, one JSON line each; what is in the file is not tried again."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.known: dict[str, Outcome] = {}
        if path.exists():
            for line in path.read_text(encoding="utf-8").splitlines():
                outcome = Outcome(**json.loads(line))
                self.known[outcome.key] = outcome

    def add(self, outcome: Outcome) -> None:
        """Keeps an outcome; a later one of the same mutant takes the place of an earlier one."""
        self.known[outcome.key] = outcome
        self.path.parent.mkdir(parents=True, exist_ok=True)
        with self.path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(outcome)) + "\n")
