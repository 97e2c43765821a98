# SPDX-License-Identifier: MIT
"""The program of the controller: compiles, encodes, decodes, checks and prints it; docs/reference/protocol.md section
1. Used by many modules of host_tools. Reads a program image; no other I/O.
"""

from .check import Fault, check
from .compiler import Compilation, ProgramOptions, compile_path, compile_program, fit_plan
from .image import Program, ProgramLimits, decode, encode
from .inspection import inspect_dict, inspect_text
from .stop_planning import StopTerms

__all__ = [
    "Compilation",
    "Fault",
    "Program",
    "ProgramLimits",
    "ProgramOptions",
    "StopTerms",
    "check",
    "compile_path",
    "compile_program",
    "decode",
    "encode",
    "fit_plan",
    "inspect_dict",
    "inspect_text",
]
