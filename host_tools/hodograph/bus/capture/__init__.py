# SPDX-License-Identifier: MIT
"""Capture of the bus: frames, recordings, bus load, setpoint step check. Nothing here sends."""
