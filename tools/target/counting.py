# SPDX-License-Identifier: MIT
"""Counts the instructions of the tick in an emulated run: an array of calls by parts."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from target import emulator, parts

Counts = npt.NDArray[np.uint32]
_WORDS = 32  # of a record of the plugin


def count(
    build: Path,
    target: emulator.Target,
    kernel: str,
    program: Path,
    events: Sequence[str] = (),
    options: Sequence[str] = (),
) -> Counts:
    """Instructions of each tick of a program, (ticks, len(PARTS)); `build` is the build folder."""
    image = build / "firmware" / target.name / "setpoints.elf"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        parts.write_map(target.cross, image, "tick", folder / "map")
        plugin = f"{build / 'target/count_plugin.so'},map={folder / 'map'},out={folder / 'out'}"
        words = [str(emulator.KERNELS[kernel]), str(folder / "setpoints"), *events]
        emulator.run(target, image, words, program, ["-plugin", plugin, *options])
        records = np.fromfile(folder / "out", "<u4").reshape(-1, _WORDS)
    return records[:, : len(parts.PARTS)]
