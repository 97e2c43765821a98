# SPDX-License-Identifier: MIT
"""A plugin of pytest: limits the number of examples of Hypothesis tests, because every mutant runs all of these tests.
Loaded by pytest, which mutation/python_tests.py starts. Changes the settings of tests in that process; no I/O.
"""

from __future__ import annotations

import pytest
from hypothesis import settings

MOST = 25
"""Examples of a Hypothesis test while mutants are tested."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Lowers the number of examples of every property that asks for more."""
    for item in items:
        test = getattr(item, "obj", None)
        own = getattr(test, "_hypothesis_internal_use_settings", None)
        if test is not None and own is not None and own.max_examples > MOST:
            test._hypothesis_internal_use_settings = settings(own, max_examples=MOST)
