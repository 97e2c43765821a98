# SPDX-License-Identifier: MIT
"""Design of servo loops: PDFF gains and feedforward from the plant model, margins, and the effect of model errors. Used
by cli/tune_command and report/tune_report. Runs simulations in this process; reads the files of a path by `pipeline`.

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
