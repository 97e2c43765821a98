# SPDX-License-Identifier: MIT
"""What the periodic frames of a machine take of the bus's time, at worst; docs/reference/bus-time.md section 2."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

from .response import Task, response_time
from .traffic import CYCLIC, NEEDED, SDO, SPORADIC, Message, sync_bits

DRIVE_REACTION_US = 200
"""Assumed of a drive: TPDO1 waits for the bus this long after the end of SYNC, at most."""
COMPUTE_US = 55
"""Assumed of the controller, from the request of SYNC to that of the last setpoint: the shortest SYNC at 1 Mbit/s."""

_SCALE = 1_000_000
_SENT_WITH_SYNC = ("setpoints", "offsets", "outputs")
"""By the controller, ready `compute_us` after the request of SYNC: while it is on the wire, as a rule."""


@dataclass(frozen=True)
class BusTime:
    """Periodic frames on a bus of `bitrate` bit/s, with SDO frames in between at any time.

    Every length is the greatest that the frame can have. Times of `messages` run from the tick's request to send SYNC.
    """

    messages: tuple[Message, ...]
    bitrate: int
    period_us: int
    reaction_us: int = DRIVE_REACTION_US
    compute_us: int = COMPUTE_US

    @property
    def load_percent(self) -> float:
        """Bus load of all frames with worst-case stuffing, inputs changing all the time."""
        return self._percent((m, m.worst_bits) for m in self.messages)

    @property
    def plain_load_percent(self) -> float:
        """The same without a single stuff bit and with inputs at rest: no run can be below."""
        return self._percent((m, _least_bits(m)) for m in self.messages)

    def load_of(self, kind: str) -> tuple[float, float]:
        """Load in per cent of one kind of frames: without stuff bits, and at worst."""
        own = [m for m in self.messages if m.kind == kind]
        return (
            self._percent((m, _least_bits(m)) for m in own),
            self._percent((m, m.worst_bits) for m in own),
        )

    def _percent(self, frames: Iterable[tuple[Message, int]]) -> float:
        return sum(100e6 * bits / (m.period_us * self.bitrate) for m, bits in frames)

    @property
    def sync_jitter_us(self) -> float:
        """How much the end of SYNC moves about: a frame in the way, and the stuffing of its counter."""
        least, greatest = sync_bits()
        sync = self.messages[0]
        return (self._blocking(sync) + _SCALE * (greatest - least)) / self.bitrate

    @cached_property
    def responses_us(self) -> tuple[float | None, ...]:
        """The worst-case response time of each message; None: no bound, the bus is full."""
        return tuple(
            None if found is None else found / self.bitrate
            for found in map(self._response, self.messages)
        )

    @property
    def tick_us(self) -> float:
        """From the request of SYNC until the last frame is through that the next SYNC needs."""
        return max(
            found
            for message, found in zip(self.messages, self.responses_us, strict=True)
            if message.kind in NEEDED and found is not None
        )

    @property
    def fits(self) -> bool:
        """Setpoints and positions of a tick are through before the next, and all frames find time."""
        return self.tick_us <= self.period_us and self.load_percent < 100

    # Below: integers in units of 1 us / bitrate, so that bits and microseconds are both whole.

    def _length(self, message: Message) -> int:
        return message.worst_bits * _SCALE

    def _blocking(self, message: Message) -> int:
        behind = [m for m in self.messages if m.identifier > message.identifier]
        return max(self._length(m) for m in (*behind, SDO))

    @property
    def _sync_end(self) -> int:
        sync = self.messages[0]
        return self._blocking(sync) + self._length(sync)

    def _released(self, message: Message) -> int:
        """When a setpoint can be on the bus but for those that win: after SYNC, or later, after any frame."""
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


def _least_bits(message: Message) -> int:
    return 0 if message.kind in SPORADIC else message.plain_bits
