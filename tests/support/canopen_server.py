# SPDX-License-Identifier: MIT
"""A node with the controller's object dictionary and none of its behaviour: python canopen's own server on a virtual
bus of this process. Used by tests in tests/host/bus. Opens the bus; starts threads.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import canopen

from hodograph.bus.address import BusAddress
from hodograph.data import CONTROLLER_EDS


@contextmanager
def canopen_server(bus: BusAddress) -> Iterator[canopen.LocalNode]:
    """Node 1 on a virtual bus."""
    network = canopen.Network()
    network.connect(interface=bus.interface, channel=bus.channel)
    try:
        yield network.create_node(1, str(CONTROLLER_EDS))
    finally:
        network.disconnect()
