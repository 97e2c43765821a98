# SPDX-License-Identifier: MIT
"""Files that the package carries: by links controller.eds, drive.eds and examples/; what `hodograph init` writes."""

from pathlib import Path

CONTROLLER_EDS = Path(__file__).parent / "controller.eds"
EXAMPLES = Path(__file__).parent / "examples"
DRIVE_EDS = Path(__file__).parent / "drive.eds"
TEMPLATE = Path(__file__).parent / "template"
