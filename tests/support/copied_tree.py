# SPDX-License-Identifier: MIT
"""A copy of the tree in which a test may change the firmware and build it. Used by tests/system (test_port_doc,
test_firmware_bytes) and tests/tools/test_check_image. Reads the tree with its build; writes to the folder that
it is given.
"""

from __future__ import annotations

import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def copied_tree(folder: Path, board: str) -> Path:
    """What the firmware is made from, with what is built of it for the an386 already: as if for `board`, which has the
    same core. Times are kept, so that only new files are compiled.
    """
    for name in ("Makefile", "requirements.lock"):
        shutil.copy2(ROOT / name, folder / name)
    for name in (
        "firmware",
        "tools",
        "tests/target",
        "tests/proofs",
        "packaging",
        "build/generated",
    ):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "build/stamps", folder / "build/stamps", symlinks=True)
    shutil.copytree(ROOT / "build/firmware/an386", folder / "build/firmware" / board)
    for left in (folder / "build/firmware" / board).glob("*.elf"):
        left.unlink()
    (folder / ".venv").mkdir()
    (folder / ".venv/bin").symlink_to(ROOT / ".venv/bin")
    ready = folder / ".venv/.ready"
    ready.write_text(str(folder))
    made = (ROOT / ".venv/.ready").stat()
    os.utime(ready, ns=(made.st_atime_ns, made.st_mtime_ns))
    return folder
