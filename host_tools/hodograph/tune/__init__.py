# SPDX-License-Identifier: MIT
"""Servo loops by design: PDFF gains and feedforward from the plant model, margins, and what a wrong model costs.

The method is docs/theory/numerics.md section 17, the use docs/guides/tuning.md.
"""

from .design import VELOCITIES
from .result import Tuning, tuning_json, tuning_text
from .search import Wanted
from .tuning import Asked, tune

__all__ = [
    "VELOCITIES",
    "Asked",
    "Tuning",
    "Wanted",
    "tune",
    "tuning_json",
    "tuning_text",
]
