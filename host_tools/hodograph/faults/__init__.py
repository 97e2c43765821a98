# SPDX-License-Identifier: MIT
"""Fault scenarios: injects faults into simulated machines on two virtual buses, and checks the reaction. Used by
campaign/, cli/faults_command and schemas/campaign_file. Reads scenario files, starts processes, and uses the buses.

scenario       the keys of a scenario file, and how a seed chooses the fault rules of a case
bench          controller, injector and drives as processes
case_runner    runs a case and has it judged: the disturbed run, recovery, the run after it
fault_actions  actions of the host in a case: kills processes, breaks off uploads
case_run       machine, program and notes of a case: the input of the judge
case_record    the evidence in the recordings of both buses
judge          violations in a case record
case_table     the result as text and as JSON
"""
