# SPDX-License-Identifier: MIT
"""Compares the motion of a program with its limits; `hodograph verify`. The package shares the types of limits and
peaks with the planner, but no computation. Used by cli/verify_command. No I/O.
"""

from .setpoints import BusNoise, Sampled, bus_noise, sampled
from .verification import TOLERANCE, Verification, verify_program

__all__ = [
    "TOLERANCE",
    "BusNoise",
    "Sampled",
    "Verification",
    "bus_noise",
    "sampled",
    "verify_program",
]
