# SPDX-License-Identifier: MIT
"""Commissioning: finds the drives on a bus, reads their properties, and checks whether they can do what a machine
needs. Used by cli/commission_commands. Reads objects by SDO; sends LSS frames.

Only `assign` writes to a drive: it gives a drive its node number.
"""

from .check import Finding, check_axis
from .drive_properties import DriveProperties, read_properties
from .lss import Assignment, Identity, Unconfigured, assign, find_unconfigured, matched
from .machine_text import machine_text
from .nodes import NodeReader, found_nodes, opened_bus, require_no_controller

__all__ = [
    "Assignment",
    "DriveProperties",
    "Finding",
    "Identity",
    "NodeReader",
    "Unconfigured",
    "assign",
    "check_axis",
    "find_unconfigured",
    "found_nodes",
    "machine_text",
    "matched",
    "opened_bus",
    "read_properties",
    "require_no_controller",
]
