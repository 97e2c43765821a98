# SPDX-License-Identifier: MIT
"""Which locked Python requirements the package itself needs: requirements.lock has those of tests and lint too. Used by
dist/runtime. Reads pyproject.toml and requirements.lock.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

from packaging.markers import Marker
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).resolve().parents[2]
_ENTRY = re.compile(r"^(?P<name>[\w.-]+)==(?P<version>[\w.+!]+)(?: ; (?P<marker>.*?))? \\$")


@dataclass(frozen=True)
class Locked:
    """One entry of the lock."""

    name: str
    version: str
    marker: str | None
    lines: tuple[str, ...]
    """As they stand there, without comments."""
    needed_by: frozenset[str]


def read_lock(text: str) -> list[Locked]:
    """All entries; raises ValueError at a line of another form."""
    entries = []
    for block in re.split(r"\n(?=[\w])", "\n" + text):
        lines = [line for line in block.splitlines() if line.strip()]
        if not lines:
            continue
        found = _ENTRY.match(lines[0])
        if found is None:
            raise ValueError(f"requirements.lock: {lines[0]!r} is not NAME==VERSION")
        comments = [line.strip().lstrip("# ") for line in lines if line.strip().startswith("#")]
        words = [comment.removeprefix("via").strip() for comment in comments]
        needed_by = frozenset(canonicalize_name(word) for word in words if word and word[0] != "-")
        kept = tuple(line for line in lines if not line.strip().startswith("#"))
        entries.append(Locked(found["name"], found["version"], found["marker"], kept, needed_by))
    return entries


def package_dependencies() -> set[str]:
    """What pyproject.toml names."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    return {
        canonicalize_name(Requirement(word).name) for word in settings["project"]["dependencies"]
    }


def runtime_requirements() -> list[Locked]:
    """The package's requirements at any depth, for this computer's Python."""
    lock = read_lock((ROOT / "requirements.lock").read_text(encoding="utf-8"))
    wanted = package_dependencies()
    while True:
        more = {canonicalize_name(entry.name) for entry in lock if entry.needed_by & wanted}
        if more <= wanted:
            break
        wanted |= more
    return [
        entry
        for entry in lock
        if canonicalize_name(entry.name) in wanted
        and (entry.marker is None or Marker(entry.marker).evaluate())
    ]


def lock_text(entries: list[Locked]) -> str:
    """A file for pip's --require-hashes."""
    return "".join("\n".join(entry.lines) + "\n" for entry in entries)
