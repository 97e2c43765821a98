# SPDX-License-Identifier: MIT
"""Commissioning: which drives are on a bus, what they are, and whether they can do what a machine needs.

Nothing here writes to a drive.
"""

from .check import Finding, check_axis
from .drive_facts import DriveFacts, read_facts
from .machine_text import machine_text
from .nodes import NodeReader, found_nodes, opened_bus, require_no_controller

__all__ = [
    "DriveFacts",
    "Finding",
    "NodeReader",
    "check_axis",
    "found_nodes",
    "machine_text",
    "opened_bus",
    "read_facts",
    "require_no_controller",
]
