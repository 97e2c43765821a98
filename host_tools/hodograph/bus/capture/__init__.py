# SPDX-License-Identifier: MIT
"""Capture of the bus: frames, recordings, bus load, setpoint step check. Used by all modules that receive frames or
analyse recordings. Receives frames, reads and writes recordings; sends nothing.
"""
