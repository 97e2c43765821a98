# SPDX-License-Identifier: MIT
"""What is said to the controller by SDO: its objects, programs, commands, state."""
