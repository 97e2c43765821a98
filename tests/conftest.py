# SPDX-License-Identifier: MIT
"""What holds for every test: the same examples in every run, no deadline for each, and Ctrl-C as processes know it."""

import signal

from hypothesis import settings

# The machine may be shared, and no test measures time by examples.
# The same examples in every run, so that a verdict is the same on every machine.
settings.register_profile("steady", deadline=None, derandomize=True)
settings.load_profile("steady")

# A shell starts what is in its background with SIGINT ignored, and its children inherit that: tests that send one would
# wait for ever.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
