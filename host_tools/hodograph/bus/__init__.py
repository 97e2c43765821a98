# SPDX-License-Identifier: MIT
"""The CAN side of the host tools.

sdo         what is said to the controller: objects, programs, commands, state
listening   what is heard on the bus: frames, recordings, load, setpoints that jump
words       states, faults and refusals in words
address     which bus; known to all of these
The rest uses them: run, goto, analysis, status_text, and the processes of a simulated machine.
"""
