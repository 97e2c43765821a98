# SPDX-License-Identifier: MIT
"""The recorder on a local bus: every frame, in order, with the time of its last bit. Run by pytest; serves a local bus,
and writes to temporary folders.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np

from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.capture.recordings import read_recording, write_recording
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bustime.frame_bits import exact_bits

FRAME = struct.Struct("=IB3x8s")


def send(hub: LocalHub, count: int, first: int = 0) -> None:
    """All at one instant."""
    with LocalBus(hub.address.channel) as out:
        for i in range(first, first + count):
            out.send_raw(FRAME.pack(0x123, 4, struct.pack("<I", i)))


def test_all_frames_in_order_with_their_times(
    hub: LocalHub, clock: VirtualClock, tmp_path: Path
) -> None:
    begun_us = clock.stamp_ns() // 1000
    with Recorder(hub.address) as recorder:
        for first in range(0, 3000, 1500):
            send(hub, 1500, first)
            clock.sleep(0.5)
    frames = recorder.frames()
    assert recorder.dropped == 0
    assert recorder.frame_count == frames.size == 3000
    assert (frames["id"] == 0x123).all()
    assert (frames["data"][:, :4].copy().view("<u4")[:, 0] == np.arange(3000)).all()
    sent_us = np.repeat([begun_us, begun_us + 500_000], 1500)
    bits = exact_bits(frames).reshape(2, 1500)
    assert (frames["time_us"] == sent_us + np.cumsum(bits, axis=1).reshape(-1)).all()
    for suffix in (".log", ".asc", ".blf"):
        write_recording(tmp_path / f"bus{suffix}", frames)
        assert np.array_equal(read_recording(tmp_path / f"bus{suffix}"), frames)


def test_taking_frames_bit_by_bit(hub: LocalHub, clock: VirtualClock) -> None:
    """What was on the bus up to now, and no more."""
    taken = []
    with Recorder(hub.address) as recorder:
        for i in range(5):
            send(hub, 40, 40 * i)
            clock.sleep(0.002)
            taken.append(recorder.take())
            assert recorder.take().size == 0
            clock.sleep(0.002)
    taken.append(recorder.take())
    assert all(0 < part.size < 40 for part in (taken[0], taken[-1]))
    frames = np.concatenate(taken)
    assert recorder.frame_count == frames.size == 200
    assert (frames["data"][:, :4].copy().view("<u4")[:, 0] == np.arange(200)).all()
    assert recorder.frames().size == 0
