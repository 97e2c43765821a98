# SPDX-License-Identifier: MIT
"""Checks each frame of a machine's bus for unexpected frames and content. Used by soak.py and tests/. Reads the EDS of
the drives, for the DBC; no other I/O.

Known identifiers with the length that the machine's DBC gives them; SYNC counters in order; each PDO of SYNC type
once a SYNC while its drive is operational, and none of a drive that is not; setpoints within the feed limit; legal
statuswords and transitions of CiA 402; heartbeats in time and with the state that NMT commanded; no EMCY, no SDO
abort, no boot-up that was not requested.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

import cantools
import numpy as np
from numpy.typing import NDArray

from bus_drives import Drive, field_of
from heartbeat_check import AFTER, RESET, RESET_COMMUNICATION, START, Beats
from hodograph.bus.capture.frame_batch import Frames
from hodograph.bus.sdo.node import NOWHERE
from hodograph.config import Machine
from hodograph.dbc import dbc_text
from pdo_sequence_check import Stream

_NMT, _SYNC, _EMCY, _TPDO1, _RPDO1, _TPDO2, _TPDO3 = 0x000, 0x080, 0x080, 0x180, 0x200, 0x280, 0x380
_SDO_ANSWER, _SDO_ASK, _HEARTBEAT = 0x580, 0x600, 0x700
_SDO_BYTES, _SDO_ABORT = 8, 0x80
_OVERFLOW = 240
"""Last value of the counter in SYNC."""
_MAY_REFUSE = {
    (0x1005, 0x06010002),  # the COB-ID of SYNC is fixed
    (0x100C, 0x06020000),  # no node guarding
    (0x100D, 0x06020000),
}
"""Objects that the controller reads from each drive at its configuration, and that a simulated drive lacks."""
_NOT_YET = {(0x2001, 0x08000022), (0x2056, 0x08000022)}
"""A start, also one by name, while the axes settle; a refusal that the host does not expect ends its run."""
_NO_OBJECT = 0x06020000
"""Abort code: the object does not exist."""
_KEPT_FINDINGS = 50
"""Findings that are kept for the report."""
_SAMPLE = 499
"""cantools itself decodes each frame whose number this divides; the rest is decoded by numpy."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Frames in the order of the bus, and the time of each in seconds."""

    frames: Frames
    times_s: NDArray[np.float64]


@dataclass
class BusChecker:
    """State of the observer. `findings` holds the first ones, `finding_count` says how many there were."""

    machine: Machine
    findings: list[str] = field(default_factory=list)
    finding_count: int = 0
    frames: int = 0
    syncs: int = 0
    kinds: Counter[str] = field(default_factory=Counter)

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
        for axis in self.machine.axes:  # docs/reference/protocol.md section 2: not in every machine
            self._lengths.setdefault(_TPDO3 + axis.node, 4)
            self._names.setdefault(_TPDO3 + axis.node, f"Drive{axis.node}_TPDO3")
        self._drives = {axis.node: self._drive(axis.node) for axis in self.machine.axes}
        self._controller_answered = False
        self._counter: int | None = None
        self._beats = Beats(self.machine.node, self._drives)
        self._step = (
            int(self.machine.feed_mm_s * self.machine.counts_per_mm * self.machine.period_us / 1e6)
            + 1
        )

    def _drive(self, node: int) -> Drive:
        identifiers = [base + node for base in (_TPDO1, _RPDO1, _TPDO2, 0x300)]
        known = {i: Stream(self._names[i]) for i in identifiers if i in self._names}
        return Drive(node, known)

    def found(self, text: str) -> None:
        """Notes a finding."""
        self.finding_count += 1
        if len(self.findings) < _KEPT_FINDINGS:
            self.findings.append(f"after {self.syncs} SYNCs: {text}")

    def _found_all(self, texts: Iterable[str]) -> None:
        for text in texts:
            self.found(text)

    @property
    def late(self) -> int:
        """Number of frames of a SYNC that came after the next one: no finding, but reported."""
        return sum(s.late for drive in self._drives.values() for s in drive.streams.values())

    @property
    def worst_heartbeat_s(self) -> float:
        """The longest time between two heartbeats of a node."""
        return self._beats.worst_s

    def take(self, frames: Frames) -> None:
        """Checks the frames that follow those of the last call (`RECORD_DTYPE`), by their time stamps."""
        times_s = frames["time_us"] / 1e6
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
        if int(frame["length"]) != 2 or command not in AFTER:
            self.found(f"NMT command {command} with {int(frame['length'])} bytes")
            return
        for each in [node] if node else list(self._drives):
            if each not in self._drives:
                self.found(f"NMT command {command} to node {each}, which is no drive")
                continue
            drive = self._drives[each]
            drive.operational = command == START
            self._beats.commanded(each, command)
            if command in (RESET, RESET_COMMUNICATION):
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
            self._found_all(drive.statuswords(frames))
            self._found_all(drive.setpoints(frames, self._step))
        self.syncs += int(sync_at.size)
        self._emergencies(frames)
        self._aborts(frames)
        operational = [node for node, drive in self._drives.items() if drive.operational]
        self._found_all(self._beats.take(frames, times_s, operational))

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

    def _emergencies(self, frames: Frames) -> None:
        for node in (self.machine.node, *self._drives):
            for code in field_of(frames, _EMCY + node, 0, "<u2"):
                self.found(f"EMCY 0x{int(code):04X} from node {node}")

    def _aborts(self, frames: Frames) -> None:
        answers = np.flatnonzero(frames["id"] == _SDO_ANSWER + self.machine.node)
        if not self._controller_answered:
            # A host that waits for the controller sends requests that time out.
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
            if frame["id"] == _SDO_ANSWER + self.machine.node:
                if (index, code) in _NOT_YET:
                    self.kinds["command refused for now: the host asks again"] += 1
                    continue
                if index & 0xF000 == NOWHERE and code == _NO_OBJECT:
                    self.kinds["SDO channel handed over to another process"] += 1
                    continue
            name = self._names.get(int(frame["id"]), "SDO")
            self.found(f"{name}: abort 0x{code:08X} of 0x{index:04X} sub {int(frame['data'][3])}")
