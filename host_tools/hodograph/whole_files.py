# SPDX-License-Identifier: MIT
"""Writes a file whole or not at all, also if the power fails meanwhile. Used by cli/output and stream/journal. Writes
the file that it is given, and another one next to it for a while.
"""

from __future__ import annotations

import os
from pathlib import Path


def replace_file(file: Path, data: bytes) -> None:
    """Writes a file under another name, then renames it: after a loss of power the old or the new one is there. Raises
    OSError, and leaves no file of the other name then.
    """
    fresh = file.with_name(file.name + ".part")
    try:
        with fresh.open("wb") as out:
            out.write(data)
            out.flush()
            os.fsync(out.fileno())
        fresh.replace(file)
    except OSError:
        fresh.unlink(missing_ok=True) if fresh.parent.is_dir() else None
        raise
