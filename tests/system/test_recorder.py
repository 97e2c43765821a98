# SPDX-License-Identifier: MIT
"""The recorder: every frame of the bus, in order, with the time it came."""

from __future__ import annotations

import socket
import struct
import time
from pathlib import Path

import numpy as np
import pytest

from hodograph.bus.address import BusAddress
from hodograph.bus.listening.recorder import Recorder
from hodograph.bus.listening.recordings import read_recording, write_recording

pytestmark = pytest.mark.bus

VCAN0 = BusAddress("socketcan", "vcan0")
FRAME = struct.Struct("=IB3x8s")


def send(count: int, first: int = 0) -> None:
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as out:
        out.bind(("vcan0",))
        for i in range(first, first + count):
            out.send(FRAME.pack(0x123, 4, struct.pack("<I", i)))


def test_all_frames_in_order_with_their_times(tmp_path: Path) -> None:
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
    for suffix in (".log", ".asc", ".blf"):
        write_recording(tmp_path / f"bus{suffix}", frames)
        assert np.array_equal(read_recording(tmp_path / f"bus{suffix}"), frames)


def test_taking_frames_bit_by_bit() -> None:
    taken = []
    with Recorder(VCAN0) as recorder:
        for i in range(5):
            send(40, 40 * i)
            time.sleep(0.01)
            taken.append(recorder.take())
    taken.append(recorder.take())
    frames = np.concatenate(taken)
    assert recorder.frame_count == frames.size == 200
    assert (frames["data"][:, :4].copy().view("<u4")[:, 0] == np.arange(200)).all()
    assert recorder.frames().size == 0
