# SPDX-License-Identifier: MIT
"""The thread that makes messages of frames, about 25 times a second at any bus load.

The content of messages depends on the time stamps of the frames only; the clock of this computer only paces them.

Used by link, session and cli/monitor_command. Takes frames from its source and gives messages to functions of the
caller. Starts a thread, which reads the bus.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..bus.capture.decode import SYNC_ID
from ..bus.capture.load import LoadCapture
from ..bus.capture.setpoint_check import StepLimits
from ..bus.capture.setpoint_watch import SetpointWatch, jumps
from ..bus.diagnostics.texts import drive_state
from ..config.outputs import Outputs
from ..errors import BusError, InputError
from ..stream.bus_chunks import ChunkCapture, JobPoints
from .decoder import Decoder, Samples
from .derived import Derivation, FollowedPath, ProgramPath
from .emergencies import Emergencies
from .job_path import JobPath
from .messages import job_message, path_message, rows_message
from .output_marks import JobMarks, PassedMarks, drawn_marks, output_marks
from .source import Source, Taken

LOOK_S = 0.04
"""Period in which received frames are processed, in real time."""
_STATE_S = 0.25
"""Least time between two messages of states, in real time."""
_RETRY_S = 1.0
"""Time between two attempts to open the bus."""
_SILENCE_US = 1_000_000
"""Without SYNC for this time, by the time stamps of the bus, the last answers of the drives are not shown any more."""

Publish = Callable[[dict[str, Any]], None]


@dataclass(frozen=True)
class Layout:
    """The machine data that are needed to decode its frames."""

    names: tuple[str, ...]
    nodes: tuple[int, ...]
    counts_per_unit: tuple[int, ...]
    """Counts of a mm, or of a degree of a rotary axis."""
    units: tuple[str, ...]
    drawn: int
    """Number of axes that draw a path: 2 in the plane, 3 in space."""
    period_us: int
    bitrate: int
    limits: StepLimits | None = None
    """Limits of setpoint steps; None: not known."""
    path_axes: int = 2
    """Number of axes that follow a path."""
    controller: int = 1
    """Node of the controller."""
    outputs: Outputs | None = None
    """Outputs of the machine, for the names in marks; None: not known."""


@dataclass
class PumpLoad:
    """Load of the pump itself in the last second, for the last line of the page."""

    frames: int = 0
    dropped: int = 0
    busy_s: float = 0.0
    since_s: float = field(default_factory=time.monotonic)


class Pump:
    """Owns the source; `open_source` is called again after each end of the bus."""

    def __init__(self, open_source: Callable[[], Source], layout: Layout, publish: Publish) -> None:
        self._open_source = open_source
        self._layout = layout
        self._publish = publish
        self._path: ProgramPath | None = None
        self._job_path = JobPath(layout.counts_per_unit[0])
        self._passed = PassedMarks()
        self._streams = False
        self._ending = threading.Event()
        self._again = threading.Event()
        self._own_load = PumpLoad()
        self._emergencies = Emergencies()
        self._load = LoadCapture(layout.bitrate)
        self._watch = SetpointWatch(layout.nodes)
        self._decoder = Decoder(layout.nodes)
        self._derivation = self._fresh_derivation()
        self._chunks, self._job = ChunkCapture(layout.controller), JobPoints()
        self._job_marks = JobMarks(layout.outputs)
        self._state_due_s = 0.0
        self._newest: tuple[int, float] | None = None
        """Number of the last SYNC, and when it was decoded."""
        self._sync_us: int | None = None
        """Time stamp of the last SYNC; None: none has come, or its answers are not shown any more."""
        self._thread = threading.Thread(target=self._work, name="monitor-pump", daemon=True)

    def start(self) -> None:
        """Begins to capture the bus."""
        self._thread.start()

    def close(self) -> None:
        """Ends the thread and closes the bus."""
        self._ending.set()
        if self._thread.is_alive():
            self._thread.join()

    @property
    def alive(self) -> bool:
        """Whether the thread works; it ends by `close` alone."""
        return self._thread.is_alive()

    def restart(self) -> None:
        """Opens the source again: a recording restarts."""
        self._again.set()

    def show(self, image: bytes | None, note: str = "") -> None:
        """Sets the program whose curve is used from now on; None: there is none."""
        path = None
        if image is not None:
            try:
                path = ProgramPath(image, self._layout.counts_per_unit[0])
            except InputError as error:
                note = str(error)
        self._path = path
        marks = () if path is None else output_marks(self._layout.outputs, path.events)
        self._passed = PassedMarks(marks)
        if path is not None:
            self._streams = False
        self._publish(path_message(path, note, drawn_marks(marks, path) if path else ()))

    def _fresh_derivation(self) -> Derivation:
        layout = self._layout
        return Derivation(layout.counts_per_unit, layout.drawn, layout.period_us)

    def _work(self) -> None:
        while not self._ending.is_set():
            try:
                source = self._open_source()
            except BusError as error:
                self._bus_lost(str(error))
                self._ending.wait(_RETRY_S)
                continue
            self._publish({"type": "bus", "there": True, "note": ""})
            self._emergencies = Emergencies()
            self._load = LoadCapture(self._layout.bitrate)
            self._watch = SetpointWatch(self._layout.nodes)
            self._decoder = Decoder(self._layout.nodes, self._first_sync())
            self._derivation = self._fresh_derivation()
            self._passed = self._passed.anew()
            try:
                self._look_on(source)
            except BusError as error:
                self._bus_lost(str(error))
            finally:
                with suppress(OSError):
                    source.close()

    def _first_sync(self) -> int:
        """Number of the first SYNC of a source: after a bus that was lost the time of the plots goes on."""
        if self._newest is None:
            return 0
        sync, at_s = self._newest
        return sync + 1 + round(1e6 * (time.monotonic() - at_s) / self._layout.period_us)

    def _bus_lost(self, note: str) -> None:
        self._publish({"type": "bus", "there": False, "note": note})
        self._show_silence()

    def _look_on(self, source: Source) -> None:
        due_s = time.monotonic()
        while not self._ending.is_set():
            begun_s = time.thread_time()
            taken = source.take()
            # before the rows: the motion of a chunk may be in the same frames
            self._draw_chunks(taken)
            if taken.frames.size:
                self._pass_on(taken)
            self._notice_silence(taken)
            for event in self._emergencies.feed(taken.frames, taken.now_us):
                self._publish(event)
            self._own_load.busy_s += time.thread_time() - begun_s
            self._publish_load(taken)
            if self._again.is_set():
                self._again.clear()
                self._newest = None
                self._publish({"type": "restart"})
                return
            due_s = max(due_s + LOOK_S, time.monotonic())
            self._ending.wait(due_s - time.monotonic())

    def _pass_on(self, taken: Taken) -> None:
        self._own_load.frames += taken.frames.size
        newest_us = int(taken.frames["time_us"][-1])
        self._load.feed(taken.frames, newest_us / 1e6)
        self._check_setpoints(taken)
        samples = self._decoder.feed(taken.frames)
        if samples.count:
            self._newest = int(samples.sync[-1]), time.monotonic()
        rows = self._derivation.feed(samples, self._followed())
        if rows.count:
            age_ms = None if taken.now_us is None else (taken.now_us - newest_us) / 1000
            self._publish(
                rows_message(
                    rows,
                    self._layout.period_us / 1e6,
                    age_ms,
                    self._layout.drawn,
                    self._layout.path_axes,
                    self._passed.feed(rows.t_s, rows.arc_mm),
                    None if self._path is None else self._path.crc32,
                )
            )
        if samples.count and (taken.ended or time.monotonic() >= self._state_due_s):
            self._state_due_s = time.monotonic() + _STATE_S
            self._publish(self._drives(samples))

    def _notice_silence(self, taken: Taken) -> None:
        """Shows the drives as silent when no SYNC comes any more: their last answers say nothing of the present."""
        frames, now_us = taken.frames, taken.now_us
        syncs_us = frames["time_us"][frames["id"] == SYNC_ID]
        if syncs_us.size:
            self._sync_us = int(syncs_us[-1])
        if now_us is None and frames.size:
            now_us = int(frames["time_us"][-1])
        if self._sync_us is None or now_us is None:
            return
        if now_us - self._sync_us > _SILENCE_US:
            self._show_silence()

    def _show_silence(self) -> None:
        if self._sync_us is None:
            return
        self._sync_us = None
        self._state_due_s = 0.0
        layout = self._layout
        drives = [
            {"name": name, "node": node, "state": "silent", "statusword": -1, "actual_mm": None}
            for name, node in zip(layout.names, layout.nodes, strict=True)
        ]
        self._publish(
            {"type": "drives", "drives": drives, "load_percent": None, "arc_length_mm": None}
        )

    def _draw_chunks(self, taken: Taken) -> None:
        """Extends the path of a streamed job with the chunks that pass on the bus."""
        chunks = self._chunks.feed(taken.frames)
        for chunk in chunks:
            self._job.add(chunk)
            self._job_path.add(chunk)
            self._job_marks.add(chunk)
        if chunks:
            self._path, self._streams = None, True
            self._passed = self._passed.with_marks(self._job_marks.marks)
            points_mm = self._job.points_mm[:, : self._layout.drawn]
            self._publish(job_message(self._job.job, points_mm, self._job_marks.drawn))

    def _followed(self) -> FollowedPath | None:
        """The path of the program, or of the job, whichever came last."""
        return self._job_path if self._streams else self._path

    def _check_setpoints(self, taken: Taken) -> None:
        """Publishes the worst setpoint step by each rule every 500 SYNCs, if it breaks its limit."""
        if self._layout.limits is None:
            return
        steps = self._watch.feed(taken.frames)
        if taken.ended:
            steps += self._watch.close()
        for jump in jumps(steps, self._layout.limits):
            self._publish({"type": "event", "text": str(jump), "fault": True})

    def _drives(self, samples: Samples) -> dict[str, Any]:
        """Publishes positions and states of the drives, and the bus load."""
        layout = self._layout
        drives = []
        for axis, (name, node) in enumerate(zip(layout.names, layout.nodes, strict=True)):
            word = int(samples.statuswords[-1, axis])
            actual = samples.actual[-1, axis] / layout.counts_per_unit[axis]
            drives.append(
                {
                    "name": name,
                    "node": node,
                    "state": "silent" if word < 0 else drive_state(word),
                    "statusword": word,
                    "actual_mm": round(actual, 6) if np.isfinite(actual) else None,
                }
            )
        path, load = self._path, self._load.measure()
        return {
            "type": "drives",
            "drives": drives,
            "load_percent": None if load is None else round(load.percent, 1),
            "arc_length_mm": None if path is None else path.arc_length_mm,
        }

    def _publish_load(self, taken: Taken) -> None:
        """Publishes the load of the pump, every second."""
        own, now_s = self._own_load, time.monotonic()
        self._own_load.dropped = taken.dropped
        if now_s - own.since_s < 1.0:
            return
        passed_s = now_s - own.since_s
        self._publish(
            {
                "type": "pump",
                "frames_per_s": round(own.frames / passed_s),
                "busy_percent": round(100 * own.busy_s / passed_s, 1),
                "dropped": own.dropped,
                "ended": taken.ended,
            }
        )
        self._own_load = PumpLoad(dropped=own.dropped)
