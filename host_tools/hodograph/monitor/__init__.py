# SPDX-License-Identifier: MIT
"""The live page: `hodograph monitor`, on a running bus or from a recording (docs/guides/monitor.md).

source, replay  where frames come from: a bus, a recording
decoder         frames to samples, one a SYNC
derived         samples to what the plots show: feed, acceleration, jerk, following error
path            the program's curve: to draw, and to measure the contour error from
decimator       many rows to few groups that keep their peaks
pump            all of these, some 25 times a second, in a thread of its own
link            the controller's state and commands, by SDO, in another
emergencies     EMCY frames as events, some of a storm
hub             messages to the browsers; bounded for each
security        who may see, who may command
seats           how many there may be, and who makes room
server          HTTP and WebSocket
session         puts it together
page            what the browser gets
"""
