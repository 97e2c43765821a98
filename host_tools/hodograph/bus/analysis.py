# SPDX-License-Identifier: MIT
"""Motion and bus load from the frames of a run. Used by bus/run, cli/replay_command and identify/stretches. Reads the
EDS of the drives, for the bus load; no other I/O.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..bustime import RecordedLoad, machine_bus_time, recorded_load
from ..config import Machine
from ..errors import RunError
from ..native import NativeProgram
from ..simulate import Motion, analyse, settling_ticks
from .capture.decode import RPDO1, SYNC_ID, Ticks, decode_outputs, decode_ticks, unhomed_starts
from .capture.frames import Frames
from .capture.setpoint_check import require_no_jump, step_limits

REACHED_AFTER = 2
"""Setpoint k is reached at SYNC k+2 (docs/reference/protocol.md section 2)."""

_AROUND = 220
"""SYNCs kept before and after a run: late answers come within 200."""


@dataclass(frozen=True, eq=False)
class BusRun:
    """A recorded run: its motion and figures of the bus. `frames`: number of recorded frames.

    `bus` is the name of the file if it was read from one; then the deadline misses are not known. `wall_s` is by the
    clock of the bus. `unhomed_starts`: number of starts in the recording that were allowed without homing.
    """

    motion: Motion
    bus: str
    deadline_misses: int | None
    pace: str
    frames: int
    wall_s: float
    load: RecordedLoad
    unhomed_starts: int

    def summary(self) -> dict[str, object]:
        """The keys that tools may rely on in `hodograph run --json` and `hodograph replay --json`."""
        return self.motion.summary() | {
            "bus": self.bus,
            "deadline_misses": self.deadline_misses,
            "pace": self.pace,
            "frames": self.frames,
            "bus_load": self.load.summary(),
            "unhomed_starts": self.unhomed_starts,
        }


def analyse_recording(
    frames: Frames, image: bytes, machine: Machine, kernel: str
) -> tuple[Motion, RecordedLoad]:
    """The motion of a program's run at 100 %, and the bus load of the whole recording.

    Raises RunError when the recording is incomplete, a setpoint jumps, or the setpoints are not those that the same
    kernel gives here.
    """
    program = NativeProgram(image)
    _, setpoints = program.setpoints(kernel, machine.path_counts)
    require_no_jump(frames, machine.nodes, step_limits(machine, setpoints))
    ticks = decode_ticks(frames, machine.nodes)
    outputs = None if machine.outputs is None else decode_outputs(frames, machine.outputs)
    motion = _motion(image, program, ticks, setpoints, machine, kernel, outputs)
    return motion, recorded_load(frames, machine_bus_time(machine))


def replay(frames: Frames, name: str, image: bytes, machine: Machine, kernel: str) -> BusRun:
    """The run in a recording, with the same results as when it was recorded. `name`: of the recording.

    Frames of other phases (boot, move to the start, other runs) are left out. Raises RunError.
    """
    try:
        motion, load = analyse_recording(frames, image, machine, kernel)
    except RunError:
        stretch = _stretch(frames, image, machine, kernel)
        if stretch is None:
            raise
        motion, load = analyse_recording(stretch, image, machine, kernel)
    wall_s = _run_s(frames, motion)
    return BusRun(
        motion=motion,
        bus=name,
        deadline_misses=None,
        pace=measured_pace(motion, wall_s),
        frames=int(frames.size),
        wall_s=wall_s,
        load=load,
        unhomed_starts=unhomed_starts(frames, machine.node),
    )


def _stretch(frames: Frames, image: bytes, machine: Machine, kernel: str) -> Frames | None:
    """The frames around the program's run; None: its setpoints are not there in sequence."""
    program = NativeProgram(image)
    _, setpoints = program.setpoints(kernel, machine.path_counts)
    sync_at = np.flatnonzero(frames["id"] == SYNC_ID)
    whole = [complete_ticks(frames, sync_at, RPDO1 + node) for node in machine.nodes]
    for begin, end in runs_of(np.logical_and.reduce(whole)):
        rows = np.stack(
            [_targets(frames, sync_at[begin : end + 1], RPDO1 + n) for n in machine.nodes], axis=1
        )
        first = program_tick(rows[_columns(machine, setpoints)], setpoints)
        if first is not None:
            last = first + program.ticks + settling_ticks(machine.period_us) + REACHED_AFTER
            start = sync_at[max(begin, begin + first - _AROUND)]
            stop = sync_at[min(end, begin + last + _AROUND)]
            return np.asarray(frames[start:stop])
    return None


