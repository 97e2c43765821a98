# SPDX-License-Identifier: MIT
"""SDO access to one node: reading and writing objects in turn with other commands, and errors in our words."""

from __future__ import annotations

import os
import queue
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any, TypeVar

import can
import canopen
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from ...errors import BusError, BusyError, RefusedError, one_line
from ..address import BusAddress
from ..clock import REAL_CLOCK, Clock
from .channel_lock import TURN_WAIT_S, Turns
from .objects import COMMAND, STATE

IDENTITY_OBJECT = 0x1018
IDENTITY = ((1, "vendor", 0), (2, "product code", 0), (3, "revision", 16))
"""Sub-index, name, low bits that may differ (the minor revision)."""

NOWHERE = 0x5000
"""The first of the 4096 indices that no EDS uses."""
LET_PASS_S = 1.0
ABORT, ABORT_BUSY = 0x80, 0x08000021
"""Command byte of an abort; the code by which a server that has a transfer under way refuses another client."""
BUSY_S = 5.0
"""Patience with that: a client that is gone is forgotten after two seconds."""
_BUSY_LOOK_S = 0.05
_NOBODY = b"\xff\xff\xff"
"""No object that anybody asks for."""
_NO_OBJECT = bytes(3)
_SDO_BYTES = 8
_SCS, _NAMING = 0xE0, (0x40, 0x60)
"""Bits of a server's command byte; those of the first answers to an upload and to a download, which name the object."""
_COMMAND = struct.pack("<HB", COMMAND, 0)
_COMMAND_TAKEN = b"\x60" + _COMMAND + bytes(4)
_AGAIN_S = 0.25
_T = TypeVar("_T")


class _SilentError(BusError):
    """No answer to the question that lets other answers pass."""


class _Answers:
    """canopen's queue of answers, less what is no SDO, and what is meant for another client of the same server."""

    def __init__(self, queued: Any) -> None:
        self._queued = queued
        self.asked = b""
        """Index and sub-index, as in a frame, of what we ask; empty: not known."""

    def put(self, answer: bytes) -> None:
        if len(answer) != _SDO_BYTES or (answer == _COMMAND_TAKEN and self.asked != _COMMAND):
            return  # of no SDO server; or another client's command to stop, which waits for no transfer
        if not (self.asked and self._is_for_another(answer)):
            self._queued.put(answer)

    def _is_for_another(self, answer: bytes) -> bool:
        """An abort or a first answer that names another object; servers may abort without a name. In the middle of a
        transfer only the refusal of another client.
        """
        named = answer[1:4]
        if named == self.asked:
            return False
        if self.asked == _NOBODY or answer[0] == ABORT:
            refusal = answer[4:8] == ABORT_BUSY.to_bytes(4, "little")
            other = self.asked != _NOBODY and named != _NO_OBJECT
            return answer[0] == ABORT and (refusal or other)
        return answer[0] & _SCS in _NAMING

    def get(self, block: bool = True, timeout: float | None = None) -> Any:
        return self._queued.get(timeout=timeout) if block else self._queued.get(block=False)

    def empty(self) -> bool:
        """True, always: what came before a request is no answer to it, and is thrown away here."""
        while not self._queued.empty():
            self._queued.get(block=False)
        return True


