# SPDX-License-Identifier: MIT
"""Stamps: results for one content of all inputs, kept outside the tree so that they need not be computed again. Used by
all tools that keep results. Reads and writes files in the cache folder.

A stamp lies in ${XDG_CACHE_HOME:-~/.cache}/hodograph/PART, under the hash of all that the finding depends on: sources,
tools, flags. The writer of a stamp has to include all of them in its key. A file that is damaged in any way, or was
made for another key, is treated as absent. A cache that cannot be written costs time and nothing else.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import time
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ABSENT = "absent"
_FORMAT = 1  # of the files of stamps
_KEPT_S = 60 * 24 * 3600.0  # a stamp that nobody used for so long is removed

Fact = dict[str, Any]


def folder() -> Path:
    """The folder of the cache; it need not exist."""
    base = os.environ.get("XDG_CACHE_HOME") or ""
    root = Path(base) if Path(base).is_absolute() else Path.home() / ".cache"
    return root / "hodograph"


def digest(parts: Iterable[str]) -> str:
    """A hash of texts in their order; no two lists of texts share one by concatenation."""
    whole = hashlib.sha256()
    for part in parts:
        data = part.encode("utf-8", "surrogateescape")
        whole.update(f"{len(data)}:".encode() + data)
    return whole.hexdigest()


def content(path: Path) -> str:
    """Hash of what a file contains; of the names in it for a folder; ABSENT where there is neither."""
    try:
        if path.is_dir():
            names = (p.name for p in path.iterdir() if p.name != "__pycache__")
            return digest(["folder", *sorted(names)])
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ABSENT


def files_below(path: Path) -> Iterator[Path]:
    """Every file below a folder in a fixed order, without compiled Python, shared libraries and packaging data."""
    for here, folders, files in os.walk(path):
        folders[:] = sorted(
            f for f in folders if f != "__pycache__" and not f.endswith(".egg-info")
        )
        for name in sorted(files):
            if not name.endswith((".pyc", ".so")):
                yield Path(here, name)


def tree(path: Path) -> str:
    """Hash of all files below a folder and of their names."""
    parts = ["tree"]
    for file in files_below(path):
        parts += [str(file.relative_to(path)), content(file)]
    return digest(parts)


def newest(path: Path) -> float:
    """When the last of the files below a folder was written; infinity where that cannot be said."""
    try:
        return max((file.stat().st_mtime for file in files_below(path)), default=0.0)
    except OSError:
        return math.inf


@dataclass
class Stamps:
    """The stamps of one part. `used` False: all are absent, and new ones are written all the same."""

    part: str
    used: bool = True
    base: Path | None = None  # of the cache; None: folder()

    def read(self, key: str) -> Fact | None:
        """What was found for this key; None where nothing was, or what there is cannot be trusted."""
        if not self.used:
            return None
        path = self._path(key)
        try:
            stored = json.loads(path.read_text(encoding="utf-8"))
            fact = stored["fact"]
            if not isinstance(fact, dict) or stored["sum"] != self._sum(key, fact):
                return None
        except (OSError, ValueError, KeyError, TypeError, RecursionError):
            return None
        self._touch(path)
        return fact

    def write(self, key: str, fact: Mapping[str, Any]) -> None:
        """Keeps a finding; it appears whole or not at all."""
        path = self._path(key)
        stored = {"fact": fact, "sum": self._sum(key, fact)}
        beside = path.with_suffix(f".{os.getpid()}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            beside.write_text(json.dumps(stored), encoding="utf-8")
            beside.replace(path)
        except OSError:
            return

    def prune(self, now_s: float | None = None) -> None:
        """Removes stamps that were not used in two months."""
        limit = (time.time() if now_s is None else now_s) - _KEPT_S
        for path in (self._root() / self.part).glob("*/*"):
            try:
                if path.stat().st_mtime < limit:
                    path.unlink()
            except OSError:
                continue

    def _root(self) -> Path:
        return folder() if self.base is None else self.base

    def _path(self, key: str) -> Path:
        return self._root() / self.part / key[:2] / f"{key}.json"

    def _sum(self, key: str, fact: Mapping[str, Any]) -> str:
        return digest([str(_FORMAT), self.part, key, json.dumps(fact, sort_keys=True)])

    @staticmethod
    def _touch(path: Path) -> None:
        try:
            os.utime(path)
        except OSError:
            return
