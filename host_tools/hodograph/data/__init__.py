# SPDX-License-Identifier: MIT
"""Files that the package carries: controller.eds is firmware/app/controller.eds by a link."""

from pathlib import Path

CONTROLLER_EDS = Path(__file__).parent / "controller.eds"
