# SPDX-License-Identifier: MIT
"""Reports as HTML with figures: of runs (in the form of the paper's figures), toolpaths and tunings."""

from .html import Case, write_report
from .toolpath_report import write_toolpath_report

__all__ = ["Case", "write_report", "write_toolpath_report"]
