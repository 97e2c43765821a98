# SPDX-License-Identifier: MIT
"""Commands that only need a controller load no numeric modules: an operator's `hold` must not wait for these. Run by
pytest; starts processes.
"""

from __future__ import annotations

import subprocess
import sys

import pytest

HEAVY = ("numpy", "scipy", "matplotlib", "hodograph.native")
QUICK = ("bus_commands", "action_commands")


@pytest.mark.parametrize("module", QUICK)
def test_quick_commands_load_nothing_heavy(module: str) -> None:
    code = (
        f"import sys, hodograph.cli.main, hodograph.cli.{module}; "
        f"print(*(name for name in {HEAVY} if name in sys.modules))"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert loaded.stdout.split() == []
