# SPDX-License-Identifier: MIT
"""Files that the package carries, by links: controller.eds, drive.eds and examples/."""

from pathlib import Path

CONTROLLER_EDS = Path(__file__).parent / "controller.eds"
EXAMPLES = Path(__file__).parent / "examples"
DRIVE_EDS = Path(__file__).parent / "drive.eds"
