# SPDX-License-Identifier: MIT
"""What holds for every test: the same examples in every run, no deadline for each, Ctrl-C as processes know it, and
folders of its own for what commands keep for their user. Loaded by pytest; changes XDG_STATE_HOME and
XDG_RUNTIME_DIR of the process, and makes a temporary folder.
"""

import os
import signal
import tempfile
from typing import Any

import pytest
from hypothesis import settings

# A test that hangs fails after this time (pytest-timeout). Long tests compute for minutes, and the computer may be
# busy. The limit of all others is in pyproject.toml.
LONG_TEST_LIMIT_S = 7200.0

# The machine may be shared, and no test measures time by examples.
# The same examples in every run, so that a verdict is the same on every machine.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.load_profile("steady")

# A shell starts what is in its background with SIGINT ignored, and its children inherit that: tests that send one would
# wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The journal of streamed jobs and the local bus of this user: two runs of the tests at once, or a machine that the user
# simulates meanwhile, must not meet here.
_OWN = tempfile.TemporaryDirectory(prefix="hodograph-tests-")
for _name in ("XDG_STATE_HOME", "XDG_RUNTIME_DIR"):
    os.environ[_name] = _OWN.name


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    has_long = "not long" not in config.option.markexpr
    for item in items:
        more = item.get_closest_marker("long_examples")
        if more and has_long:
            test: Any = item.obj  # type: ignore[attr-defined]
            own = test._hypothesis_internal_use_settings
            test._hypothesis_internal_use_settings = settings(own, max_examples=more.args[0])
        if item.get_closest_marker("long") and not item.get_closest_marker("timeout"):
            item.add_marker(pytest.mark.timeout(LONG_TEST_LIMIT_S))
