# SPDX-License-Identifier: MIT
"""Which buses are open: one folder each under /tmp/hodograph-bus-UID. Used by vcan/broker, vcan/main and
vcan/user_mode. Makes, locks and removes these folders.

A folder holds `info.json` and `lock`. The process that keeps the bus alive holds the lock (flock), so a folder whose
lock is free is left over from an ended process. A user-mode bus also keeps its socket and boot log there. The lock is
flock itself, not `filelock`: tools/with-vcan runs before .venv is there.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import re
import shutil
import time
from dataclasses import asdict, dataclass, field
from pathlib import Path

from vcan.errors import BusUnavailable, NameTaken

TREE = Path(__file__).resolve().parents[2]
"""The source tree this file belongs to."""


@dataclass(frozen=True)
class Bus:
    """An open bus; `pid` is the with-vcan (or, in a namespace, the command) that opened it."""

    name: str
    kind: str  # "user-mode" or "namespace"
    pid: int
    cpu: int | None
    command: list[str]
    tree: str = str(TREE)
    started_s: float = field(default_factory=time.time)

    @property
    def folder(self) -> Path:
        return root() / self.name


def root() -> Path:
    """The folder of all buses of this user; made when missing, refused when it is another's."""
    path = Path(f"/tmp/hodograph-bus-{os.getuid()}")
    path.mkdir(mode=0o700, exist_ok=True)
    if path.stat().st_uid != os.getuid() or path.is_symlink():
        raise BusUnavailable(f"{path} belongs to another user; remove it")
    return path


def create(bus: Bus) -> int:
    """Makes the folder; returns the descriptor that holds its lock."""
    if not re.fullmatch(r"[A-Za-z0-9._-]{1,40}", bus.name) or bus.name.startswith("."):
        raise BusUnavailable(
            f"{bus.name!r} is no name for a bus: use up to 40 letters, digits, dots, dashes"
        )
    _sweep()
    try:
        bus.folder.mkdir(mode=0o700)
    except FileExistsError:
        raise NameTaken(f"a bus named {bus.name} is open already; tools/with-vcan --list") from None
    lock = os.open(bus.folder / "lock", os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o600)
    fcntl.flock(lock, fcntl.LOCK_EX)
    _write(bus.folder / "info.json", json.dumps(asdict(bus)))
    return lock


def remove(bus: Bus) -> None:
    """Takes the folder away."""
    shutil.rmtree(bus.folder, ignore_errors=True)


def open_buses() -> list[Bus]:
    """All open buses, the newest first."""
    _sweep()
    buses = []
    for folder in root().iterdir():
        try:
            buses.append(Bus(**json.loads((folder / "info.json").read_text())))
        except (OSError, ValueError, TypeError):
            continue  # just being made, or removed
    return sorted(buses, key=lambda bus: -bus.started_s)


def choose(name: str | None) -> Bus:
    """The bus of that name; without a name the newest of this source tree, else the newest."""
    buses = open_buses()
    if not buses:
        raise BusUnavailable("no bus is open; start one with tools/with-vcan COMMAND")
    if name is not None:
        buses = [bus for bus in buses if bus.name == name]
        if not buses:
            raise BusUnavailable(f"no bus named {name} is open; tools/with-vcan --list")
    return min(buses, key=lambda bus: bus.tree != str(TREE))


def in_user_mode_linux() -> bool:
    """Whether this kernel is a user-mode one. It sees the host's folders, but not the host's locks."""
    try:
        return "User Mode Linux" in Path("/proc/cpuinfo").read_text()
    except OSError:
        return False


def _sweep() -> None:
    """Removes folders whose lock is free."""
    if in_user_mode_linux():
        return
    for folder in root().iterdir():
        with contextlib.suppress(FileNotFoundError):  # removed meanwhile
            if _is_left_over(folder):
                shutil.rmtree(folder, ignore_errors=True)


def _is_left_over(folder: Path) -> bool:
    try:
        lock = os.open(folder / "lock", os.O_RDWR | os.O_CLOEXEC)
    except OSError:
        return time.time() - folder.stat().st_mtime > 10
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    finally:
        os.close(lock)
    # Between open and flock of the one who makes it, the lock is free for an instant.
    return time.time() - folder.stat().st_mtime > 2


def _write(path: Path, text: str) -> None:
    partial = path.with_suffix(".partial")
    partial.write_text(text)
    partial.rename(path)
