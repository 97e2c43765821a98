# SPDX-License-Identifier: MIT
"""Starts a hodograph-hub for local buses (docs/reference/virtual-time.md), and ends it. Used by all commands and
functions of the API that serve a local bus. Starts and ends a process; makes a temporary folder.
"""

from __future__ import annotations

import socket
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from ..errors import BusError
from .address import BusAddress, can_be_bus
from .processes import find_program, guarded

HUB = "hodograph-hub"
_LOOK_S = 0.002


def is_served(path: Path) -> bool:
    """Whether a hub accepts connections there. Its socket file exists a moment earlier."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as probe:
        return probe.connect_ex(str(path)) == 0


def _folder() -> Path:
    """The folder of buses without a path: that for temporary files, unless its name is too long."""
    folder = Path(tempfile.gettempdir())
    return folder if can_be_bus(folder / "hodograph-abcdefgh" / "bus99") else Path("/tmp")


class LocalHub:
    """Serves `buses` local buses while its context is open; their addresses are in `addresses`."""

    def __init__(
        self,
        *,
        virtual: bool = True,
        buses: int = 1,
        speed: float | None = None,
        paths: Sequence[Path] | None = None,
    ) -> None:
        """virtual its time is virtual, and advances at most `speed` times as fast as real time (None: not limited)
        paths    paths of the buses, in place of ones in a new temporary folder
        """
        self._paths = paths
        self._words = ["--time", "virtual" if virtual else "real"]
        if speed is not None:
            self._words += ["--speed", f"{speed:g}"]
        self._names = ["bus", *(f"bus{k}" for k in range(1, buses))]
        self.addresses: tuple[BusAddress, ...] = ()
        self.child: subprocess.Popen[bytes] | None = None

    @property
    def address(self) -> BusAddress:
        """Address of the first bus."""
        return self.addresses[0]

    def __enter__(self) -> LocalHub:
        self._folder = tempfile.TemporaryDirectory(prefix="hodograph-", dir=_folder())
        paths = self._paths or [Path(self._folder.name) / name for name in self._names]
        command = [str(find_program(HUB)), *self._words, *map(str, paths)]
        served = next((path for path in paths if is_served(path)), None)
        if served is not None:
            self._folder.cleanup()
            raise BusError(f"{served}: another {HUB} serves a bus there: use it, or another path")
        child = self.child = subprocess.Popen(
            guarded(command), stdin=subprocess.DEVNULL, start_new_session=True
        )
        while not all(is_served(path) for path in paths):
            if child.poll() is not None:
                self._folder.cleanup()
                raise BusError(f"{HUB} ended by itself (status {child.returncode})")
            time.sleep(_LOOK_S)
        self.addresses = tuple(BusAddress("local", str(path)) for path in paths)
        return self

    def __exit__(self, *_: object) -> None:
        if self.child is not None:
            self.child.terminate()
            self.child.wait()
        self._folder.cleanup()
