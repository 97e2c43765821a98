# SPDX-License-Identifier: MIT
"""Object 0x2060 of the controller: sends chunks (parts) of a job, and reads the state of the job
(docs/reference/protocol.md 3.7). Used by bus/, cli/stream_command, monitor/link and stream/sender. Reads and writes
objects of the controller by SDO.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ...errors import BusError, RefusedError, one_line
from ...fixed_point import MM_PER_Q40
from .node import Node
from .objects import STREAM
from .upload import ABORT_VALUE_RANGE, block_download, program_fault_text

ABORT_NO_ROOM = 0x05040005
"""Abort code: out of memory. The ring has no room for the chunk."""
NONE, OPEN, UNDERRUN, ENDED, STOPPED, PROGRAM_STOP = range(6)
"""Values of sub 2."""
UNKNOWN_MS = 0xFFFFFFFF
_TRIES = 4
"""Attempts to send a chunk."""
_PATIENCE_S = 5.0
"""Longest time until an answer in the transfer of a chunk."""
_OTHER_FORMAT = -80
"""Also the refusal of a chunk whose version the controller does not read."""
_CORRUPT = (-4, _OTHER_FORMAT, -81)
"""Refusals that may be due to a transfer error: the chunk is sent again."""


@dataclass(frozen=True)
class StreamStatus:
    """The content of object 0x2060.

    committed_s    motion from here to the rest at the end of the newest accepted chunk
    line           source line of the executed chunk
    arc_length_mm  arc length of the motion in the job
    remaining_s    from here to the end of the job, by the newest accepted chunk; None: not known
    """

    state: int
    job: int
    wanted: int
    free_bytes: int
    committed_s: float
    sequence: int
    line: int
    arc_length_mm: float
    remaining_s: float | None
    underruns: int

    def json(self) -> dict[str, Any]:
        """As a dictionary for JSON. `way_mm` is the arc length: the key is an interface."""
        keys = {"arc_length_mm": "way_mm"}
        return {keys.get(name, name): value for name, value in asdict(self).items()}


def stream_status(node: Node) -> StreamStatus:
    """Raises BusError and RefusedError: the controller does not answer, or has no streams."""
    values = [node.read(STREAM, sub) for sub in (2, 3, 4, 7, 8, 9, 10, 11, 12, 13)]
    state, job, wanted, free, committed, sequence, line, arc_length, remaining, underruns = values
    return StreamStatus(
        state,
        job,
        wanted,
        free,
        1e-3 * committed,
        sequence,
        line,
        arc_length * MM_PER_Q40,
        None if remaining == UNKNOWN_MS else 1e-3 * remaining,
        underruns,
    )


def close_stream(node: Node) -> None:
    """Closes a job that is over, which frees the ring. Raises RefusedError: axes move."""
    if node.read(STREAM, 2) != NONE:
        node.write(STREAM, 15, 1)


def send_chunk(node: Node, data: bytes, job: int, sequence: int, place: str) -> bool:
    """Sends a chunk, again if the transfer broke off or had errors. False: the ring has no room for it now.

    place  file and line, for messages
    Raises RefusedError: the controller refuses it. Raises BusError: no transfer succeeds.
    """
    last = ""
    for _ in range(_TRIES):
        patience, node.sdo.RESPONSE_TIMEOUT = node.sdo.RESPONSE_TIMEOUT, _PATIENCE_S
        try:
            node.patiently(STREAM, 1, lambda: block_download(node, STREAM, data))
            return True
        except SdoAbortedError as error:
            if error.code == ABORT_NO_ROOM:
                return False
            last = str(error)
            if _accepted(node, job, sequence):
                return True
            if error.code == ABORT_VALUE_RANGE:
                last = _wrong_bytes(node, place)
        except (SdoCommunicationError, RuntimeError) as error:
            last = one_line(error)
            if _accepted(node, job, sequence):
                return True
        finally:
            node.sdo.RESPONSE_TIMEOUT = patience
    raise BusError(
        f"{place}: a part of the job does not come through to {node.who()}: {last}: the motion rests on the path; "
        "hodograph stream --continue goes on"
    )


def _accepted(node: Node, job: int, sequence: int) -> bool:
    """Whether the controller has the chunk: the answer to it may have been lost."""
    try:
        return node.read(STREAM, 3) == job and node.read(STREAM, 4) > sequence
    except BusError:
        return False


def _wrong_bytes(node: Node, place: str) -> str:
    """The reason of a refusal that may be due to a transfer error. Raises RefusedError: the bytes came as they were
    sent.
    """
    code, index = node.read(STREAM, 5), node.read(STREAM, 6)
    text = program_fault_text(code, index)
    if code not in _CORRUPT:
        raise RefusedError(
            f"{place}: {node.who()} refused a part of the job: {text}: the motion rests on "
            "the path; hodograph stop ends it"
        )
    cause = (
        ", as where host and controller are of different versions" if code == _OTHER_FORMAT else ""
    )
    return text + cause
