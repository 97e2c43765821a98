# SPDX-License-Identifier: MIT
"""The recorder on the CAN of the kernel: frames of a socket in batches, with the times that the kernel gives them. Run
by pytest on vcan0; sends frames there.
"""

from __future__ import annotations

import socket
import struct
import time

import numpy as np
import pytest

from bench import VCAN0
from hodograph.bus.capture.recorder import Recorder
from hodograph.cli.main import main

pytestmark = pytest.mark.bus

FRAME = struct.Struct("=IB3x8s")


def send(count: int, first: int = 0) -> None:
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as out:
        out.bind(("vcan0",))
        for i in range(first, first + count):
            out.send(FRAME.pack(0x123, 4, struct.pack("<I", i)))


def test_all_frames_in_order_with_their_times() -> None:
    before_us = time.time_ns() // 1000
    with Recorder(VCAN0) as recorder:
        send(3000)
    after_us = time.time_ns() // 1000
    frames = recorder.frames()
    assert recorder.dropped == 0
    assert recorder.frame_count == frames.size == 3000
    assert (frames["id"] == 0x123).all()
    assert (frames["data"][:, :4].copy().view("<u4")[:, 0] == np.arange(3000)).all()
    times = frames["time_us"]
    assert before_us <= times[0]
    assert times[-1] <= after_us
    assert (np.diff(times) >= 0).all()
    assert np.unique(times).size > 100


def test_taking_frames_bit_by_bit() -> None:
    """What was sent before is there."""
    with Recorder(VCAN0) as recorder:
        for i in range(5):
            send(40, 40 * i)
            frames = recorder.take()
            expected = np.arange(40 * i, 40 * i + 40)
            assert (frames["data"][:, :4].copy().view("<u4")[:, 0] == expected).all()
    assert recorder.take().size == 0
    assert recorder.frame_count == 200


def test_an_interface_that_is_not_there_is_said(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["record", "bus.log", "--bus", "socketcan:nocan7"]) == 4
    assert "no such network interface" in capsys.readouterr().err
