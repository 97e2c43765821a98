# SPDX-License-Identifier: MIT
"""An extra of Klipper ("[moves_log]" in its configuration): writes each move that it has planned to a file, one a line.

time accel_t cruise_t decel_t x y z direction_x direction_y direction_z start_v cruise_v accel, in s and mm; start
position, and direction as unit vector. `benchmarks/peers/klipper.py` puts this file into a copy of Klipper's extras.
Loaded by Klipper, which calls `load_config`. Writes that file.
"""

from typing import Any


class MovesLog:
    """Stands between the toolhead and the queue of its moves."""

    def __init__(self, config: Any) -> None:
        self._file = config.get("file")
        self._printer = config.get_printer()
        self._printer.register_event_handler("klippy:connect", self._connect)

    def _connect(self) -> None:
        toolhead = self._printer.lookup_object("toolhead")
        append = toolhead.trapq_append
        log = open(self._file, "w")  # noqa: SIM115

        def logged(queue: object, *move: float) -> None:
            log.write(" ".join(map(repr, move)) + "\n")
            log.flush()
            append(queue, *move)

        toolhead.trapq_append = logged


def load_config(config: Any) -> MovesLog:
    """Klipper calls it."""
    return MovesLog(config)
