# SPDX-License-Identifier: MIT
"""Reports as HTML with figures: of runs (in the form of the paper's figures), toolpaths and tunings. Used by cli/ and
campaign/report. Writes HTML and PNG files; reads the G-code file of a toolpath for its lines, and the paper's examples.
"""

from .html import Case, write_report
from .toolpath_report import write_toolpath_report

__all__ = ["Case", "write_report", "write_toolpath_report"]
