# SPDX-License-Identifier: MIT
"""Results of runs in arrays, by number: what millions of runs need of memory is 100 bytes each."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from .execute import QUANTITIES, Outcome


class Results:
    """What is known of the runs of a campaign."""

    def __init__(self, total: int) -> None:
        self.done: NDArray[np.bool_] = np.zeros(total, dtype=np.bool_)
        self.values: NDArray[np.float64] = np.full((total, len(QUANTITIES)), np.nan)
        self.encoders_sha256: NDArray[np.bytes_] = np.zeros(total, dtype="S64")
        self.errors: dict[int, str] = {}

    def put(self, outcomes: Iterable[Outcome]) -> None:
        """Takes results up; a run that is there already stays as it is."""
        for outcome in outcomes:
            number = outcome.number
            if self.done[number]:
                continue
            self.done[number] = True
            if outcome.error:
                self.errors[number] = outcome.error
                continue
            self.values[number] = outcome.values
            self.encoders_sha256[number] = outcome.encoders_sha256.encode()

    @property
    def count(self) -> int:
        """Runs that are done."""
        return int(np.count_nonzero(self.done))

    def missing(self, first: int, last: int) -> list[int]:
        """Numbers from `first` to before `last` that are not done."""
        return [int(i) + first for i in np.flatnonzero(~self.done[first:last])]
