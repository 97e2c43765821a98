# SPDX-License-Identifier: MIT
"""Reports with the paper's figures remade from a run."""

from .html import Case, write_report

__all__ = ["Case", "write_report"]
