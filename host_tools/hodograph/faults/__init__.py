# SPDX-License-Identifier: MIT
"""Fault scenarios: injects faults into simulated machines on two virtual buses, and checks the reaction. Used by
campaign/, cli/faults_command and schemas/campaign_file. Reads scenario files, starts processes, and uses the buses.

scenario       keys of a scenario file, and the fault rules that a seed makes of it
bench          controller, injector and drives as processes
case_runner    runs and judges cases: the first run by disturb (uploads), recovery, the second run
fault_actions  actions of the host in a case: kills processes, breaks off uploads
case_run       machine, program and notes of a case: the input of the judge
case_record    the evidence in the recordings of both buses
judge          violations in a case record
case_table     the result as text and as JSON
"""
