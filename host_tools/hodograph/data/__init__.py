# SPDX-License-Identifier: MIT
"""Files that the package carries, by links: firmware/app/controller.eds and examples/."""

from pathlib import Path

CONTROLLER_EDS = Path(__file__).parent / "controller.eds"
EXAMPLES = Path(__file__).parent / "examples"
