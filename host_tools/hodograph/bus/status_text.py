# SPDX-License-Identifier: MIT
"""The status of a controller as text: rows of name and value, or one line. Used by cli/status_command. No I/O;
`sdo/status` reads the values.

For `hodograph status` and `status --watch`.
"""

from __future__ import annotations

from collections.abc import Sequence

from .capture.load import BusLoad
from .diagnostics.texts import TIMINGS
from .sdo.status import AxisStatus, LoadedProgram, Override, Statistics, Status
from .sdo.stream_channel import StreamStatus

Row = tuple[str, str]


def status_rows(
    status: Status, load: BusLoad | None = None, names: Sequence[str] = ()
) -> list[Row]:
    """All of a status as rows (name, value). `names`: of the axes, by axis."""
    rows = [("controller", f"node {status.node} on {status.bus}: {status.state}")]
    rows += _trouble_rows(status)
    rows.append(("configuration", _configuration_words(status)))
    rows.append(("program", _program_words(status.program)))
    rows += _stop_rows(status.program)
    if status.stream is not None:  # the length of `program` is not that of the job
        rows.append(("stream", stream_words(status.stream)))
    else:
        rows.append(("position", _position_words(status)))
    rows.append(("feed", f"{status.motion.feed_mm_s:.3f} mm/s"))
    rows.append(("override", _override_words(status.override)))
    if status.unhomed_nodes:
        nodes = ", ".join(map(str, status.unhomed_nodes))
        rows.append(("not homed", f"node {nodes} when this program was started (--unhomed)"))
    for i, axis in enumerate(status.axes):
        name = names[i] if i < len(names) else str(i + 1)
        rows.append((f"axis {name}", _axis_words(axis)))
        if axis.error is not None:
            rows.append(("", f"error: {axis.error} (0x{axis.error_code:04X})"))
            rows.append(("", f"remedy: {axis.remedy}"))
    rows += [] if load is None else _load_rows(load)
    rows += _timing_rows(status.timing)
    rows += _statistics_rows(status.statistics)
    return rows


_STREAM_STATES = (
    "none",
    "open",
    "waits for its next part",
    "ended",
    "stopped before its end",
    "waits at a program stop: hodograph resume goes on",
)


def stream_words(stream: StreamStatus) -> str:
    """A job in chunks: line, motion ahead, remaining time."""
    left = "time left not known"
    if stream.remaining_s is not None:
        left = f"{stream.remaining_s:.0f} s left"
    return (
        f"{_STREAM_STATES[stream.state]}, line {stream.line}, {stream.arc_length_mm:.3f} mm, "
        f"{stream.committed_s:.1f} s ahead in the controller, {left}, {stream.underruns} rests for want of chunks"
    )


def _timing_rows(timing: str) -> list[Row]:
    if timing == TIMINGS[0]:
        return []
    word = "refused" if timing == TIMINGS[1] else "enabled at your own risk (--no-realtime)"
    return [("real time", f"not permitted by the controller's computer: real drives are {word}")]


def _trouble_rows(status: Status) -> list[Row]:
    rows: list[Row] = []
    if status.fault is not None:
        fault = status.fault
        where = f"node {fault.node}" if fault.node else "the controller"
        detail = f", {fault.detail_text}" if fault.detail_text else ""
        rows.append(("fault", f"{fault.text} (code 0x{fault.code:04X}, {where}{detail})"))
        rows.append(("remedy", f"{fault.remedy}; then hodograph reset"))
    else:
        rows.append(("fault", "none"))
    if status.boot_trouble is not None:
        rows.append(("boot waits", status.boot_trouble.text))
        rows.append(("remedy", status.boot_trouble.remedy))
    if status.last_refusal is not None:
        rows.append(("last refusal", status.last_refusal))
    return rows


_CONFIGURED = {
    "none": "none since power-on: hodograph configure FILE, and --store to keep it over a loss of power",
    "confirmed": "given by the host, CRC-32 {crc32:08x}",
    "restored": "restored after power-on, CRC-32 {crc32:08x}",
}
_STORED = {
    "nothing": "nothing is stored",
    "of another firmware": "what is stored is of another firmware: hodograph configure FILE --store",
    "damaged": "what is stored is damaged: hodograph configure FILE --store",
    "defaults": "nothing is stored (configure --forget)",
}


