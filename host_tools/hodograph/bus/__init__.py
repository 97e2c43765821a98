# SPDX-License-Identifier: MIT
"""The CAN side of the host tools: controller client, recorder, simulated machine, moves."""
