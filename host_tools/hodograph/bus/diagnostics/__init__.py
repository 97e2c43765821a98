# SPDX-License-Identifier: MIT
"""Diagnostics texts: states, faults and refusals in words, with remedies. Used by bus/, faults/, monitor/ and
job_run. No I/O.
"""
