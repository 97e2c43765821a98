# SPDX-License-Identifier: MIT
"""Chooses the channel of a recording that holds several buses (`--channel`). Used by recordings/candump and
recordings/vector. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ....errors import InputError


def chosen_channel(file: Path, names: Sequence[str], wanted: str | None) -> str:
    """The channel wanted, or the only one there is; empty when there is none. Raises InputError."""
    if wanted is None:
        if len(names) > 1:
            raise InputError(
                f"{file}: holds several channels ({', '.join(sorted(names))}): choose one (--channel)"
            )
        return names[0] if names else ""
    if names and wanted not in names:
        raise InputError(f"{file}: holds no channel {wanted}, but {', '.join(sorted(names))}")
    return wanted
