# SPDX-License-Identifier: MIT
"""Capture of the bus: frames, recordings, bus load, setpoint step check. Used by many modules of host_tools: commands,
runs on the bus, the live page, fault cases. Receives frames, reads and writes recordings; sends nothing.
"""
