# SPDX-License-Identifier: MIT
"""The controller's state, gathered over SDO into one typed snapshot. Used by api/bus, bus/status_text, cli/ and
monitor/link. Reads objects, and writes none.

`Status.json()` has the keys that tools may rely on (docs/reference/cli.md). A snapshot of two axes needs about 60 short
SDO transfers, a few milliseconds on an idle machine. Values that belong together are read under one channel lock.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from ...fixed_point import MM_PER_Q40
from ..diagnostics.boot_texts import BootTrouble
from ..diagnostics.drive_states import inputs_on, state_of_number
from ..diagnostics.texts import (
    CONFIGURED,
    REFUSALS,
    STATES,
    STORED,
    TIMINGS,
    detail_text,
    fault_words,
)
from .configuration import configured_counts
from .controller import Controller
from .objects import (
    ACTUAL,
    AXIS_NODE,
    BOOT,
    CONFIGURATION,
    CONFIGURATION_STATE,
    DIGITAL_INPUTS,
    DRIVE_ERROR,
    DRIVE_STATE,
    FAULT,
    FOLLOWING_ERROR,
    HOMED,
    HOMING_METHOD,
    MISSED_TPDOS,
    MOTION,
    OVERRIDE,
    STATUSWORD,
    STREAM,
    TARGET,
    TIMING,
    UNHOMED_START,
)
from .stream_channel import NONE, StreamStatus, stream_status
from .upload import program_fault_text

_Q32 = 2.0**-32
_Q30 = 2.0**-30


@dataclass(frozen=True)
class Fault:
    """What stopped the machine; node 0 is the controller itself."""

    code: int
    text: str
    remedy: str
    node: int
    detail: int
    detail_text: str


@dataclass(frozen=True)
class LongestStop:
    """The longest stop of a kind: from the command to rest, and where it begins. As in `hodograph inspect`."""

    time_s: float
    distance_mm: float
    at_mm: float
    piece: int


@dataclass(frozen=True)
class LongestStops:
    """Of feed hold and stop, and of fault stops."""

    hold: LongestStop
    fault: LongestStop


@dataclass(frozen=True)
class LoadedProgram:
    """The active program; numbers are 0 without one. `refused`: why the last upload, or after power-on the
    newest stored program, was refused; None: it was not.
    """

    state: str
    refused: str | None
    refused_code: int
    refused_index: int
    crc32: int
    size: int
    segments: int
    pieces: int
    ticks: int
    duration_s: float
    length_mm: float
    start_x_counts: int
    start_y_counts: int
    end_x_counts: int
    end_y_counts: int
    stops: LongestStops


@dataclass(frozen=True)
class Configured:
    """The controller's configuration and its origin; CRC-32s as in docs/reference/protocol.md section 3.4.

    `state` and `stored` are words of CONFIGURED and STORED. `program_crc32`: the configuration under which the loaded
    program was checked last; if it differs from `crc32`, the program is checked again before it starts.
    """

    state: str
    crc32: int
    stored: str
    stored_crc32: int
    program_crc32: int


@dataclass(frozen=True)
class PathPosition:
    """Place of the setpoint on the path."""

    arc_length_mm: float
    feed_mm_s: float
    time_s: float


@dataclass(frozen=True)
class Override:
    """Commanded override; override now; whether it is saturated."""

    wanted_percent: int
    actual_percent: float
    saturated: bool


@dataclass(frozen=True)
class AxisStatus:
    """One drive, as the controller sees it. The following error is the drive's own (0x60F4).

    For a rotary axis mm and um are degrees and thousandths of a degree.
    """

    node: int
    state: str
    statusword: int
    actual_mm: float
    target_mm: float
    following_error_um: float
    missed_tpdos: int
    digital_inputs: int
    inputs_on: tuple[str, ...]
    homed: bool
    homing_method: int
    error_code: int
    error: str | None
    remedy: str | None


@dataclass(frozen=True)
class Statistics:
    """Object 0x2008: SYNCs since power-on; the other values are of the present or last run."""

    syncs: int
    tick: int
    deadline_misses: int
    worst_lateness_us: int
    worst_tick_ns: int
    missed_tpdos: int
    frames_not_sent: int


@dataclass(frozen=True)
class Status:
    """Everything that the controller reports, at about one instant. `timing` is one of TIMINGS.

    `stream`: the job in chunks; None: there is none.
    `unhomed_nodes`: drives that should have been homed, and were not, when the present or last program was started.
    """

    bus: str
    node: int
    state: str
    fault: Fault | None
    boot_trouble: BootTrouble | None
    last_refusal: str | None
    configuration: Configured
    program: LoadedProgram
    motion: PathPosition
    override: Override
    unhomed_nodes: tuple[int, ...]
    axes: tuple[AxisStatus, ...]
    timing: str
    statistics: Statistics
    stream: StreamStatus | None = None

    def json(self) -> dict[str, Any]:
        """As nested dictionaries and lists, ready for JSON."""
        found = asdict(self)
        found["axes"] = [axis | {"inputs_on": list(axis["inputs_on"])} for axis in found["axes"]]
        found["unhomed_nodes"] = list(self.unhomed_nodes)
        found["stream"] = None if self.stream is None else self.stream.json()
        return found


def snapshot(controller: Controller) -> Status:
    """Reads everything. Raises BusError: the controller does not answer."""
    with controller.turn():
        state = controller.state()
        motion = [controller.read(MOTION, sub) for sub in (1, 2, 3)]
        override = [controller.read(OVERRIDE, sub) for sub in (1, 2, 3)]
        refusal = controller.read(FAULT, 4)
        fault = _fault(controller)
        trouble = controller.boot_trouble() if state == BOOT else None
        configured = _configured(controller)
        unhomed = controller.read(UNHOMED_START, 2)
        statistics = Statistics(**controller.statistics())
        stream = stream_status(controller)
        timing = controller.read(TIMING)
    with controller.turn():
        axis_count = controller.read(CONFIGURATION, 1)
        axes = tuple(
            _axis(controller, i, counts)
            for i, counts in enumerate(configured_counts(controller, axis_count), start=1)
        )
    return Status(
        bus=str(controller.address),
        node=controller.node_id,
        state=STATES.get(state, str(state)),
        fault=fault,
        boot_trouble=trouble,
        last_refusal=REFUSALS.get(refusal),
        configuration=configured,
        program=loaded_program(controller),
        motion=PathPosition(motion[0] * MM_PER_Q40, motion[1] / 1000, motion[2] * _Q32),
        override=Override(override[0], 100 * override[1] * _Q30, bool(override[2])),
        unhomed_nodes=tuple(axis.node for i, axis in enumerate(axes) if unhomed >> i & 1),
        axes=axes,
        timing=TIMINGS.get(timing, str(timing)),
        statistics=statistics,
        stream=None if stream.state == NONE else stream,
    )


def read_status(controller: Controller) -> dict[str, Any]:
    """`snapshot`, ready for JSON."""
    return snapshot(controller).json()


def stream_dict(controller: Controller) -> dict[str, Any] | None:
    """The job in chunks, as in `read_status`; None: there is none."""
    if controller.read(STREAM, 2) == NONE:
        return None
    return stream_status(controller).json()


def _fault(controller: Controller) -> Fault | None:
    code = controller.read(FAULT, 1)
    if code == 0:
        return None
    node, detail = controller.read(FAULT, 2), controller.read(FAULT, 3)
    words = fault_words(code)
    return Fault(code, words.text, words.remedy, node, detail, detail_text(code, detail))


def _configured(controller: Controller) -> Configured:
    crc32, state, stored, stored_crc32, program_crc32 = (
        controller.read(CONFIGURATION_STATE, sub) for sub in (1, 3, 4, 5, 6)
    )
    return Configured(CONFIGURED[state], crc32, STORED[stored], stored_crc32, program_crc32)


def loaded_program(controller: Controller) -> LoadedProgram:
    """Object 0x2000 without the image. Raises BusError."""
    with controller.turn():
        numbers = controller.program_summary()
        stops = controller.longest_stops()
    code, index = numbers["refused_code"], numbers["refused_index"]
    return LoadedProgram(
        refused=program_fault_text(code, index) if code else None,
        duration_s=numbers.pop("duration_q32_s") * _Q32,
        length_mm=numbers.pop("length_q40_mm") * MM_PER_Q40,
        stops=LongestStops(**{kind: _longest(found) for kind, found in stops.items()}),
        **numbers,
    )


def _longest(found: Mapping[str, int]) -> LongestStop:
    return LongestStop(
        time_s=found["time_us"] / 1e6,
        distance_mm=found["distance_um"] / 1e3,
        at_mm=found["place_um"] / 1e3,
        piece=found["piece"],
    )


def _axis(controller: Controller, i: int, counts_per_unit: int) -> AxisStatus:
    error = controller.read(DRIVE_ERROR, i)
    words = fault_words(error) if error else None
    inputs = controller.read(DIGITAL_INPUTS, i)
    return AxisStatus(
        node=controller.read(AXIS_NODE, i),
        state=state_of_number(controller.read(DRIVE_STATE, i)),
        statusword=controller.read(STATUSWORD, i),
        actual_mm=controller.read(ACTUAL, i) / counts_per_unit,
        target_mm=controller.read(TARGET, i) / counts_per_unit,
        following_error_um=1000 * controller.read(FOLLOWING_ERROR, i) / counts_per_unit,
        missed_tpdos=controller.read(MISSED_TPDOS, i),
        digital_inputs=inputs,
        inputs_on=inputs_on(inputs),
        homed=bool(controller.read(HOMED, i)),
        homing_method=controller.read(HOMING_METHOD, i),
        error_code=error,
        error=words.text if words else None,
        remedy=words.remedy if words else None,
    )
