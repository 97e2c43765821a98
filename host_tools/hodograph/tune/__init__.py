# SPDX-License-Identifier: MIT
"""Design of servo loops: PDFF gains and feedforward from the plant model, margins, and the effect of model errors.

The method is docs/theory/drives.md section 17, the use docs/guides/tuning.md.
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
