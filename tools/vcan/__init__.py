# SPDX-License-Identifier: MIT
"""A vcan0 (and vcan1) for a command: the kernel's own, or inside user-mode Linux. tools/with-vcan is the command.

main       command line
kernel     the buses of this Linux kernel: an existing vcan0, or buses in a new network namespace
client     runs one command on a user-mode bus, passing its streams, signals and exit status
broker     owns the user-mode Linux process; joins clients to the agent; ends and cleans everything
user_mode  starts and ends that process
agent      first process inside user-mode Linux: starts the commands, opens connections
channel    base class for streams inside: a command (job) or a TCP connection (connection)
forward    TCP ports outside, passed on to ports beside the bus
relay      passes on the connections of forward
frames     frames between client, broker and agent
registry   list of open buses
"""
