# SPDX-License-Identifier: MIT
"""Makes the modules of tools/ importable. Loaded by pytest; changes sys.path."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools"))
