# SPDX-License-Identifier: MIT
"""The input files (TOML) as checked, frozen dataclasses."""

from .drive_file import Drive, load_drive
from .machine_file import Axis, Machine, load_machine
from .path_file import PathFile, PathSpec, load_path_file
from .table import read_toml

__all__ = [
    "Axis",
    "Drive",
    "Machine",
    "PathFile",
    "PathSpec",
    "load_drive",
    "load_machine",
    "load_path_file",
    "read_toml",
]
