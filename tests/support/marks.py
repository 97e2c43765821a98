# SPDX-License-Identifier: MIT
"""Values of a parameter whose tests run in `make test-all` only: others of the same kind run in `make test`. Used by
tests. No I/O.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest


def long(*values: Any) -> Any:
    """A value, or a set of values, for `make test-all`."""
    return pytest.param(*values, marks=pytest.mark.long)


def every(count: int, values: Sequence[Any]) -> list[Any]:
    """All values; `make test` takes every `count`-th, from the first on."""
    return [value if k % count == 0 else long(value) for k, value in enumerate(values)]
