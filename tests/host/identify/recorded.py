# SPDX-License-Identifier: MIT
"""A recording as a bus would give it, made of a simulated run and noise. Used by the tests of this folder. Reads
path and machine files of the examples.
"""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hodograph.bus.capture.frames import RECORD_DTYPE, Frames
from hodograph.config import Drive, load_machine
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.simulate import simulate

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
REST = 300
"""SYNCs at rest before the run."""
FOLLOWS = 0x1237


def chain_of(name: str, machine: str | None = None) -> Pipeline:
    given = None if machine is None else EXAMPLES / "machines" / f"{machine}.toml"
    return load_pipeline(EXAMPLES / f"{name}.toml", given)


def recording(
    pipeline: Pipeline,
    drives: tuple[Drive, Drive],
    seed: int,
    *,
    noise_counts: float = 20.0,
    noise_mv: float = 10.0,
    status: int = FOLLOWS,
) -> Frames:
    """The run of a pipeline's program by these drives; normal noise on what they report."""
    machine = pipeline.machine
    motion = simulate(pipeline.image, drives, feedforward=machine.path_feedforward)
    rows, noise = motion.rows, np.random.default_rng(seed)
    rest, volts_at_rest = (
        np.repeat(rows["set_counts"][:, :2][:1], REST + 2, axis=0),
        np.zeros((REST + 2, 2)),
    )
    targets = np.concatenate([rest[:REST], rows["set_counts"][:, :2]])
    actual = np.concatenate([rest, rows["act_counts"][:, :2]])
    volts = np.concatenate([volts_at_rest, rows["volts_mv"][:, :2]])
    actual = actual + np.rint(noise.normal(0, noise_counts, actual.shape)).astype(np.int64)
    volts = volts + np.rint(noise.normal(0, noise_mv, volts.shape))
    offsets = _torques(pipeline, rows["cmd_q40_mm"][:, :2], motion.ticks)
    frames: list[tuple[int, bytes]] = []
    for j in range(len(targets)):
        frames.append((0x80, bytes([j % 240 + 1])))
        for i, node in enumerate(machine.nodes):
            data = struct.pack("<Hi", 15, targets[j, i])
            if offsets is not None:
                data += struct.pack("<h", offsets[j - REST, i] if j >= REST else 0)
            frames.append((0x200 + node, data))
        for i, node in enumerate(machine.nodes):
            frames.append((0x180 + node, struct.pack("<Hi", status, actual[j, i])))
            frames.append((0x280 + node, struct.pack("<h", int(volts[j, i]))))
    return packed(frames)


def _torques(
    pipeline: Pipeline, cmd_q40: NDArray[np.int64], ticks: int
) -> NDArray[np.int64] | None:
    """Torque offsets by docs/reference/protocol.md section 3.2, in floating point: rounding may differ by
    one per mille."""
    forward = pipeline.machine.path_feedforward
    if forward is None:
        return None
    points = np.concatenate([cmd_q40[:1], cmd_q40[:1], cmd_q40]) * 2.0**-40
    speed_m_s = (points[2:] - points[1:-1]) / 1e-3 / 1e3
    acceleration = (points[2:] - 2 * points[1:-1] + points[:-2]) / 1e-6 / 1e3
    gains = np.array([[f.torque_permille_s_m, f.torque_permille_s2_m] for f in forward])
    found = np.rint(speed_m_s * gains[:, 0] + acceleration * gains[:, 1]).astype(np.int64)
    found[ticks:] = 0
    return found


def packed(frames: list[tuple[int, bytes]]) -> Frames:
    array = np.zeros(len(frames), dtype=RECORD_DTYPE)
    for i, (identifier, data) in enumerate(frames):
        array[i]["id"], array[i]["length"], array[i]["time_us"] = identifier, len(data), 100 * i
        array[i]["data"][: len(data)] = list(data)
    return array


def drives_of(name: str) -> tuple[Drive, Drive]:
    machine = load_machine(EXAMPLES / "machines" / f"{name}.toml")
    x, y = machine.models(machine.path_axes)
    return x, y
