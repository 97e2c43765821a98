# SPDX-License-Identifier: MIT
"""Checks what a program really does, beside the limits it was planned for. It shares the types of limits and peaks with
the planner, but no computation."""

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
