# SPDX-License-Identifier: MIT
"""What system tests share: where the tree is, and the bus that tests marked `bus` need."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="session")
def root() -> Path:
    """The root of the source tree."""
    return ROOT


@pytest.fixture(autouse=True)
def _bus_is_there(request: pytest.FixtureRequest) -> None:
    """A test marked `bus` fails, and does not skip, where it is run without one."""
    if request.node.get_closest_marker("bus") is None:
        return
    try:
        socket.if_nametoindex("vcan0")
    except OSError:
        pytest.fail("no vcan0: run it as `tools/with-vcan .venv/bin/pytest ...`", pytrace=False)
