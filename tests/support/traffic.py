# SPDX-License-Identifier: MIT
"""Traffic of a machine as the bus would show it, made from `simulate`. Used by the tests of the live page. Reads an
example.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from hodograph.bus.capture.frames import FRAME_DTYPE, RECORD_DTYPE, Frames
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
ENABLED = 0x1237


@cache
def alpha() -> tuple[bytes, Frames]:
    """Program image and frames of the alpha: 300 SYNCs of standstill, the run, settling."""
    pipeline = load_pipeline(EXAMPLES / "alpha.toml", None)
    motion = simulate(
        pipeline.image, [axis.drive for axis in pipeline.machine.axes if axis.drive is not None]
    )
    still = np.repeat(motion.rows["set_counts"][:, :2][:1], 300, axis=0)
    targets = np.concatenate([still, motion.rows["set_counts"][:, :2]])
    actual = np.concatenate(
        [still, motion.rows["set_counts"][:, :2][:1], motion.rows["set_counts"][:, :2][:1]]
    )
    actual = np.concatenate([actual, motion.rows["act_counts"][:, :2]])[: len(targets)]
    return pipeline.image, machine_frames(targets, actual)


def machine_frames(targets: np.ndarray, actual: np.ndarray) -> Frames:
    """SYNC, setpoints and answers of two axes, nodes 2 and 3; rows by SYNC."""
    count = len(targets)
    frames = np.zeros((count, 5), dtype=FRAME_DTYPE)
    frames["id"] = [0x080, 0x202, 0x203, 0x182, 0x183]
    frames["length"] = [1, 6, 6, 6, 6]
    frames["data"][:, 0, 0] = np.arange(count) % 240 + 1
    for column, (word, positions) in enumerate(
        [
            (0x0F, targets[:, 0]),
            (0x0F, targets[:, 1]),
            (ENABLED, actual[:, 0]),
            (ENABLED, actual[:, 1]),
        ],
        start=1,
    ):
        frames["data"][:, column, 0], frames["data"][:, column, 1] = word & 0xFF, word >> 8
        frames["data"][:, column, 2:6] = (
            np.ascontiguousarray(positions, dtype="<i4").view(np.uint8).reshape(-1, 4)
        )
    return frames.reshape(-1)


def recorded(frames: Frames) -> Frames:
    """The same with times, as a recording has them: a period of 1 ms."""
    result = np.zeros(frames.size, dtype=RECORD_DTYPE)
    for name in ("id", "length", "data"):
        result[name] = frames[name]
    result["time_us"] = 1_700_000_000_000_000 + 200 * np.arange(frames.size)
    return result
