# SPDX-License-Identifier: MIT
"""Frames of the multiplexed channel between client, broker and agent. Used by vcan/. No I/O.

A frame is type u8, channel u32, length u32 (little-endian) and the payload. A channel is one command inside, or one TCP
connection to a port inside. Data flows against credit, so that a slow reader delays its own channel only: each side may
send WINDOW bytes per stream more than the other has acknowledged with CREDIT.

The line itself needs the same once more: a serial line of user-mode Linux whose 4096-byte input buffer
has once been full may receive nothing any more (seen with Linux 6.1). So the broker keeps at most LINE_IN bytes
unacknowledged, of whatever kind, and the agent LINE_OUT bytes of DATA.
"""

from __future__ import annotations

import struct

HEADER = struct.Struct("<BII")
COUNT = struct.Struct("<BI")  # CREDIT: stream, bytes
STATUS = struct.Struct("<i")  # EXIT: status; SIGNAL: number
WINDOW = 64 * 1024
CHUNK = 4096
LONGEST = 4 * 1024 * 1024
LINE_IN = 2048
LINE_OUT = 64 * 1024
ACK = struct.Struct("<I")  # LINE_ACK: bytes taken from the line
PORT = struct.Struct("<H")  # CONNECT

READY = 1  # agent to broker, broker to clients: booted, the bus is up
OPEN = 2  # client: JSON of the command: argv, env, cwd, umask, uid, gid, groups
DATA = 3  # payload: stream u8 and bytes; no bytes: end of the stream
CREDIT = 4  # payload: stream u8 and count u32
SIGNAL = 5  # client: send this signal to the command's process group
EXIT = 6  # agent: exit status of the command (128 + number when a signal ended it)
FAIL = 7  # broker: text; there is no bus (any more)
CLOSE = 8  # broker: the client of this channel is gone
LINE_ACK = 9  # broker and agent to each other
CONNECT = 10  # client: port u16; then DATA of STDIN and STDOUT as for a command, EXIT 0 at the end or errno

STDIN, STDOUT, STDERR = 0, 1, 2


def encode(kind: int, channel: int, payload: bytes = b"") -> bytes:
    """One frame."""
    return HEADER.pack(kind, channel, len(payload)) + payload


class Decoder:
    """Cuts a byte stream into frames."""

    def __init__(self) -> None:
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[tuple[int, int, bytes]]:
        """The frames (type, channel, payload) that are complete with these bytes. ValueError: not our stream."""
        self._buffer += data
        frames = []
        start = 0
        while len(self._buffer) - start >= HEADER.size:
            kind, channel, length = HEADER.unpack_from(self._buffer, start)
            if not READY <= kind <= CONNECT or length > LONGEST:
                raise ValueError(f"frame of type {kind} and length {length}")
            end = start + HEADER.size + length
            if len(self._buffer) < end:
                break
            frames.append((kind, channel, bytes(self._buffer[start + HEADER.size : end])))
            start = end
        del self._buffer[:start]
        return frames
