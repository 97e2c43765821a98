# SPDX-License-Identifier: MIT
"""Runs without a bus, and the analysis that they share with recorded ones. Used by many modules of host_tools: the
commands simulate and run, reports, tuning, campaigns. `write_trace` writes a file; no other I/O.

`simulate` runs a program through the controller's own kernels and the simulated drives of its axes in one process;
`simulate_on` takes them from a machine. `analyse` makes the same result from a recording of the bus. All give a
`Motion`: rows, hashes, maxima.
"""

from .motion import SETTLING_S, Motion, MotionTotals, settling_ticks
from .run_recording import analyse
from .simulation import simulate, simulate_on
from .stopping import STOP_ORDERS, StoppedRun, last_tick_s, simulate_stop
from .trace import TRACE_HEADER, write_trace

__all__ = [
    "SETTLING_S",
    "STOP_ORDERS",
    "TRACE_HEADER",
    "Motion",
    "MotionTotals",
    "StoppedRun",
    "analyse",
    "last_tick_s",
    "settling_ticks",
    "simulate",
    "simulate_on",
    "simulate_stop",
    "write_trace",
]
