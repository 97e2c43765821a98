# SPDX-License-Identifier: MIT
"""The live page: `hodograph monitor`, on a running bus or from a recording (docs/guides/monitor.md).

source       source of frames: a bus, or a recording
decoder      frames to samples, one for each SYNC
derived      samples and the program's curve to the figures of the plots: feed, jerk, following and contour error
job_path     the contour error of a streamed job, from the chunks on the bus
messages     groups of rows that keep their peaks, as JSON
pump         all of these, some 25 times a second, in a thread of its own
link         the controller's state and commands, by SDO, in another
emergencies  EMCY frames as events, a bounded number of equal ones
clients      client slots, and bounded queues of messages to the browsers
security     who may see, who may command
server       HTTP and WebSocket
session      a monitor from start to end
page         the files for the browser

Used by cli/monitor_command. Receives frames from the bus or reads a recording, reads and writes objects of the
controller by SDO, and serves HTTP and WebSocket.
"""
