# SPDX-License-Identifier: MIT
"""What holds for every test: no deadline per example, and Ctrl-C as processes know it."""

import signal

from hypothesis import settings

# The machine may be shared, and no test measures time by examples.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

# A shell starts what is in its background with SIGINT ignored, and its children inherit that: tests that send one would
# wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
