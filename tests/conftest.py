# SPDX-License-Identifier: MIT
"""No deadline per example: the machine may be shared, and no test measures time by examples."""

from hypothesis import settings

settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")
