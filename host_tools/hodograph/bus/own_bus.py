# SPDX-License-Identifier: MIT
"""The bus of commands without --bus. Used by api/bus and cli/. Reads the environment, makes the folder of the bus, and
starts a hub.

It is $HODOGRAPH_BUS, else vcan0 if the Linux kernel has it, else the local bus of this user. `hodograph run` and
`hodograph rig` serve the latter while they run, at a fixed path at which `hodograph status` and other commands find it.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from ..errors import BusError
from .address import BUS_VARIABLE, DEFAULT_BUS, BusAddress, can_be_bus, check_raw, parse_address
from .hub import LocalHub, is_served


def own_path() -> Path:
    """The path of this user's local bus: below $XDG_RUNTIME_DIR, else below the folder for temporary files, else, if
    these names are too long for a bus, below /tmp.
    """
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and Path(runtime).is_absolute() and os.access(runtime, os.W_OK):
        below_runtime = Path(runtime) / "hodograph" / "bus"
        if can_be_bus(below_runtime):
            return below_runtime
    name = Path(f"hodograph-{os.getuid()}") / "bus"
    below_temporary = tempfile.gettempdir() / name
    return below_temporary if can_be_bus(below_temporary) else "/tmp" / name


def bus_address(given: str | None) -> BusAddress:
    """The bus of a command that starts nothing; `given` by --bus. Raises InputError."""
    return _found(given) or parse_address(DEFAULT_BUS)


@contextmanager
def opened_bus(
    given: str | None, note: Callable[[str], None], speed: float | None = 1.0
) -> Iterator[BusAddress]:
    """The bus of a command that can start a simulated machine: as `bus_address`; where there is none, the local bus of
    this user, served until the end of the context in virtual time, `speed` times as fast as real time at most (None: as
    fast as it can). Raises InputError and BusError.
    """
    address = _found(given)
    if address is not None:
        yield address
        return
    path = own_path()
    _make_private(path.parent)
    with LocalHub(paths=[path], speed=speed) as hub:
        note(f"this kernel has no {DEFAULT_BUS}: using the local bus {hub.address}")
        yield hub.address


def _found(given: str | None) -> BusAddress | None:
    named = given or os.environ.get(BUS_VARIABLE)
    if named:
        return parse_address(named)
    if _has_vcan():
        return parse_address(DEFAULT_BUS)
    path = own_path()
    return BusAddress("local", str(path)) if is_served(path) else None


def _has_vcan() -> bool:
    try:
        check_raw(parse_address(DEFAULT_BUS))
    except BusError:
        return False
    return True


def _make_private(folder: Path) -> None:
    """Makes the folder of the bus, for this user alone. Raises BusError: it belongs to another user."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        owner = folder.stat().st_uid
    except OSError as error:
        raise BusError(f"{folder}: cannot be made: {error.strerror}: give --bus") from None
    if owner != os.getuid() or folder.is_symlink():
        raise BusError(f"{folder}: belongs to another user: give --bus")
