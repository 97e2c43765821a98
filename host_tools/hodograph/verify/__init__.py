# SPDX-License-Identifier: MIT
"""Looks at what a program really does, beside the limits it was planned for; shares nothing with what planned it."""

from .setpoints import BusNoise, Sampled, bus_noise, sampled
from .verification import TOLERANCE, Peak, Verification, verify_program

__all__ = [
    "TOLERANCE",
    "BusNoise",
    "Peak",
    "Sampled",
    "Verification",
    "bus_noise",
    "sampled",
    "verify_program",
]
