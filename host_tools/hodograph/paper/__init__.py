# SPDX-License-Identifier: MIT
"""Compares the paper's printed numbers with computed ones: `hodograph paper`, docs/validation/paper.md. Used by
cli/report_commands and report/. Reads the examples.
"""

from .compare import compare, plain_plan
from .dynamics import Dynamics, Maximum, constant_feed_dynamics
from .joints import JointDisturbance, chord_acceleration_mm_s2, joint_disturbance
from .text import comparison_text, quantity_name, shown

__all__ = [
    "Dynamics",
    "JointDisturbance",
    "Maximum",
    "chord_acceleration_mm_s2",
    "compare",
    "comparison_text",
    "constant_feed_dynamics",
    "joint_disturbance",
    "plain_plan",
    "quantity_name",
    "shown",
]
