# SPDX-License-Identifier: MIT
"""The CAN side of the host tools. Used by many modules of host_tools: commands, commissioning, streaming, the live
page, fault cases.

sdo          sends to the controller: objects, programs, commands; reads its state
capture      receives from the bus: frames, recordings, load, setpoint step check
diagnostics  states, faults and refusals as text
address      names of buses; used by all of these
clock        real or virtual time of a bus

The other modules use them: run, goto, analysis, status_text, and the processes of a simulated machine. Modules send and
receive frames, start processes, and read and write recordings; analysis, diagnostics and status_text do not.
"""
