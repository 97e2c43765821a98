# SPDX-License-Identifier: MIT
"""Faults injected and survived: scenarios run on two virtual buses, and judged.

scenario       keys of a scenario file, and the fault rules that a seed makes of it
bench          controller, injector and drives as processes
run_case       one scenario with one seed, by disturb (uploads), and recover
fault_actions  what the host does to processes and uploads meanwhile
case_run       what a case works with, and what it leaves for the judge
case_record    what the recordings of both buses show
judge          violations in a case record
campaign       all scenarios with all seeds
case_table     the result for people and for JSON
"""
