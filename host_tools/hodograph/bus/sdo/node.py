# SPDX-License-Identifier: MIT
"""SDO access to one node: reads and writes objects, one command of this computer at a time (sdo/channel_lock), with
errors as diagnostics texts. Used by sdo/configuration, sdo/controller, sdo/stream_channel and sdo/upload. Sends,
receives, and waits by the clock of the bus, real or virtual.
"""

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
from ..address import BusAddress, is_virtual
from ..clock import REAL_CLOCK, Clock
from .channel_lock import TURN_WAIT_S, Turns
from .objects import COMMAND, STATE

IDENTITY_OBJECT = 0x1018
IDENTITY = ((1, "vendor", 0), (2, "product code", 0), (3, "revision", 16))
"""Sub-index, name, number of low bits that may differ (the minor revision)."""

NOWHERE = 0x5000
"""The first of the 4096 indices that no EDS uses."""
LET_PASS_S = 1.0
"""Least time that a request waits until the transfer of another client has ended."""
ABORT, ABORT_BUSY = 0x80, 0x08000021
"""Command byte of an abort; the code with which a server refuses a second client during a transfer."""
NO_OBJECT = (0x06020000, 0x06090011)
"""Abort codes of a server without the object, or without the subindex."""
BUSY_S = 5.0
"""Longest wait while another client has a transfer open: after two seconds the server drops a client that is gone."""
_BUSY_LOOK_S = 0.05
"""Time between two attempts while the SDO channel is busy."""
_NOBODY = b"\xff\xff\xff"
"""In place of the object that this client reads: it waits for no answer."""
_NO_OBJECT = bytes(3)
"""Index and sub of an abort that names no object."""
_SDO_BYTES = 8
_SCS, _NAMING = 0xE0, (0x40, 0x60)
"""Bits of a server's command byte; those of the first answers to an upload and to a download, which name the object."""
_COMMAND = struct.pack("<HB", COMMAND, 0)
_COMMAND_TAKEN = b"\x60" + _COMMAND + bytes(4)
_BLOCK_TAKEN = 0xA2
"""Command byte of the answer to a block of a download."""
_AGAIN_S = 0.25
"""Time after which `write_at_once` sends a request without answer again."""
AGAIN_S = 1.0
"""A request without an answer for this long is repeated once: a ring of chunks may hold little more motion."""
BROKEN = (0x05030000, 0x05040000, 0x05040001)
"""Aborts of a server in another state of the transfer than the client: toggle bit, time-out, unexpected command."""
_T = TypeVar("_T")


class _SilentError(BusError):
    """The probe that separates old answers from new ones got no answer."""


