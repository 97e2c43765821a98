# SPDX-License-Identifier: MIT
"""Faults injected and survived: scenarios run on two virtual buses, and judged.

scenario   what a scenario file says, and what a seed makes of it
stand      controller, injector and drives as processes
run_case   one scenario with one seed, by disturb (uploads), and recover
actions    what the host does to processes and uploads meanwhile
record     what a case works with and leaves
evidence   what the recordings of both buses tell
judge      what of that must not be
campaign   all scenarios with all seeds
table      the result for people and for JSON
"""
