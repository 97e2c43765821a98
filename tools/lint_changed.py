#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""lint_changed.py: lints what changed, by `make lint-files FILES=...`; the first part of `make check`.

Starts git and make; keeps stamps in the cache folder.

A file has changed when it differs from the last commit, or is not in it, and has no stamp for its present content in
the cache (testing/cache.py). Without Git every file is taken for changed.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from testing.cache import ABSENT, Stamps, content, digest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = ("firmware", "sim", "host_tools", "tools", "tests", "benchmarks", ".ci")
# The settings of linters, and the linters: with other settings every file that differs is linted again.
SETTINGS = ("pyproject.toml", "requirements.lock", ".clang-tidy", ".clang-format", "Makefile")


def _git(root: Path, *words: str) -> list[str] | None:
    try:
        done = subprocess.run(["git", *words], cwd=root, capture_output=True, check=False)
    except OSError:
        return None
    if done.returncode != 0:
        return None
    return [os.fsdecode(name) for name in done.stdout.split(b"\0")[:-1]]


def differing(root: Path) -> list[str]:
    """Files that differ from the last commit, and new ones; all of FOLDERS where Git cannot say."""
    changed = _git(root, "diff", "--name-only", "-z", "--relative", "HEAD")
    new = _git(root, "ls-files", "--others", "--exclude-standard", "-z")
    if changed is None or new is None:
        found = (path for folder in FOLDERS for path in (root / folder).rglob("*"))
        return sorted(str(path.relative_to(root)) for path in found if path.is_file())
    return sorted({*changed, *new})


def to_lint(root: Path, stamps: Stamps) -> dict[str, str]:
    """Files that have changed, each with the key of the stamp that it gets when it is found well."""
    settings = [content(root / name) for name in SETTINGS]
    keys = {}
    for file in differing(root):
        hash_ = content(root / file)
        key = digest(["linted", file, hash_, *settings])
        if hash_ != ABSENT and not set(file) & set(" \t\n$") and stamps.read(key) is None:
            keys[file] = key
    return keys


def main() -> int:
    """Exit status."""
    stamps = Stamps("lint")
    keys = to_lint(ROOT, stamps)
    command = ["make", "--no-print-directory", "lint-files", f"FILES={' '.join(keys)}"]
    # a make of its own: the one that runs this hands down flags for its own children only
    environment = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MFLAGS")}
    status = subprocess.run(command, cwd=ROOT, env=environment, check=False).returncode
    if status == 0:
        for file, key in keys.items():
            stamps.write(key, {"file": file})
    return 1 if status else 0


if __name__ == "__main__":
    sys.exit(main())