class _Answers:
    """canopen's queue of answers, without other frames and without answers to another client of the same server."""

    def __init__(self, queued: Any) -> None:
        self._queued = queued
        self.asked = b""
        """Index and sub-index, as in a frame, of the requested object; empty: not known."""

    def put(self, answer: bytes) -> None:
        if len(answer) != _SDO_BYTES or (answer == _COMMAND_TAKEN and self.asked != _COMMAND):
            return  # of no server; or the answer to a stop command of another client
        if not (self.asked and self._is_for_another(answer)):
            self._queued.put(answer)

    def _is_for_another(self, answer: bytes) -> bool:
        """Whether it is an abort or a first answer for another object (servers may abort without naming it). Within a
        transfer: whether it is the refusal of another client.
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

    def drop_doubled_acknowledgements(self) -> None:
        """Between two blocks of a download: a frame that CAN doubled would count for the next block."""
        waiting = []
        with suppress(queue.Empty):
            while True:
                waiting.append(self._queued.get(block=False))
        for answer in waiting:
            if answer[0] != _BLOCK_TAKEN:
                self._queued.put(answer)

    def empty(self) -> bool:
        """Always True: answers from before a request do not belong to it and are discarded here."""
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
        """Default wait for the channel lock."""
        self._under_way = False
        self._left_s: float | None = None
        """The remaining time of a request; None: it has no limit of its own."""
        self._identified = False
        self._remote = node
        self.sdo: Any = node.sdo
        self.sdo.RESPONSE_TIMEOUT = 3.0
        self._answers = self.sdo.responses = _Answers(self.sdo.responses)

    def call_while_waiting(self, function: Callable[[], None]) -> None:
        """Calls `function` again and again while other clients have the channel. It may use `write_at_once`."""
        self._turns.while_waiting = function

    def close(self) -> None:
        """Closes the channel lock."""
        self._turns.close()

    def is_wanted(self) -> bool:
        """Whether another client waits for the channel, which this one holds by `turn`."""
        return self._turns.is_wanted()

    @contextmanager
    def turn(self, wait_s: float | None = None, busy_s: float | None = None) -> Iterator[None]:
        """Holds the channel lock inside the context. Answers to other clients, and late ones, are discarded.

        Raises BusyError: the lock is not free within `wait_s` (None: turn_wait_s), or the node serves another client
        for more than `busy_s` (None: BUSY_S). Raises BusError: the node does not answer, or frames cannot be sent.
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
        """Discards old answers: all that come before the answer to a probe.

        The probe reads an object that does not exist, a different one for each client and call, so its answer is an
        abort that names it. No other request may be sent until it has come, since old answers could be taken for its
        answer.
        """
        nowhere = self._answers.asked = self._nowhere()
        try:
            self._wait_for_abort(nowhere, busy_s)
        finally:
            self._answers.asked = b""

    def _wait_for_abort(self, nowhere: bytes, busy_s: float) -> None:
        """Reads an object that does not exist until its abort has come."""
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
        """The result of an action on one object that holds the lock by itself. While the server serves another client,
        it is tried again for a while, then BusError is raised.
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
            self._turns.while_waiting()
            self.clock.sleep(_BUSY_LOOK_S)

    def transfer_begun(self) -> None:
        """Inside `patiently`: the server has accepted the first request, so later refusals are for another client."""
        self._answers.asked = _NOBODY

    def block_taken(self) -> None:
        """Inside a block download: the server has acknowledged a block."""
        self._answers.drop_doubled_acknowledgements()

    def _nowhere(self) -> bytes:
        """A different number for each call and client; in virtual time the same in each run."""
        if self.clock.is_virtual:
            return _nowhere(self.clock.stamp_ns() // 1000)
        return _nowhere(int.from_bytes(os.urandom(3), "little"))

    def read(self, index: int, sub: int | None = None) -> int:
        """An integer object. If the answer is lost, or the transfer broke off, it is requested again, once."""

        def action() -> int:
            return int(self._variable(index, sub).raw)

        return self._guarded(lambda: self._twice(index, sub, action), index, sub)

    def write(self, index: int, sub: int | None, value: int) -> None:
        """Writes an integer object. After a lost answer it is written again, once: for objects where this changes
        nothing more. A refusal is an SdoAbortedError's text in a RefusedError.
        """
        self._guarded(
            lambda: self._twice(index, sub, lambda: self._put(index, sub, value)), index, sub
        )

    def _put(self, index: int, sub: int | None, value: int) -> None:
        self._variable(index, sub).raw = value

    def _twice(self, index: int, sub: int | None, action: Callable[[], _T]) -> _T:
        with self.broken_ignored(), self._patience(AGAIN_S):
            return self.patiently(index, sub, action)
        return self.patiently(index, sub, action)

    @contextmanager
    def broken_ignored(self) -> Iterator[None]:
        """Ignores that a transfer broke off: no answer, or one to a transfer that the server has ended meanwhile, as
        after this process was stopped for a while.
        """
        try:
            yield
        except (SdoCommunicationError, _SilentError):
            self._under_way = True
        except SdoAbortedError as error:
            if error.code not in BROKEN:
                raise
            self._under_way = True

    @contextmanager
    def _patience(self, most_s: float) -> Iterator[None]:
        """Waits for answers at most this long inside the context."""
        patience = self.sdo.RESPONSE_TIMEOUT
        self.sdo.RESPONSE_TIMEOUT = min(patience, most_s)
        try:
            yield
        finally:
            self.sdo.RESPONSE_TIMEOUT = patience

    def _variable(self, index: int, sub: int | None) -> Any:
        return self.sdo[index] if sub is None else self.sdo[index][sub]

    def _guarded(self, action: Callable[[], _T], index: int, sub: int | None) -> _T:
        try:
            return action()
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
        """The node and its bus, for the beginning of a message."""
        return f"node {self.node_id} on {self.address}"

    def write_at_once(self, index: int, value: int) -> None:
        """Writes an object of one byte that the server accepts at any time (commands to stop), without the lock, also
        during a transfer of another client. Raises SdoAbortedError, BusError.
        """
        asked = self._answers.asked = _frame_bytes(index, None)
        request = bytearray(b"\x2f" + asked + bytes((value, 0, 0, 0)))
        end_s = self.clock.now_s() + float(self.sdo.RESPONSE_TIMEOUT)
        try:
            while (now_s := self.clock.now_s()) < end_s:
                self.sdo.send_request(request)
                answer = self._answer_to(asked, min(now_s + _AGAIN_S, end_s))
                code = int.from_bytes(answer[4:8], "little") if answer[:1] == bytes((ABORT,)) else 0
                if code == ABORT_BUSY:  # a controller that does not accept stops during a transfer
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

        Raises BusyError: another command, or a client on another computer, uses it for longer than `turn_wait_s`.
        """
        patience, self.sdo.RESPONSE_TIMEOUT = self.sdo.RESPONSE_TIMEOUT, min(0.25, wait_s)
        begun_s = self.clock.now_s()
        deadline = begun_s + wait_s
        try:
            while True:
                try:
                    self._left_s = max(deadline - self.clock.now_s(), 0.001)
                    with self.turn(turn_wait_s, min(turn_wait_s, BUSY_S)):
                        self._read_in_turn(STATE, None)
                    self._check_identity()
                    return True
                except SdoAbortedError as error:
                    if error.code != ABORT_BUSY:
                        raise BusError(
                            f"{self.who()} is not a Hodograph controller: {error}"
                        ) from error
                    if self.clock.now_s() >= begun_s + turn_wait_s:
                        raise self._busy() from error
                    self._turns.while_waiting()
                    self.clock.sleep(_BUSY_LOOK_S)
                except (SdoCommunicationError, _SilentError):
                    if self.clock.now_s() >= deadline:
                        return False
        finally:
            self.sdo.RESPONSE_TIMEOUT, self._left_s = patience, None

    def _read_in_turn(self, index: int, sub: int | None) -> int:
        """An integer object, inside `turn`; answers about others are discarded."""
        self._answers.asked = _frame_bytes(index, sub)
        try:
            return int(self._variable(index, sub).raw)
        finally:
            self._answers.asked = b""

    @property
    def is_heard(self) -> bool:
        """Whether a heartbeat of the node has come: it is there, though it may not answer."""
        return self._remote.nmt.timestamp is not None

    def _check_identity(self) -> None:
        """Raises BusError when the node is not what the EDS file describes."""
        if self._identified:
            return
        for sub, name, kept in IDENTITY:
            wanted = int(self.sdo.od[IDENTITY_OBJECT][sub].default or 0) >> kept
            with self.turn():
                found = self._read_in_turn(
                    IDENTITY_OBJECT, sub
                )  # the caller decides about a slow answer
            if found >> kept != wanted:
                raise BusError(
                    f"{self.who()} has {name} {found:#x}, the EDS file of these host tools {wanted << kept:#x}: "
                    "controller and host tools are of different versions, rebuild both"
                )
        self._identified = True

    def require(self, wait_s: float, busy_s: float | None = None) -> None:
        """Raises BusError: the node does not answer within `wait_s`. Raises BusyError: others use it for more than
        `busy_s` (None: `wait_s`).
        """
        if not self.answers(wait_s, wait_s if busy_s is None else busy_s):
            raise BusError(f"no answer from {self.who()} in {wait_s:g} s: {self._start_remedy()}")

    def _start_remedy(self) -> str:
        """What to do if no controller answers: on a bus with hardware a simulated machine is no remedy."""
        if is_virtual(self.address):
            return (
                "start the controller "
                f"(hodograph rig --bus {self.address} brings up a simulated machine)"
            )
        return "start the controller, and compare its bit rate and node number with those of this command"


def _nowhere(number: int) -> bytes:
    """One of 2^20 objects that no EDS has, by the lowest bits of a number: index and sub-index as in an SDO."""
    return struct.pack("<HB", NOWHERE | (number & 0xFFF), number >> 12 & 0xFF)


def _frame_bytes(index: int, sub: int | None) -> bytes:
    """Index and sub-index as in a frame."""
    return struct.pack("<HB", index, sub or 0)


def _name(index: int, sub: int | None) -> str:
    return f"0x{index:04X}" if sub is None else f"0x{index:04X} sub {sub}"