class Node:
    """A node with an SDO server, as its EDS describes it."""

    def __init__(
        self,
        address: BusAddress,
        node_id: int,
        node: canopen.RemoteNode,
        clock: Clock = REAL_CLOCK,
    ) -> None:
        """`clock` is that of the node's network: time-outs are counted by it."""
        self.address = address
        self.node_id = node_id
        self.clock = clock
        self._turns = Turns(address, node_id, clock)
        self.turn_wait_s = TURN_WAIT_S
        """Patience for a turn at the channel where nothing else is given."""
        self._under_way = False
        self._left_s: float | None = None
        """The rest of the time that a question may take, None: no limit of its own."""
        self._identified = False
        self.sdo: Any = node.sdo
        self.sdo.RESPONSE_TIMEOUT = 3.0
        self._answers = self.sdo.responses = _Answers(self.sdo.responses)

    def close(self) -> None:
        """Gives back what was opened for taking turns."""
        self._turns.close()

    @contextmanager
    def turn(self, wait_s: float | None = None, busy_s: float | None = None) -> Iterator[None]:
        """The node's SDO channel is ours inside; what was sent to others, or came too late to us, is thrown away.

        Raises BusyError when there is no turn in `wait_s` (None: turn_wait_s), or the node serves another client for
        more than `busy_s` (None: BUSY_S); BusError when the node does not answer, or when what is inside can't send.
        """
        try:
            with self._turns.turn(self.turn_wait_s if wait_s is None else wait_s) as handed_over:
                self._under_way |= handed_over
                if self._under_way:
                    self._let_pass(BUSY_S if busy_s is None else busy_s)
                yield
        except SdoCommunicationError:
            self._under_way = True
            raise
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.address}: cannot send: {one_line(error)}") from error
        except (KeyboardInterrupt, SystemExit):  # between a request and its answer, perhaps
            self._under_way = True
            raise

    def _let_pass(self, busy_s: float) -> None:
        """Throws away answers that nobody waits for: all that come before the answer to a question only we ask.

        The question is for an object that does not exist, another one for everybody and each time, so the answer is an
        abort that names it. Until it has come nothing else may be asked: it would be taken for the answer to that.
        """
        nowhere = self._answers.asked = self._nowhere()
        try:
            self._wait_for_abort(nowhere, busy_s)
        finally:
            self._answers.asked = b""

    def _wait_for_abort(self, nowhere: bytes, busy_s: float) -> None:
        """Asks for an object that does not exist, until its abort has come."""
        request = bytearray(b"\x40" + nowhere + bytes(4))
        self.sdo.send_request(request)
        begun_s = self.clock.now_s()
        patience_s = max(LET_PASS_S, self.sdo.RESPONSE_TIMEOUT)
        if self._left_s is not None:
            patience_s = min(patience_s, self._left_s)
        deadline = begun_s + patience_s
        with suppress(queue.Empty):
            while (left := deadline - self.clock.now_s()) > 0:
                answer = self.sdo.responses.get(timeout=left)
                if answer[1:4] != nowhere:
                    continue
                if int.from_bytes(answer[4:8], "little") != ABORT_BUSY:
                    self._under_way = False
                    return
                if self.clock.now_s() - begun_s > busy_s:
                    raise self._busy()
                self.clock.sleep(_BUSY_LOOK_S)
                self.sdo.send_request(request)
                deadline = self.clock.now_s() + patience_s
        raise _SilentError(f"{self.who()} stopped answering: is its process or its power gone?")

    def _busy(self) -> BusyError:
        return BusyError(
            f"{self.who()} is in the middle of a transfer with another SDO client (a program on another computer?): "
            "try again when that is done"
        )

    def patiently(self, index: int, sub: int | None, action: Callable[[], _T]) -> _T:
        """What an action on one object gives that takes a turn by itself; while the server has a transfer of another
        client under way it is tried again for a while, then BusError is raised.
        """
        limit_s = self.clock.now_s() + BUSY_S
        while True:
            try:
                with self.turn():
                    self._answers.asked = _frame_bytes(index, sub)
                    return action()
            except SdoAbortedError as error:
                if error.code != ABORT_BUSY:
                    raise
                if self.clock.now_s() > limit_s:
                    raise self._busy() from error
            finally:
                self._answers.asked = b""
            self.clock.sleep(_BUSY_LOOK_S)

    def transfer_begun(self) -> None:
        """Inside `patiently`: the server has taken our first request, so whom it refuses from now on is another."""
        self._answers.asked = _NOBODY

    def _nowhere(self) -> bytes:
        """Another one each time, and for everybody; in virtual time the same in each run."""
        if self.clock.is_virtual:
            return _nowhere(self.clock.stamp_ns() // 1000)
        return _nowhere(int.from_bytes(os.urandom(3), "little"))

    def read(self, index: int, sub: int | None = None) -> int:
        """An integer object."""

        def action() -> int:
            return int(self._variable(index, sub).raw)

        return self._guarded(action, index, sub)

    def write(self, index: int, sub: int | None, value: int) -> None:
        """Writes an integer object. A refusal is an SdoAbortedError's text in a RefusedError."""

        def action() -> None:
            self._variable(index, sub).raw = value

        self._guarded(action, index, sub)

    def _variable(self, index: int, sub: int | None) -> Any:
        return self.sdo[index] if sub is None else self.sdo[index][sub]

    def _guarded(self, action: Callable[[], _T], index: int, sub: int | None) -> _T:
        try:
            return self.patiently(index, sub, action)
        except SdoAbortedError as error:
            raise RefusedError(
                f"{self.who()} refused object {_name(index, sub)}: {error}"
            ) from error
        except SdoCommunicationError as error:
            raise BusError(
                f"{self.who()} stopped answering (object {_name(index, sub)}): "
                "is its process or its power gone?"
            ) from error
        except KeyError as error:
            raise BusError(
                f"the EDS file has no object {_name(index, sub)}: wrong version?"
            ) from error

    def who(self) -> str:
        """The node and its bus, to begin a message with."""
        return f"node {self.node_id} on {self.address}"

    def write_at_once(self, index: int, value: int) -> None:
        """Writes an object of one byte that the server takes at any time (commands to stop): without a turn, and beside
        whatever transfer is under way. Raises SdoAbortedError, BusError.
        """
        asked = self._answers.asked = _frame_bytes(index, None)
        request = bytearray(b"\x2f" + asked + bytes((value, 0, 0, 0)))
        end_s = self.clock.now_s() + float(self.sdo.RESPONSE_TIMEOUT)
        try:
            while (now_s := self.clock.now_s()) < end_s:
                self.sdo.send_request(request)
                answer = self._answer_to(asked, min(now_s + _AGAIN_S, end_s))
                code = int.from_bytes(answer[4:8], "little") if answer[:1] == bytes((ABORT,)) else 0
                if code == ABORT_BUSY:  # a controller that makes stops wait as well
                    self.clock.sleep(_BUSY_LOOK_S)
                elif code:
                    raise SdoAbortedError(code)
                elif answer:
                    return
        except (can.CanError, OSError) as error:
            raise BusError(f"{self.address}: cannot send: {one_line(error)}") from error
        finally:
            self._answers.asked = b""
        raise BusError(f"{self.who()} stopped answering a command")

    def _answer_to(self, asked: bytes, end_s: float) -> bytes:
        """The next answer to a write of this object, empty when none comes."""
        with suppress(queue.Empty):
            while (left := end_s - self.clock.now_s()) > 0:
                answer: bytes = self._answers.get(timeout=left)
                if answer[1:4] == asked and answer[0] in (_COMMAND_TAKEN[0], ABORT):
                    return answer
        return b""

    def answers(self, wait_s: float, turn_wait_s: float = TURN_WAIT_S) -> bool:
        """Whether the node answers an SDO within `wait_s`.

        Raises BusyError when another command, or a client on another computer, keeps it to itself for longer than
        `turn_wait_s`.
        """
        patience, self.sdo.RESPONSE_TIMEOUT = self.sdo.RESPONSE_TIMEOUT, min(0.25, wait_s)
        begun_s = self.clock.now_s()
        deadline = begun_s + wait_s
        try:
            while True:
                try:
                    self._left_s = max(deadline - self.clock.now_s(), 0.001)
                    with self.turn(turn_wait_s, min(turn_wait_s, BUSY_S)):
                        self._variable(STATE, None).raw  # noqa: B018
                    self._check_identity()
                    return True
                except SdoAbortedError as error:
                    if error.code != ABORT_BUSY:
                        raise BusError(
                            f"{self.who()} is not a Hodograph controller: {error}"
                        ) from error
                    if self.clock.now_s() >= begun_s + turn_wait_s:
                        raise self._busy() from error
                    self.clock.sleep(_BUSY_LOOK_S)
                except (SdoCommunicationError, _SilentError):
                    if self.clock.now_s() >= deadline:
                        return False
        finally:
            self.sdo.RESPONSE_TIMEOUT, self._left_s = patience, None

    def _check_identity(self) -> None:
        """Raises BusError when the node is not what the EDS file describes."""
        if self._identified:
            return
        for sub, name, kept in IDENTITY:
            wanted = int(self.sdo.od[IDENTITY_OBJECT][sub].default or 0) >> kept
            with self.turn():
                found = int(
                    self._variable(IDENTITY_OBJECT, sub).raw
                )  # a slow answer is the caller's to judge
            if found >> kept != wanted:
                raise BusError(
                    f"{self.who()} has {name} {found:#x}, the EDS file of these host tools {wanted << kept:#x}: "
                    "controller and host tools are of different versions, rebuild both"
                )
        self._identified = True

    def require(self, wait_s: float, busy_s: float | None = None) -> None:
        """Raises BusError unless the node answers within `wait_s`, BusyError when others keep it for more than `busy_s`
        (None: as long).
        """
        if not self.answers(wait_s, wait_s if busy_s is None else busy_s):
            raise BusError(
                f"no answer from {self.who()} in {wait_s:g} s: start the controller "
                f"(hodograph rig --bus {self.address} brings up a simulated machine)"
            )


def _nowhere(number: int) -> bytes:
    """One of 2^20 objects that no EDS has, by the lowest bits of a number: index and sub-index as in an SDO."""
    return struct.pack("<HB", NOWHERE | (number & 0xFFF), number >> 12 & 0xFF)


def _frame_bytes(index: int, sub: int | None) -> bytes:
    """As in a frame."""
    return struct.pack("<HB", index, sub or 0)


def _name(index: int, sub: int | None) -> str:
    return f"0x{index:04X}" if sub is None else f"0x{index:04X} sub {sub}"
