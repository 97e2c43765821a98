# SPDX-License-Identifier: MIT
"""Reports: with the paper's figures remade from a run, and of a toolpath."""

from .html import Case, write_report
from .toolpath_report import write_toolpath_report

__all__ = ["Case", "write_report", "write_toolpath_report"]
