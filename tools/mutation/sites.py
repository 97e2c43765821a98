# SPDX-License-Identifier: MIT
"""A planted mistake: its place, the text that it replaces, and the changed source. Used by tools/mutants and mutation/.
No I/O.
"""

from __future__ import annotations

import hashlib
from dataclasses import dataclass


@dataclass(frozen=True)
class Mutant:
    """One mistake: characters `start` to `end` of the file `path` become `text`.

    `path` is relative to the root of the tree, `line` counts from 1, `kind` says what was changed
    (compare, logic, arithmetic, constant, negation, statement, index, boolean).
    """

    path: str
    line: int
    kind: str
    start: int
    end: int
    text: str

    def applied(self, source: str) -> str:
        """The source with the mistake in it."""
        return source[: self.start] + self.text + source[self.end :]

    def shown(self, source: str) -> str:
        """The lines concerned, before and after, as a short diff."""
        first = source.rfind("\n", 0, self.start) + 1
        last = source.find("\n", self.end)
        last = len(source) if last < 0 else last
        before = source[first:last]
        after = source[first : self.start] + self.text + source[self.end : last]
        removed = [f"    - {line.strip()}" for line in before.splitlines() if line.strip()]
        added = [f"    + {line.strip()}" for line in after.splitlines() if line.strip()]
        return "\n".join(removed + (added or ["    + (nothing)"]))

    def key(self, source: str) -> str:
        """Names this mutant of this very source: a result is kept for as long as the file stays as it is."""
        whole = f"{self.path}\0{self.start}\0{self.end}\0{self.text}\0{source}"
        return hashlib.sha256(whole.encode()).hexdigest()[:16]


def line_of(source: str, offset: int) -> int:
    """The line, from 1, of a character offset."""
    return source.count("\n", 0, offset) + 1