def _configuration_words(status: Status) -> str:
    found = status.configuration
    words = [_CONFIGURED[found.state].format(crc32=found.crc32)]
    if found.stored in _STORED:
        words.append(_STORED[found.stored])
    elif found.state != "none" and found.stored_crc32 != found.crc32:
        words.append(f"another one is stored, CRC-32 {found.stored_crc32:08x}")
    elif found.state == "confirmed":
        words.append("stored")
    return "; ".join(words)


def _program_words(program: LoadedProgram) -> str:
    refused = f"; refused last: {program.refused}" if program.refused else ""
    if program.state != "ready":
        return program.state + refused
    return (
        f"{program.segments} segments, {program.pieces} pieces, {program.ticks} ticks, "
        f"{program.duration_s:.3f} s, {program.length_mm:.3f} mm, CRC-32 {program.crc32:08x}{refused}"
    )


def _stop_rows(program: LoadedProgram) -> list[Row]:
    if program.state != "ready":
        return []
    return [
        (
            name,
            f"at most {stop.time_s:.4g} s and {stop.distance_mm:.4g} mm to rest, longest from arc length "
            f"{stop.at_mm:.6g} mm (piece {stop.piece})",
        )
        for name, stop in (("hold, stop", program.stops.hold), ("fault stop", program.stops.fault))
    ]


def _position_words(status: Status) -> str:
    motion, program = status.motion, status.program
    return (
        f"{motion.arc_length_mm:.6f} of {program.length_mm:.6f} mm, "
        f"{motion.time_s:.3f} of {program.duration_s:.3f} s, tick {status.statistics.tick}"
    )


def _override_words(override: Override) -> str:
    saturated = ", as much as the program allows here" if override.saturated else ""
    return f"{override.wanted_percent} % commanded, {override.actual_percent:.1f} % now{saturated}"


def _axis_words(axis: AxisStatus) -> str:
    inputs = f", {' and '.join(axis.inputs_on)} on" if axis.inputs_on else ""
    return (
        f"node {axis.node}: {axis.state}, at {axis.actual_mm:.6f} mm, target {axis.target_mm:.6f} mm, "
        f"following error {axis.following_error_um:.3f} um, {_homed_words(axis)}, "
        f"{axis.missed_tpdos} TPDOs missed{inputs}"
    )


def _homed_words(axis: AxisStatus) -> str:
    if axis.homed:
        return "homed"
    return (
        "not homed (a start needs it: hodograph home)" if axis.homing_method else "needs no homing"
    )


def _load_rows(load: BusLoad) -> list[Row]:
    kinds = ", ".join(f"{name} {kind.percent:.1f}" for name, kind in load.classes.items())
    return [
        (
            "bus load",
            f"{load.percent:.1f} % of {load.bitrate / 1000:g} kbit/s, {load.frames_per_s:.0f} frames/s, "
            f"over {load.seconds:.2f} s",
        ),
        ("", kinds or "silent"),
    ]


def _statistics_rows(statistics: Statistics) -> list[Row]:
    return [
        (
            "ticks",
            f"worst tick {statistics.worst_tick_ns / 1000:.1f} us, worst lateness "
            f"{statistics.worst_lateness_us} us, deadline misses {statistics.deadline_misses}",
        ),
        (
            "frames",
            f"SYNCs {statistics.syncs}, missed TPDOs {statistics.missed_tpdos}, "
            f"not sent {statistics.frames_not_sent}",
        ),
    ]


def status_line(status: Status, load: BusLoad | None = None) -> str:
    """The status in one line."""
    motion = status.motion
    words = [
        status.state,
        f"{motion.arc_length_mm:.3f} mm",
        f"{motion.feed_mm_s:.1f} mm/s",
        f"override {status.override.actual_percent:.0f}/{status.override.wanted_percent} %",
        f"missed ticks {status.statistics.deadline_misses}",
    ]
    if load is not None:
        words.append(f"bus {load.percent:.1f} %")
    if status.fault is not None:
        words.append(f"fault 0x{status.fault.code:04X}: {status.fault.text}")
    if status.boot_trouble is not None:
        words.append(status.boot_trouble.text)
    return ", ".join(words)
