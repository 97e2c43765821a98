# SPDX-License-Identifier: MIT
"""What is heard on the bus: frames, recordings, their load, setpoints that jump. Nothing here sends."""
