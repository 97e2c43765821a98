# SPDX-License-Identifier: MIT
"""Runs without a bus, and the analysis that they share with recorded ones.

`simulate` runs a program through the controller's own kernels and two simulated drives in one process; `analyse`
makes the same result from what a recorder saw on the bus. Both give a `Motion`: rows, hashes, maxima.
"""

from .motion import SETTLING_S, Motion, Tally, settling_ticks
from .run_recording import analyse
from .simulation import simulate
from .stopping import STOP_ORDERS, StoppedRun, last_tick_s, simulate_stop
from .trace import TRACE_HEADER, write_trace

__all__ = [
    "SETTLING_S",
    "STOP_ORDERS",
    "TRACE_HEADER",
    "Motion",
    "StoppedRun",
    "Tally",
    "analyse",
    "last_tick_s",
    "settling_ticks",
    "simulate",
    "simulate_stop",
    "write_trace",
]
