# SPDX-License-Identifier: MIT
"""Messages about a bus that cannot be opened: the remedy for a real interface differs from that for a virtual one. Run
by pytest; starts and writes nothing.
"""

from __future__ import annotations

import fcntl
import socket
import struct

import pytest

from hodograph.bus.address import check_raw, parse_address
from hodograph.errors import BusError


def message(bus: str) -> str:
    with pytest.raises(BusError) as caught:
        check_raw(parse_address(bus))
    return str(caught.value)


class Probe:
    """A CAN socket, as far as `check_raw` uses it."""

    def __enter__(self) -> Probe:
        return self

    def __exit__(self, *args: object) -> None:
        """Nothing is open."""


@pytest.fixture
def kernel_can(monkeypatch: pytest.MonkeyPatch) -> None:
    """A kernel with CAN, whatever that of this computer has."""
    monkeypatch.setattr(socket, "socket", lambda *args: Probe())


def refuse(*args: object) -> None:
    raise OSError


def test_a_kernel_without_can(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(socket, "socket", refuse)
    assert "hodograph rig FILE" in message("vcan7")
    real = message("can7")
    assert "modprobe can_raw" in real
    assert "rig" not in real


@pytest.mark.usefixtures("kernel_can")
def test_a_missing_interface(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fcntl, "ioctl", refuse)
    assert "ip link add dev vcan7 type vcan" in message("vcan7")
    real = message("can7")
    assert "is the adapter connected" in real
    assert "vcan" not in real


@pytest.mark.usefixtures("kernel_can")
def test_an_interface_that_is_down(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fcntl, "ioctl", lambda *args: struct.pack("16sH14x", b"", 0))
    assert message("vcan7").endswith("as root: ip link set vcan7 up")
    assert "ip link set can7 type can bitrate 1000000 && ip link set can7 up" in message("can7")
