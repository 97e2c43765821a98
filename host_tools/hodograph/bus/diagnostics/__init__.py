# SPDX-License-Identifier: MIT
"""States, faults and refusals in words."""
