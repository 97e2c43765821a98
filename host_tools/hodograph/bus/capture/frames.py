# SPDX-License-Identifier: MIT
"""Frames of a bus as numpy arrays. Used by most modules of capture and of the live page, and by analyses of
recordings. No I/O.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FRAME_DTYPE = np.dtype(
    [("id", "<u4"), ("length", "u1"), ("padding", "u1", 3), ("data", "u1", 8)], align=False
)
"""struct can_frame of linux/can.h on a little-endian machine."""

RECORD_DTYPE = np.dtype([*FRAME_DTYPE.descr, ("time_us", "<i8")])
"""A frame and when it came: microseconds since 1970 (UTC)."""

Frames = NDArray[np.void]
"""An array of `RECORD_DTYPE`, in the order of the bus. Functions that need no times also take one of `FRAME_DTYPE`."""


def when(frames: Frames, at: int) -> str:
    """The time of a frame for messages, as the file of the recording has it: " at 12.345678 s"; empty: there are no
    times.
    """
    if "time_us" not in (frames.dtype.names or ()):
        return ""
    return f" at {int(frames['time_us'][at]) / 1e6:.6f} s"
