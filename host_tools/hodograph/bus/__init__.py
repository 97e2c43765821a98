# SPDX-License-Identifier: MIT
"""The CAN side of the host tools.

sdo          what is sent to the controller: objects, programs, commands, state
capture      what is received from the bus: frames, recordings, load, setpoints that jump
diagnostics  states, faults and refusals as text
address      which bus; known to all of these
The rest uses them: run, goto, analysis, status_text, and the processes of a simulated machine.
"""
