# SPDX-License-Identifier: MIT
"""Worst-case bus time of the periodic frames of a machine; docs/reference/bus-time.md section 2. Used by bustime/fit
and bustime/recording. No I/O.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from .frame_bits import fd_bits
from .response import Task, response_time
from .traffic import CYCLIC, NEEDED, SDO, SPORADIC, Message, sync_bits

DRIVE_REACTION_US = 200
"""Assumed of a drive: TPDO1 waits for the bus this long after the end of SYNC, at most."""
COMPUTE_US = 55
"""Assumed of the controller, from the request of SYNC to that of the last setpoint: the shortest SYNC at 1 Mbit/s."""

_SCALE = 1_000_000
"""Microseconds in a second: bits become integers in units of 1 us / bitrate."""
_SENT_WITH_SYNC = ("setpoints", "offsets", "outputs")
"""Frames of the controller, ready `compute_us` after the request of SYNC, usually while SYNC is on the wire."""


@dataclass(frozen=True)
class BusTime:
    """Periodic frames on a bus of `bitrate` bit/s, with SDO frames in between at any time.

    Every length is the greatest that the frame can have. Times of `messages` run from the tick's request to send SYNC.

    data_bitrate  CAN FD: bit rate of data and CRC, `bitrate` or a multiple of it that divides 10^6; 0: classic CAN
    """

    messages: tuple[Message, ...]
    bitrate: int
    period_us: int
    reaction_us: int = DRIVE_REACTION_US
    compute_us: int = COMPUTE_US
    data_bitrate: int = 0

    @property
    def load_percent(self) -> float:
        """Bus load of all frames with worst-case stuffing, inputs changing all the time."""
        return self._percent(self.messages, self._length)

    @property
    def plain_load_percent(self) -> float:
        """Bus load without stuff bits and with constant inputs: a lower bound."""
        return self._percent(self.messages, self._least_length)

    def load_of(self, kind: str) -> tuple[float, float]:
        """Load in per cent of one kind of frames: without stuff bits, and at worst."""
        own = [m for m in self.messages if m.kind == kind]
        return self._percent(own, self._least_length), self._percent(own, self._length)

    def _percent(self, frames: Iterable[Message], length: Callable[[Message], int]) -> float:
        return sum(100.0 * length(m) / (m.period_us * self.bitrate) for m in frames)

    @property
    def sync_jitter_us(self) -> float:
        """Jitter of the end of SYNC: a frame before it, and the stuff bits of its counter."""
        sync = self.messages[0]
        if self.data_bitrate:
            stuffing = self._length(sync) - self._least_length(sync)
        else:
            least, greatest = sync_bits()
            stuffing = _SCALE * (greatest - least)
        return (self._blocking(sync) + stuffing) / self.bitrate

    @cached_property
    def responses_us(self) -> tuple[float | None, ...]:
        """The worst-case response time of each message; None: no bound, the bus is full."""
        return tuple(
            None if found is None else found / self.bitrate
            for found in map(self._response, self.messages)
        )

    @property
    def tick_us(self) -> float:
        """Time from the request of SYNC to the end of the last frame that the next SYNC needs."""
        return max(
            found
            for message, found in zip(self.messages, self.responses_us, strict=True)
            if message.kind in NEEDED and found is not None
        )

    @property
    def fits(self) -> bool:
        """Whether setpoints and positions of a tick end before the next one, and all frames have a bound."""
        return self.tick_us <= self.period_us and self.load_percent < 100

    # Below: integers in units of 1 us / bitrate, so that bits and microseconds are both whole.

    def _length(self, message: Message) -> int:
        if self.data_bitrate:
            return self._fd_length(message, stuffed=True)
        return message.worst_bits * _SCALE

    def _least_length(self, message: Message) -> int:
        if message.kind in SPORADIC:
            return 0
        if self.data_bitrate:
            return self._fd_length(message, stuffed=False)
        return message.plain_bits * _SCALE

    def _fd_length(self, message: Message, *, stuffed: bool) -> int:
        slow, fast = fd_bits(message.size, stuffed=stuffed)
        return slow * _SCALE + fast * (_SCALE * self.bitrate // self.data_bitrate)

    def _blocking(self, message: Message) -> int:
        lower = [m for m in self.messages if m.identifier > message.identifier]
        return max(self._length(m) for m in (*lower, SDO))

    @property
    def _sync_end(self) -> int:
        sync = self.messages[0]
        return self._blocking(sync) + self._length(sync)

    def _released(self, message: Message) -> int:
        """The earliest start of a setpoint without frames of higher priority: after SYNC, or later, after any frame."""
        return max(self._sync_end, self.compute_us * self.bitrate + self._blocking(message))

    def _response(self, message: Message) -> int | None:
        if message.kind == "SYNC":
            return self._sync_end
        ahead = self._ahead(message)
        if message.kind in NEEDED:
            of_tick = [m for m in ahead if m.kind in CYCLIC and m.kind != "SYNC"]
            through = sum(map(self._length, (*of_tick, message)))
            if message.kind in _SENT_WITH_SYNC:
                return self._released(message) + through
            return (
                self._sync_end + through + self.reaction_us * self.bitrate + self._blocking(message)
            )
        tasks = [self._task(m) for m in ahead]
        return response_time(self._task(message), tasks, self._blocking(message), _SCALE)

    def _ahead(self, message: Message) -> Sequence[Message]:
        return [m for m in self.messages if m.identifier < message.identifier]

    def _task(self, message: Message) -> Task:
        jitter = 0
        if message.kind in _SENT_WITH_SYNC:
            jitter = self._released(message)
        elif message.kind in CYCLIC and message.kind != "SYNC":
            jitter = self._sync_end + self.reaction_us * self.bitrate
        return Task(self._length(message), message.period_us * self.bitrate, jitter)
