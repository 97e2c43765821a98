# SPDX-License-Identifier: MIT
"""Fault scenarios: faults are injected into simulated machines on two virtual buses, and the reaction is judged.

scenario       keys of a scenario file, and the fault rules that a seed makes of it
bench          controller, injector and drives as processes
case_runner    runs and judges cases: the first run by disturb (uploads), recovery, the second run
fault_actions  what the host does in a case: kills processes, cuts uploads
case_run       machine, program and notes of a case: the input of the judge
case_record    what the recordings of both buses show
judge          violations in a case record
case_table     the result for people and for JSON
"""
