# SPDX-License-Identifier: MIT
"""A vcan0 (and vcan1) for a command: the Linux kernel's own, or inside user-mode Linux. Used by tools/with-vcan, which
is the command. Starts processes and makes network interfaces.

main       command line
kernel     the buses of this Linux kernel: an existing vcan0, or buses in a new network namespace
client     runs one command on a user-mode bus, passing its streams, signals and exit status
broker     owns the user-mode Linux process; joins clients to the agent; ends and cleans everything
user_mode  starts and ends that process
init.sh    first program inside user-mode Linux: mounts file systems, makes the buses, starts the agent
agent      process inside user-mode Linux: starts the commands, opens connections
channel    base class of job and connection: streams inside user-mode Linux
job        a command that runs there
connection a TCP connection to a port there
forward    TCP ports outside, forwarded to TCP ports inside user-mode Linux or the namespace
relay      forwards the connections of these ports
frames     frames between client, broker and agent
registry   list of open buses
errors     the exception that there is no bus
"""
