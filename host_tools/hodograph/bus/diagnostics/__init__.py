# SPDX-License-Identifier: MIT
"""Diagnostics texts: states, faults and refusals in words, with remedies. Used by bus/, faults/ and monitor/.
No I/O.
"""
