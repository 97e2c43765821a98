# SPDX-License-Identifier: MIT
"""Reads the input files (TOML): path, machine and drive files as checked, frozen dataclasses. Used by many modules of
host_tools. Reads the files that it is given, and the files that they name.
"""

from .axis_table import Axis, Feedforward, Homing, Scaling
from .drive_file import Drive, load_drive
from .machine_file import PLANE_AXES, SPACE_AXES, Machine, Supervision, load_machine, machine_of
from .path_file import (
    ListedPath,
    PathFile,
    PathSpec,
    SpacePathSpec,
    is_list_of_paths,
    load_path_file,
    load_paths,
)
from .table import is_there, read_toml

__all__ = [
    "PLANE_AXES",
    "SPACE_AXES",
    "Axis",
    "Drive",
    "Feedforward",
    "Homing",
    "ListedPath",
    "Machine",
    "PathFile",
    "PathSpec",
    "Scaling",
    "SpacePathSpec",
    "Supervision",
    "is_list_of_paths",
    "is_there",
    "load_drive",
    "load_machine",
    "load_path_file",
    "load_paths",
    "machine_of",
    "read_toml",
]
