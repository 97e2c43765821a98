# SPDX-License-Identifier: MIT
"""Cost of the monitor's pump: frames to samples, derived figures, contour error, decimation, JSON.

Run by `make bench`. Uses no bus; prints the figures, writes the file of --json.

The traffic of the alpha is repeated at 1 kHz, with five frames a tick, and read 40 ticks at a time as by the pump.
Figures: processor time of one thread for a tick, the share of a processor that 1000 ticks a second take, bytes a second
to a browser.
"""

from __future__ import annotations

import json
import time
from pathlib import Path
from typing import Any

import numpy as np
from _figures import figures_parser, write_figures

from hodograph.bus.capture.frames import FRAME_DTYPE, Frames
from hodograph.monitor.decoder import Decoder
from hodograph.monitor.derived import Derivation, ProgramPath
from hodograph.monitor.messages import encode, rows_message
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate

EXAMPLES = Path(__file__).resolve().parents[1] / "examples"
LAPS = 20
FRAMES_A_TICK = 5
"""Frames of one tick on the bus."""
LOOK_TICKS = 40
"""Ticks whose frames are processed at once."""


def traffic() -> tuple[bytes, Frames]:
    """Program image and frames of the alpha, run and begun again."""
    pipeline = load_pipeline(EXAMPLES / "alpha.toml", None)
    motion = simulate(pipeline.image, pipeline.machine.models(pipeline.machine.path_axes))
    rows = motion.rows
    frames = np.zeros((LAPS * len(rows), FRAMES_A_TICK), dtype=FRAME_DTYPE)
    frames["id"] = [0x080, 0x202, 0x203, 0x182, 0x183]
    frames["length"] = [1, 6, 6, 6, 6]
    frames["data"][:, 0, 0] = np.arange(len(frames)) % 240 + 1
    values = [rows["set_counts"][:, 0], rows["set_counts"][:, 1]]
    values += [rows["act_counts"][:, 0], rows["act_counts"][:, 1]]
    for column, counts in enumerate(values, start=1):
        data = np.tile(counts.astype("<i4"), LAPS).view(np.uint8).reshape(-1, 4)
        frames["data"][:, column, 2:6] = data
    return pipeline.image, frames.reshape(-1)


def main() -> None:
    """Prints the figures, or writes them."""
    options = figures_parser(__doc__).parse_args()
    image, frames = traffic()
    path = ProgramPath(image, 1_000_000)
    decoder, derivation = Decoder((2, 3)), Derivation((1_000_000,) * 2, 2, 1000)
    ticks, size = len(frames) // FRAMES_A_TICK, 0
    begun = time.thread_time()
    for part in np.split(
        frames, range(LOOK_TICKS * FRAMES_A_TICK, len(frames), LOOK_TICKS * FRAMES_A_TICK)
    ):
        rows = derivation.feed(decoder.feed(part), path)
        size += len(encode(rows_message(rows, 0.001, 0.0)))
    seconds = time.thread_time() - begun
    figures: dict[str, Any] = {
        "pump_us_a_tick": 1e6 * seconds / ticks,
        "percent_of_a_processor_at_1_khz": 100 * 1000 * seconds / ticks,
        "bytes_a_second_to_a_browser": size / (ticks / 1000),
    }
    if options.json is None:
        print(json.dumps(figures, indent=2))
    write_figures(options.json, figures)


if __name__ == "__main__":
    main()
