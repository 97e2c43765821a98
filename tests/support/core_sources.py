# SPDX-License-Identifier: MIT
"""The C files of firmware/core that compute the points of a program. Used by tests that compile them with flags of
their own. No I/O.

Proofs and checks of programs are left out: they take most of the time of a compiler. The linker names what is missing.
"""

from __future__ import annotations

from pathlib import Path

FIRMWARE = Path(__file__).resolve().parents[2] / "firmware"
_NAMES = (
    "coefficients",
    "crc32",
    "extra_axis",
    "feed_piece",
    "interpolator",
    "kernel",
    "kernel_double",
    "kernel_fixed",
    "kernel_float",
    "kernels_all",
    "override_plan",
    "override_ramp",
    "ph_segment",
    "program",
    "program_clock",
    "qmath",
)


def point_sources() -> list[str]:
    """Their paths."""
    return [str(FIRMWARE / "core" / f"{name}.c") for name in _NAMES]
