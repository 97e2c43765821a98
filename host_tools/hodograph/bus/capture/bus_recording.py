# SPDX-License-Identifier: MIT
"""A recording of any length: frames go to a file as they come, with the setpoint step check. Used by
cli/record_command, cli/stream_command and stream/sender. Receives frames, and writes the file.
"""

from __future__ import annotations

from pathlib import Path

from ..address import BusAddress
from .decode import unhomed_starts
from .frames import Frames
from .recorder import Recorder
from .recordings import RecordingWriter
from .setpoint_check import Step
from .setpoint_watch import SetpointWatch


class BusRecording:
    """A recording in progress; keeps the worst setpoint step by each rule. Call `keep` regularly.

    unhomed_starts  number of starts that were allowed without homing
    """

    def __init__(self, address: BusAddress, file: Path, nodes: tuple[int, ...] | None) -> None:
        """`nodes`: drives whose setpoints are checked; None: all that get setpoints. Raises BusError, InputError."""
        self.file = file
        self.unhomed_starts = 0
        self._closed = False
        self._watch = SetpointWatch(nodes)
        self._worst: dict[tuple[str, tuple[int, ...], tuple[int, ...]], Step] = {}
        self._writer = RecordingWriter(file, address.name)
        try:
            self._recorder = Recorder(address)
        except BaseException:
            self._writer.close()
            raise

    def keep(self) -> None:
        """Writes the frames received since the last call."""
        self._take(self._recorder.take())

    def close(self) -> None:
        """Ends the recording; the file is then complete. May be called again."""
        if self._closed:
            return
        self._closed = True
        self._recorder.stop()
        try:
            self._take(self._recorder.take())
            self._check_steps(self._watch.close())
        finally:
            self._writer.close()

    def _take(self, frames: Frames) -> None:
        self.unhomed_starts += unhomed_starts(frames)
        self._writer.write(frames)
        self._check_steps(self._watch.feed(frames))

    def _check_steps(self, steps: list[Step]) -> None:
        for step in steps:
            kind = step.rule, step.axes, step.group
            known = self._worst.get(kind)
            if known is None or known.needed < step.needed:
                self._worst[kind] = step

    @property
    def frame_count(self) -> int:
        """Frames recorded so far."""
        return self._recorder.frame_count

    @property
    def dropped(self) -> int:
        """Frames that are missing, since the kernel dropped them."""
        return self._recorder.dropped

    @property
    def nodes(self) -> tuple[int, ...]:
        """Nodes that got setpoints."""
        return self._watch.seen

    @property
    def steps(self) -> list[Step]:
        """The worst steps, in their order."""
        return sorted(self._worst.values(), key=lambda step: step.sync)

    def dropped_text(self) -> str:
        """A message about missing frames; empty: none are missing."""
        if not self.dropped:
            return ""
        return (
            f"{self.file}: {self.dropped} frames are missing, which the kernel dropped: record as root if you can "
            "(larger receive buffer)"
        )
