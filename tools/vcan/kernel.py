# SPDX-License-Identifier: MIT
"""The buses of this Linux kernel: vcan0 if there is one, else one in a network namespace of the command; and vcan1.
Used by vcan/main. Makes network interfaces; moves this process to a network namespace.

vcan1 is a second bus for processes between two buses, such as the fault injector.

A namespace keeps buses apart, so that tests may run at once, and leaves nothing behind. Without root it
is entered through a user namespace, in which the user keeps his number.
"""

from __future__ import annotations

import contextlib
import ctypes
import fcntl
import os
import shutil
import socket
import struct
import subprocess
from pathlib import Path

from vcan.errors import BusUnavailable

_CLONE_NEWUSER = 0x10000000
_CLONE_NEWNET = 0x40000000
_SIOCGIFFLAGS = 0x8913
_IFF_UP = 1
_RTM_NEWLINK = 16
_NLM_F_REQUEST_ACK_CREATE_EXCL = 0x1 | 0x4 | 0x400 | 0x200
_IFLA_IFNAME = 3
_IFLA_LINKINFO = 18
_IFLA_INFO_KIND = 1


BUSES = ("vcan0", "vcan1")
"""The buses of a command."""


def has_bus(name: str = BUSES[0]) -> bool:
    """Whether vcan0 (or another bus) is there and up."""
    request = struct.pack("16sh14x", name.encode(), 0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        try:
            answer = fcntl.ioctl(any_socket, _SIOCGIFFLAGS, request)
        except OSError:
            return False
    return bool(struct.unpack_from("h", answer, 16)[0] & _IFF_UP)


def complete() -> None:
    """Beside a vcan0 that is there already, makes the other buses where that is allowed."""
    for name in BUSES[1:]:
        if not has_bus(name):
            with contextlib.suppress(OSError):
                _new_bus(name)


def can_make_namespace() -> bool:
    """Tries it in a child process, since a failed attempt can't be taken back."""
    if os.geteuid() == 0 and shutil.which("modprobe"):
        subprocess.run(
            ["modprobe", "-q", "vcan"], stdin=subprocess.DEVNULL, capture_output=True, check=False
        )
    pid = os.fork()
    if pid == 0:
        status = 1
        try:
            enter_new_namespace()
            status = 0
        except OSError:
            pass
        finally:
            os._exit(status)
    return os.waitpid(pid, 0)[1] == 0


def enter_new_namespace() -> None:
    """Moves this process into a network namespace with buses (and lo) that are up. OSError: not possible here."""
    uid, gid = os.getuid(), os.getgid()
    if os.geteuid() == 0:
        _unshare(_CLONE_NEWNET)
    else:
        _unshare(_CLONE_NEWUSER | _CLONE_NEWNET)
        Path("/proc/self/setgroups").write_text("deny")
        Path("/proc/self/uid_map").write_text(f"{uid} {uid} 1")
        Path("/proc/self/gid_map").write_text(f"{gid} {gid} 1")
    for name in BUSES:
        _new_bus(name)
    _new_link(socket.if_nametoindex("lo"), b"", create=False)
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as bus:
        bus.bind((BUSES[0],))


def join_namespace(pid: int) -> None:
    """Moves this process into the namespaces of another one."""
    flags = _CLONE_NEWNET if os.geteuid() == 0 else _CLONE_NEWUSER | _CLONE_NEWNET
    try:
        descriptor = os.pidfd_open(pid)
        _check(ctypes.CDLL(None, use_errno=True).setns(descriptor, flags))
    except OSError as error:
        raise BusUnavailable(
            f"cannot enter the network namespace of process {pid}: {error.strerror}"
        ) from error


def _unshare(flags: int) -> None:
    _check(ctypes.CDLL(None, use_errno=True).unshare(flags))


def _check(result: int) -> None:
    if result != 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def _attribute(kind: int, payload: bytes) -> bytes:
    padding = b"\0" * (-len(payload) % 4)
    return struct.pack("HH", 4 + len(payload), kind) + payload + padding


def _new_bus(name: str) -> None:
    kind = _attribute(_IFLA_INFO_KIND, b"vcan")
    words = _attribute(_IFLA_IFNAME, name.encode() + b"\0") + _attribute(_IFLA_LINKINFO, kind)
    _new_link(0, words, create=True)


def _new_link(index: int, attributes: bytes, *, create: bool) -> None:
    """rtnetlink(7): makes a link, or changes one, and sets it up."""
    body = struct.pack("BxHiII", socket.AF_UNSPEC, 0, index, _IFF_UP, _IFF_UP) + attributes
    flags = _NLM_F_REQUEST_ACK_CREATE_EXCL if create else 0x1 | 0x4
    with socket.socket(socket.AF_NETLINK, socket.SOCK_RAW, 0) as netlink:
        netlink.send(struct.pack("IHHII", 16 + len(body), _RTM_NEWLINK, flags, 1, 0) + body)
        (error,) = struct.unpack_from("i", netlink.recv(4096), 16)
    if error:
        raise OSError(-error, os.strerror(-error))
