# SPDX-License-Identifier: MIT
"""Sends a program image to the controller by SDO block download.

Used by sdo/controller, sdo/status, sdo/stream_channel and cli/bus_commands. Reads and writes objects, and waits by the
clock of the bus, real or virtual.
"""

from __future__ import annotations

from collections.abc import Callable

from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ...errors import BusError, RefusedError, one_line
from ..diagnostics.texts import STATES
from .node import Node
from .objects import PROGRAM, PROGRAM_MEMORY, STATE, STREAM

ABORT_VALUE_RANGE, ABORT_STATE = 0x06090030, 0x08000022
_GAP_S = 0.01
"""Pause between two blocks, so that heartbeats are sent in time.

They have a lower priority than SDO. The fullest bus that `require_fit` allows can carry one or two more frames in a
period.
"""

_FATE_S = 1.0
"""Time for reading the state of the program after an upload that broke off."""

Progress = Callable[[int], None]


def upload(node: Node, image: bytes, progress: Progress | None = None) -> None:
    """Sends a program image by block download; on a refusal the old program stays.

    `progress` is called with the number of bytes sent so far.
    """
    require_room(node, image)
    before = _active(node)
    patience, node.sdo.RESPONSE_TIMEOUT = node.sdo.RESPONSE_TIMEOUT, 5.0
    try:
        node.patiently(PROGRAM, 1, lambda: block_download(node, PROGRAM, image, progress))
    except SdoAbortedError as error:
        raise _refusal(node, error, before) from error
    except (SdoCommunicationError, RuntimeError) as error:
        raise BusError(
            f"upload to {node.who()} broke off: {one_line(error)}: {_consequence(node, before)}; upload again"
        ) from error
    finally:
        node.sdo.RESPONSE_TIMEOUT = patience


def require_room(node: Node, image: bytes) -> None:
    """Raises RefusedError: no bank of this controller can hold the program with its coefficient records."""
    from ...program.image import HEADER_SIZE, RecordBytes, memory_bytes

    if len(image) < HEADER_SIZE:
        return
    bank, *records = (node.read(PROGRAM_MEMORY, sub) for sub in range(1, 6))
    needed = memory_bytes(image, RecordBytes(*records))
    if needed > bank:
        raise RefusedError(
            f"{node.who()} has {bank} bytes for a program, this one takes {needed} with its precomputed coefficients: "
            "split the path, or use a controller with more memory; the old program stays"
        )


def _active(node: Node) -> tuple[int, int]:
    """State and CRC-32 of the active program."""
    return node.read(PROGRAM, 2), node.read(PROGRAM, 5)


def _consequence(node: Node, before: tuple[int, int]) -> str:
    """Text about the old program, for messages."""
    node.sdo.RESPONSE_TIMEOUT = _FATE_S
    try:
        now = _active(node)
    except (BusError, RefusedError):
        return "whether the old program is still there is not known (hodograph status shows it)"
    if now[1] != before[1]:
        return "the controller has another program now"
    return "the old program is unharmed" if before[1] else "there is no program yet"


def block_download(node: Node, index: int, image: bytes, progress: Progress | None = None) -> None:
    """Writes sub 1 of an object by block download. Raises the errors of the SDO client."""
    stream = node.sdo.open(index, 1, "wb", buffering=0, size=len(image), block_transfer=True)
    node.transfer_begun()
    try:
        while stream.pos < len(image):
            stream.write(image[stream.pos : stream.pos + 7])
            if stream._seqno == 0:  # the block is acknowledged
                node.clock.sleep(_GAP_S)
                node.block_taken()
            if progress is not None:
                progress(stream.pos)
    except BaseException as error:
        stream._initialized = False  # or close() would go on with the protocol
        if not isinstance(error, SdoAbortedError):
            node.sdo.abort()
        raise
    stream.close()


def _refusal(
    node: Node, error: SdoAbortedError, before: tuple[int, int]
) -> RefusedError | BusError:
    if error.code == ABORT_STATE:
        return RefusedError(
            f"{node.who()} takes no program now ({STATES.get(node.read(STATE), '?')}): "
            "wait until the axes stand, or hodograph stop"
        )
    if error.code != ABORT_VALUE_RANGE:
        return BusError(f"upload to {node.who()} failed: {error}: {_consequence(node, before)}")
    code, index = node.read(PROGRAM, 3), node.read(PROGRAM, 4)
    return RefusedError(
        f"{node.who()} refused the program: {program_fault_text(code, index)}; "
        "the old program stays"
    )


def refused_last(node: Node) -> str | None:
    """Why the last upload, or the newest program that was stored, was refused; None: it was not, or a job is open."""
    code = node.read(PROGRAM, 3)
    if code == 0 or node.read(STREAM, 2) != 0:
        return None
    return program_fault_text(code, node.read(PROGRAM, 4))


def program_fault_text(code: int, index: int) -> str:
    """A refusal code of program_check in words, with its place."""
    from ...program.check import Fault
    from ...program.codes import ProgramError

    try:
        fault = Fault(ProgramError(code), index)
    except ValueError:
        return f"code {code} at {index}, unknown to this version of the host tools"
    return f"{fault.code.text} ({fault.code.name}, code {code}, {fault.place})"
