# SPDX-License-Identifier: MIT
"""Identifies the plant of each axis from a recorded run, with confidence intervals; `hodograph identify`,
docs/guides/tuning.md, drives.md section 18. Used by cli/identify_command. No I/O.
"""

from .plant_fit import Estimate, Plant, identify_axis, plant_json, plant_text
from .stretches import Stretch, stretches

__all__ = [
    "Estimate",
    "Plant",
    "Stretch",
    "identify_axis",
    "plant_json",
    "plant_text",
    "stretches",
]
