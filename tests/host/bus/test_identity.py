# SPDX-License-Identifier: MIT
"""A node that differs from the EDS is refused before any command is sent to it. Run by pytest; the node is one of
python canopen on a virtual bus of this process. Starts threads, and writes lock files and temporary folders.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import canopen
import pytest

from canopen_server import canopen_server
from hodograph.bus.address import BusAddress
from hodograph.bus.sdo.controller import Controller, connect
from hodograph.errors import BusError

BUS = BusAddress("virtual", "identity")


@pytest.fixture
def node() -> Iterator[canopen.LocalNode]:
    with canopen_server(BUS) as local:
        local.sdo[0x2002].raw = 1
        yield local


@pytest.fixture
def controller(node: canopen.LocalNode) -> Iterator[Controller]:
    with connect(BUS, 1, 1_000_000) as found:
        yield found


def test_ours(controller: Controller) -> None:
    controller.require(5.0)
    assert controller.state() == 1


@pytest.mark.parametrize(
    ("sub", "value", "name"), [(1, 5, "vendor"), (2, 2, "product"), (3, 0x20000, "revision")]
)
def test_others(
    node: canopen.LocalNode, controller: Controller, sub: int, value: int, name: str
) -> None:
    node.sdo[0x1018][sub].raw = value
    with pytest.raises(BusError, match=f"{name}.*different versions"):
        controller.require(5.0)


def test_minor_revision_may_differ(node: canopen.LocalNode, controller: Controller) -> None:
    node.sdo[0x1018][3].raw = 0x10007
    controller.require(5.0)


def test_wrong_eds_file(tmp_path: Path) -> None:
    file = tmp_path / "wrong.eds"
    file.write_text("this is no EDS")
    with (
        pytest.raises(BusError, match=r"wrong\.eds: not a usable EDS file"),
        connect(BUS, 1, 1_000_000, file),
    ):
        pass
