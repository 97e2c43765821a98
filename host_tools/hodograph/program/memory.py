# SPDX-License-Identifier: MIT
"""How much of a controller's program store an image takes: itself, and the records behind it
(docs/reference/protocol.md 1.5)."""

from __future__ import annotations

import struct

from .image import HEADER_SIZE

RECORD_BYTES = {"fixed": (288, 208), "float": (272, 208), "double": (248, 176)}
"""Of a segment, of a piece, by kernel."""
LARGEST_BANK = 64 * 2**20 - 16
"""Bytes for a program of the largest store that a port of this project has (Linux); a board's is smaller."""
_COUNTS = struct.Struct("<20xII")


def memory_bytes(image: bytes, segment_bytes: int, piece_bytes: int) -> int:
    """Image and records of these sizes. The image has a whole header."""
    segments, pieces = _COUNTS.unpack_from(image[:HEADER_SIZE])
    return len(image) + int(segments) * segment_bytes + int(pieces) * piece_bytes
