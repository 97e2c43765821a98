# SPDX-License-Identifier: MIT
"""Looks at every frame of a machine's bus as a strict observer: nothing may be there that should not.

Known identifiers with the length that the machine's DBC gives them; SYNC counters in order; each PDO of SYNC type
once a SYNC while its drive is operational, and none of a drive that is not; setpoints within the feed limit; legal
statuswords and transitions of CiA 402; heartbeats in time and with the state that NMT commanded; no EMCY, no SDO
abort, no boot-up that was not asked for.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import cantools
import numpy as np
from numpy.typing import NDArray

from bus_streams import Stream
from bus_tap import Stretch
from hodograph.bus.listening.frame_batch import Frames
from hodograph.config import Machine
from hodograph.dbc import dbc_text

_NMT, _SYNC, _EMCY, _TPDO1, _RPDO1, _TPDO2, _TPDO3 = 0x000, 0x080, 0x080, 0x180, 0x200, 0x280, 0x380
_SDO_ANSWER, _SDO_ASK, _HEARTBEAT = 0x580, 0x600, 0x700
_SDO_BYTES, _SDO_ABORT = 8, 0x80
_OVERFLOW = 240
_START, _STOP, _PRE_OPERATIONAL, _RESET, _RESET_COMMUNICATION = 1, 2, 128, 129, 130
_BOOT_UP, _STOPPED, _OPERATIONAL, _PRE = 0, 4, 5, 127
_AFTER = {
    _START: _OPERATIONAL,
    _STOP: _STOPPED,
    _PRE_OPERATIONAL: _PRE,
    _RESET: _PRE,
    _RESET_COMMUNICATION: _PRE,
}
_HEARTBEAT_LATEST_S = 0.25
_FOLLOWING_ERROR, _WARNING = 0x2000, 0x0080
_NAMES = {
    0x40: "switch on disabled",
    0x21: "ready to switch on",
    0x23: "switched on",
    0x27: "operation enabled",
    0x07: "quick stop active",
}
"""Statusword bits 0 to 3, 5 and 6 of the states of a machine without faults."""
_FROM_TO = {
    (0x40, 0x21),
    (0x21, 0x40),
    (0x21, 0x23),
    (0x23, 0x21),
    (0x23, 0x40),
    (0x23, 0x27),
    (0x27, 0x23),
    (0x27, 0x21),
    (0x27, 0x40),
}
_MAY_REFUSE = {
    (0x1005, 0x06010002),  # the COB-ID of SYNC is fixed
    (0x100C, 0x06020000),  # no node guarding
    (0x100D, 0x06020000),
}
"""What a simulated drive has not, and the controller asks every drive for at its configuration."""
_KEPT_FINDINGS = 50
_SAMPLE = 499
"""cantools itself decodes each frame whose number this divides; the rest is decoded by numpy."""


@dataclass
class Drive:
    """What is known of one drive."""

    node: int
    streams: dict[int, Stream]
    operational: bool = False
    statusword: int | None = None
    target: int | None = None


@dataclass
class BusChecker:
    """State of the observer. `findings` holds the first ones, `finding_count` says how many there were."""

    machine: Machine
    findings: list[str] = field(default_factory=list)
    finding_count: int = 0
    frames: int = 0
    syncs: int = 0
    kinds: Counter[str] = field(default_factory=Counter)
    worst_heartbeat_s: float = 0.0

    def __post_init__(self) -> None:
        loaded = cantools.database.load_string(dbc_text(self.machine), "dbc", strict=True)
        if not isinstance(loaded, cantools.database.Database):
            raise TypeError("a DBC is a database of CAN messages")
        self._database = loaded
        self._in_dbc = {message.frame_id for message in loaded.messages}
        self._lengths = {m.frame_id: m.length for m in self._database.messages}
        self._names = {m.frame_id: m.name for m in self._database.messages}
        nodes = [self.machine.node, *(axis.node for axis in self.machine.axes)]
        for node in nodes:
            for base, name in ((_SDO_ANSWER, "SDO answer"), (_SDO_ASK, "SDO request")):
                self._lengths[base + node] = _SDO_BYTES
                self._names[base + node] = f"{name} of node {node}"
        for axis in self.machine.axes:  # docs/protocol.md section 2: not in every machine
            self._lengths.setdefault(_TPDO3 + axis.node, 4)
            self._names.setdefault(_TPDO3 + axis.node, f"Drive{axis.node}_TPDO3")
        self._drives = {axis.node: self._drive(axis.node) for axis in self.machine.axes}
        self._controller_answered = False
        self._counter: int | None = None
        self._beats: dict[int, float] = {}
        self._told: dict[int, set[int]] = {}
        self._boots: Counter[int] = Counter()
        self._step = (
            int(self.machine.feed_mm_s * self.machine.counts_per_mm * self.machine.period_us / 1e6)
            + 1
        )

    def _drive(self, node: int) -> Drive:
        identifiers = [base + node for base in (_TPDO1, _RPDO1, _TPDO2, 0x300)]
        known = {i: Stream(self._names[i]) for i in identifiers if i in self._names}
        return Drive(node, known)

    def found(self, text: str) -> None:
        """Notes something that should not be."""
        self.finding_count += 1
        if len(self.findings) < _KEPT_FINDINGS:
            self.findings.append(f"after {self.syncs} SYNCs: {text}")

    @property
    def late(self) -> int:
        """Frames of a SYNC that came after the next one: no finding, but worth telling."""
        return sum(s.late for drive in self._drives.values() for s in drive.streams.values())

    def take(self, stretch: Stretch) -> None:
        """Looks at the frames that follow those of the last call."""
        frames, times_s = stretch.frames, stretch.times_s
        commands = np.flatnonzero(frames["id"] == _NMT)
        start = 0
        for end in [*commands.tolist(), frames.size]:
            self._take_part(frames[start:end], times_s[start:end])
            if end < frames.size:
                self._command(frames[end])
            start = end + 1
        for i in np.flatnonzero((np.arange(frames.size) + self.frames) % _SAMPLE == 0):
            self._decode(frames[i])
        self.frames += int(frames.size)

    def _decode(self, frame: np.void) -> None:
        identifier, length = int(frame["id"]), int(frame["length"])
        if identifier in self._in_dbc:
            try:
                self._database.decode_message(identifier, bytes(frame["data"][:length]))
            except Exception as error:
                self.found(f"cantools does not decode 0x{identifier:03X}: {error}")

    def _command(self, frame: np.void) -> None:
        command, node = (int(byte) for byte in frame["data"][:2])
        self.kinds["NMT command"] += 1
        if int(frame["length"]) != 2 or command not in _AFTER:
            self.found(f"NMT command {command} with {int(frame['length'])} bytes")
            return
        for each in [node] if node else list(self._drives):
            if each not in self._drives:
                self.found(f"NMT command {command} to node {each}, which is no drive")
                continue
            drive = self._drives[each]
            drive.operational = command == _START
            # The heartbeat that was on its way may still tell the state before.
            self._told.setdefault(each, {_PRE}).add(_AFTER[command])
            if command in (_RESET, _RESET_COMMUNICATION):
                self._boots[each] -= 1
                self._beats.pop(each, None)
                drive.statusword = None
            for stream in drive.streams.values():
                stream.restart()

    def _take_part(self, frames: Frames, times_s: NDArray[np.float64]) -> None:
        identifiers = frames["id"]
        for identifier, count in zip(*np.unique(identifiers, return_counts=True), strict=True):
            self._lengths_right(int(identifier), int(count), frames)
        sync_at = np.flatnonzero(identifiers == _SYNC)
        self._counters(frames["data"][sync_at, 0].astype(np.int64))
        for drive in self._drives.values():
            self._streams(drive, frames, sync_at)
            self._statuswords(drive, frames)
            self._setpoints(drive, frames)
        self.syncs += int(sync_at.size)
        self._emergencies(frames)
        self._aborts(frames)
        for node in (self.machine.node, *self._drives):
            self._heartbeats(node, frames, times_s)
            self._alive(node, times_s)

    def _lengths_right(self, identifier: int, count: int, frames: Frames) -> None:
        name = self._names.get(identifier)
        if name is None:
            self.found(
                f"{count} frames with the identifier 0x{identifier:X}, which nobody should send"
            )
            return
        self.kinds[name] += count
        lengths = frames["length"][frames["id"] == identifier]
        wrong = np.flatnonzero(lengths != self._lengths[identifier])
        if wrong.size:
            self.found(
                f"{name} with {int(lengths[wrong[0]])} bytes, not {self._lengths[identifier]}"
            )

    def _counters(self, counters: NDArray[np.int64]) -> None:
        if not counters.size:
            return
        if self._counter is not None:
            counters = np.concatenate([[self._counter], counters])
        self._counter = int(counters[-1])
        bad = np.flatnonzero((np.diff(counters) - 1) % _OVERFLOW)
        if bad.size:
            self.found(f"SYNC counter {int(counters[bad[0] + 1])} after {int(counters[bad[0]])}")
        if counters.min() < 1 or counters.max() > _OVERFLOW:
            self.found(f"SYNC counters from {int(counters.min())} to {int(counters.max())}")

    def _streams(self, drive: Drive, frames: Frames, sync_at: NDArray[np.intp]) -> None:
        for identifier, stream in drive.streams.items():
            at = np.flatnonzero(frames["id"] == identifier)
            sent_by_drive = identifier & 0x780 in (_TPDO1, _TPDO2)
            if drive.operational:
                for text in stream.take(self.syncs + np.searchsorted(sync_at, at)):
                    self.found(text)
            elif sent_by_drive and at.size > 1:
                self.found(f"{stream.name}: {at.size} frames while the drive is not operational")

    def _statuswords(self, drive: Drive, frames: Frames) -> None:
        words = _field(frames, _TPDO1 + drive.node, 0, "<u2").astype(np.int64)
        if not words.size:
            return
        states = words & 0x6F
        states[words & 0x4F == 0x40] = 0x40
        for state in np.unique(states):
            if int(state) not in _NAMES:
                self.found(f"node {drive.node}: statusword 0x{int(words[states == state][0]):04X}")
        flagged = np.flatnonzero(words & (_FOLLOWING_ERROR | _WARNING))
        if flagged.size:
            self.found(
                f"node {drive.node}: statusword 0x{int(words[flagged[0]]):04X}: warning or error"
            )
        before = (
            states if drive.statusword is None else np.concatenate([[drive.statusword], states])
        )
        for i in np.flatnonzero(np.diff(before)):
            if (int(before[i]), int(before[i + 1])) not in _FROM_TO:
                names = [_NAMES.get(int(state), hex(int(state))) for state in before[i : i + 2]]
                self.found(f"node {drive.node}: from {names[0]} to {names[1]}")
        drive.statusword = int(states[-1])

    def _setpoints(self, drive: Drive, frames: Frames) -> None:
        targets = _field(frames, _RPDO1 + drive.node, 2, "<i4").astype(np.int64)
        if not targets.size:
            return
        if drive.target is not None:
            targets = np.concatenate([[drive.target], targets])
        drive.target = int(targets[-1])
        steps = np.abs(np.diff(targets))
        if steps.size and steps.max() > self._step:
            self.found(f"node {drive.node}: the setpoint jumps by {int(steps.max())} counts")

    def _emergencies(self, frames: Frames) -> None:
        for node in (self.machine.node, *self._drives):
            for code in _field(frames, _EMCY + node, 0, "<u2"):
                self.found(f"EMCY 0x{int(code):04X} from node {node}")

    def _aborts(self, frames: Frames) -> None:
        answers = np.flatnonzero(frames["id"] == _SDO_ANSWER + self.machine.node)
        if not self._controller_answered:
            # A host that asks whether the controller is there yet gives up again and again.
            self._controller_answered = bool(answers.size)
            before = frames[: answers[0]] if answers.size else frames
            asked = before["id"] == _SDO_ASK + self.machine.node
            self.kinds["SDO asked in vain"] += int(
                np.count_nonzero(asked & (before["data"][:, 0] == _SDO_ABORT))
            )
            frames = np.concatenate([before[~asked], frames[before.size :]])
        sdo = np.isin(frames["id"] & 0x780, (_SDO_ANSWER, _SDO_ASK)) & (frames["id"] < _HEARTBEAT)
        for frame in frames[sdo & (frames["data"][:, 0] == _SDO_ABORT)]:
            index = int.from_bytes(bytes(frame["data"][1:3]), "little")
            code = int.from_bytes(bytes(frame["data"][4:8]), "little")
            drive = self._drives.get(int(frame["id"]) - _SDO_ANSWER)
            if drive is not None and not drive.operational and (index, code) in _MAY_REFUSE:
                self.kinds["SDO refused by a drive while it was configured"] += 1
                continue
            name = self._names.get(int(frame["id"]), "SDO")
            self.found(f"{name}: abort 0x{code:08X} of 0x{index:04X} sub {int(frame['data'][3])}")

    def _heartbeats(self, node: int, frames: Frames, times_s: NDArray[np.float64]) -> None:
        at = np.flatnonzero(frames["id"] == _HEARTBEAT + node)
        for state, time_s in zip(frames["data"][at, 0].tolist(), times_s[at].tolist(), strict=True):
            if state == _BOOT_UP:
                self._boots[node] += 1
                if self._boots[node] > 1:
                    self.found(f"node {node} booted without being told to")
                self._beats[node] = time_s
                self._told[node] = {_PRE}
                continue
            self._state(node, state)
            gap_s = time_s - self._beats.get(node, time_s)
            self._beats[node] = time_s
            self.worst_heartbeat_s = max(self.worst_heartbeat_s, gap_s)
            if gap_s > _HEARTBEAT_LATEST_S:
                self.found(f"heartbeat of node {node} after {gap_s * 1000:.0f} ms")

    def _alive(self, node: int, times_s: NDArray[np.float64]) -> None:
        silent_s = (
            float(times_s[-1]) - self._beats[node] if times_s.size and node in self._beats else 0.0
        )
        if silent_s > _HEARTBEAT_LATEST_S:
            self.found(f"no heartbeat of node {node} for {silent_s * 1000:.0f} ms")

    def _state(self, node: int, state: int) -> None:
        if node == self.machine.node:
            allowed = {_PRE, _OPERATIONAL}
        else:
            allowed = self._told.get(node, {_PRE})
        if state not in allowed:
            self.found(f"heartbeat of node {node} with state {state}")
        elif state == _OPERATIONAL and node in self._drives and self._drives[node].operational:
            self._told[node] = {_OPERATIONAL}


def _field(frames: Frames, identifier: int, offset: int, kind: str) -> NDArray[np.generic]:
    data = frames["data"][frames["id"] == identifier]
    size = np.dtype(kind).itemsize
    return np.ascontiguousarray(data[:, offset : offset + size]).view(kind)[:, 0]