def complete_ticks(frames: Frames, sync_at: NDArray[np.intp], identifier: int) -> NDArray[np.bool_]:
    """For each SYNC but the last: whether just one frame with this identifier follows before the next SYNC."""
    at = np.flatnonzero(frames["id"] == identifier)
    interval = np.searchsorted(sync_at, at) - 1
    counts = np.bincount(interval[interval >= 0], minlength=sync_at.size)
    return np.asarray(counts[: max(0, sync_at.size - 1)] == 1)


def runs_of(flags: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Ranges (first, after the last) of consecutive flags that are set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], flags.astype(np.int8), [0]])))
    return [(int(a), int(b)) for a, b in edges.reshape(-1, 2)]


def _targets(frames: Frames, sync_at: NDArray[np.intp], identifier: int) -> NDArray[np.int32]:
    part = frames[sync_at[0] : sync_at[-1]]
    data = part["data"][part["id"] == identifier]
    return np.ascontiguousarray(data[:, 2:6]).view("<i4")[:, 0]


def _run_s(frames: Frames, motion: Motion) -> float:
    """Duration of the program by the frames' times, if all of its periods were like the average of the recording."""
    times_us = frames["time_us"][frames["id"] == SYNC_ID]
    whole_us = int(times_us[-1]) - int(times_us[0])
    return motion.ticks * whole_us / (1e6 * (int(times_us.size) - 1))


def measured_pace(motion: Motion, wall_s: float) -> str:
    """The pace that follows from a run's duration, for a controller that was there already."""
    nominal_s = motion.ticks * motion.period_us / 1e6
    return "real-time" if wall_s > 0.9 * nominal_s else "fast"


def _motion(
    image: bytes,
    program: NativeProgram,
    ticks: Ticks,
    setpoints: NDArray[np.int32],
    machine: Machine,
    kernel: str,
    outputs: NDArray[np.void] | None,
) -> Motion:
    if ticks.volts_mv is None:
        volts_mv = np.zeros(ticks.targets.shape, dtype=np.int16)
    else:
        volts_mv = ticks.volts_mv
    path = _columns(machine, setpoints)
    found = program_tick(ticks.targets[path], setpoints)
    first = first_tick(ticks.targets[path], setpoints) if found is None else found
    count = program.ticks + settling_ticks(machine.period_us)
    reached = slice(first + REACHED_AFTER, first + REACHED_AFTER + count)
    latched = None if outputs is None else outputs[reached]
    motion = analyse(
        image,
        ticks.targets[path][first : first + count],
        ticks.actual[path][reached],
        volts_mv[path][reached],
        kernel=kernel,
        counts_per_mm=machine.path_counts,
        names=machine.path_names,
        units=machine.path_units,
        outputs=machine.outputs,
        latched=latched,
    )
    return motion if ticks.volts_mv is not None else replace(motion, max_volts=None)


def _columns(machine: Machine, setpoints: NDArray[np.int32]) -> tuple[slice, slice]:
    """The columns of the axes that a program moves, from rows of all axes of a machine."""
    first = machine.first_axis
    return np.s_[:, first : first + setpoints.shape[1]]


def program_tick(targets: NDArray[np.int32], setpoints: NDArray[np.int32]) -> int | None:
    """The row of `targets` where the whole program begins, also if other programs run before and after it; None: there
    is none.
    """
    lead = int(np.argmax(np.any(setpoints != setpoints[0], axis=1)))
    moved = np.any(np.diff(targets, axis=0) != 0, axis=1)
    begins = np.flatnonzero(moved & ~np.concatenate([[False], moved[:-1]])) + 1 - lead
    for first in begins[begins >= 0].tolist():
        rows = targets[first : first + len(setpoints)]
        if len(rows) == len(setpoints) and np.array_equal(rows, setpoints):
            return int(first)
    return None


def first_tick(targets: NDArray[np.int32], setpoints: NDArray[np.int32]) -> int:
    """The row of `targets` that is tick 0 of `setpoints`.

    Before a program the target stands still, and its first ticks may round to the same counts: the first
    change on the bus is therefore matched with the first change in the program. Raises RunError when nothing
    moves.
    """
    moves = np.flatnonzero(np.any(targets != targets[0], axis=1))
    if not moves.size:
        raise RunError("recording: the setpoints never move: was the program started?")
    first_move = int(moves[0])
    if np.any(targets[0] != setpoints[0]):
        return first_move
    return max(0, first_move - int(np.argmax(np.any(setpoints != setpoints[0], axis=1))))
