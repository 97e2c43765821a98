# SPDX-License-Identifier: MIT
"""Names of buses, as python-can has them: `socketcan:vcan0`, `slcan:/dev/ttyACM0@115200`, `virtual:test`; and
`local:/tmp/bus`, a bus that hodograph-hub serves at this path. Used by many modules of host_tools: commands with a bus,
runs, simulated machines, the live page. Checks whether a bus is there; sends and receives nothing.
"""

from __future__ import annotations

import os
import socket
import struct
from dataclasses import dataclass
from pathlib import Path

from ..errors import BusError, InputError

DEFAULT_BUS = "socketcan:vcan0"
BUS_VARIABLE = "HODOGRAPH_BUS"
"""Environment variable: the bus of commands without --bus."""
_SIOCGIFFLAGS = 0x8913
_IFF_UP = 1
_SOCKET_PATH_BYTES = 107
"""Longest path of a local bus in bytes, a limit of the operating system."""


@dataclass(frozen=True)
class BusAddress:
    """A python-can interface and a channel of it."""

    interface: str
    channel: str

    def __str__(self) -> str:
        return f"{self.interface}:{self.channel}"

    @property
    def name(self) -> str:
        """A short name of the bus for log formats."""
        return Path(self.channel).name if self.is_local else self.channel

    @property
    def is_local(self) -> bool:
        """Whether it is a local bus, which hodograph-hub serves."""
        return self.interface == "local"

    @property
    def is_raw(self) -> bool:
        """Whether its raw frames can be read fast enough to record a full bus: SocketCAN or a local bus."""
        return self.is_socketcan or self.is_local

    @property
    def is_socketcan(self) -> bool:
        """Whether this is a network interface of the Linux kernel."""
        return self.interface == "socketcan"


def parse_address(text: str) -> BusAddress:
    """`interface:channel`; a bare channel means SocketCAN. Raises InputError."""
    interface, colon, channel = text.partition(":")
    if not colon:
        interface, channel = "socketcan", text
    if not interface or not channel:
        raise InputError(f'--bus "{text}": write interface:channel, as in {DEFAULT_BUS}')
    if interface == "local" and not can_be_bus(Path(channel)):
        raise InputError(
            f"--bus: the path of a local bus has {_SOCKET_PATH_BYTES} bytes at most: {channel}"
        )
    return BusAddress(interface, channel)


def can_be_bus(path: Path) -> bool:
    """Whether the path is short enough for a local bus."""
    return len(os.fsencode(path)) <= _SOCKET_PATH_BYTES


def check_raw(address: BusAddress) -> None:
    """Raises BusError with the remedy: the interface is missing or down, or no hub serves the local bus."""
    if address.is_local:
        _check_local(address)
    else:
        _check_socketcan(address)


def _check_local(address: BusAddress) -> None:
    if not Path(address.channel).is_socket():
        raise BusError(f"{address}: no hub serves it: start hodograph-hub {address.channel}")


def _check_socketcan(address: BusAddress) -> None:
    if not hasattr(socket, "AF_CAN"):
        raise BusError(
            f"{address}: only Linux has SocketCAN: name your adapter, --bus INTERFACE:CHANNEL as python-can calls it"
        )
    import fcntl  # Windows has none; the other parts of the package do not need it

    name = address.channel
    try:
        probe = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    except PermissionError:
        raise BusError(
            f"{address}: no permission to open CAN sockets: run as another user"
        ) from None
    except OSError:
        raise BusError(f"{address}: this kernel has no CAN: {_no_can_remedy(address)}") from None
    with probe:
        try:
            request = struct.pack("16sH14x", name.encode()[:15], 0)
            flags = struct.unpack("16sH14x", fcntl.ioctl(probe, _SIOCGIFFLAGS, request))[1]
        except OSError:
            raise BusError(
                f"{address}: no such network interface: {_missing_remedy(address)}"
            ) from None
    if not flags & _IFF_UP:
        raise BusError(f"{address}: the interface is down: as root: {_up_command(address)}")


def _no_can_remedy(address: BusAddress) -> str:
    if is_virtual(address):
        return (
            "`hodograph rig FILE` serves a local bus, which other commands find "
            "(or put tools/with-vcan in front of the command)"
        )
    return "as root: modprobe can_raw; if there is no such module, use a kernel that has it"


def _missing_remedy(address: BusAddress) -> str:
    name = address.channel
    if is_virtual(address):
        return (
            "put tools/with-vcan in front of the command, "
            f"or as root: ip link add dev {name} type vcan && ip link set {name} up"
        )
    return "is the adapter connected, and its driver loaded? `ip link` lists the interfaces"


def _up_command(address: BusAddress) -> str:
    """The command that starts the interface. A real one needs the bit rate of the drives first."""
    up = f"ip link set {address.channel} up"
    if is_virtual(address):
        return up
    return f"ip link set {address.channel} type can bitrate 1000000 && {up} (with the drives' bit rate)"


def is_virtual(address: BusAddress) -> bool:
    """Whether this bus has no hardware, so that simulated nodes may be started."""
    if not address.is_socketcan:
        return address.is_local
    device = Path("/sys/class/net") / address.channel
    if device.exists():
        return "/virtual/" in str(device.resolve())
    return address.channel.startswith(("vcan", "vxcan"))
