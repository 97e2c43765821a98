# SPDX-License-Identifier: MIT
"""The controller's state, gathered and in words."""

from __future__ import annotations

from typing import Any

from .controller import Controller
from .objects import (
    ACTUAL,
    AXIS_NODE,
    CONFIGURATION,
    DRIVE_ERROR,
    FAULT,
    MOTION,
    OVERRIDE,
    STATUSWORD,
    TARGET,
)
from .texts import REFUSALS, STATES, drive_state, fault_text

_Q40 = 2.0**-40
_Q32 = 2.0**-32
_Q30 = 2.0**-30


def read_status(controller: Controller) -> dict[str, Any]:
    """State, fault, program, motion, axes and statistics, ready for JSON."""
    state = controller.state()
    counts_per_mm = controller.read(CONFIGURATION, 7)
    return {
        "bus": str(controller.address),
        "node": controller.node_id,
        "state": STATES.get(state, str(state)),
        "fault": _fault(controller),
        "last_refusal": REFUSALS.get(controller.read(FAULT, 4)),
        "program": _program(controller),
        "motion": {
            "arc_length_mm": controller.read(MOTION, 1) * _Q40,
            "feed_mm_s": controller.read(MOTION, 2) / 1000,
            "time_s": controller.read(MOTION, 3) * _Q32,
        },
        "override": {
            "wanted_percent": controller.read(OVERRIDE, 1),
            "actual_percent": 100 * controller.read(OVERRIDE, 2) * _Q30,
            "saturated": bool(controller.read(OVERRIDE, 3)),
        },
        "axes": [
            _axis(controller, i, counts_per_mm)
            for i in range(1, controller.read(CONFIGURATION, 1) + 1)
        ],
        "statistics": controller.statistics(),
    }


def _fault(controller: Controller) -> dict[str, Any] | None:
    code = controller.read(FAULT, 1)
    if code == 0:
        return None
    return {
        "code": code,
        "text": fault_text(code),
        "node": controller.read(FAULT, 2),
        "detail": controller.read(FAULT, 3),
    }


def _program(controller: Controller) -> dict[str, Any]:
    summary = controller.program_summary()
    summary["duration_s"] = summary.pop("duration_q32_s") * _Q32
    summary["length_mm"] = summary.pop("length_q40_mm") * _Q40
    return summary


def _axis(controller: Controller, i: int, counts_per_mm: int) -> dict[str, Any]:
    statusword = controller.read(STATUSWORD, i)
    return {
        "node": controller.read(AXIS_NODE, i),
        "state": drive_state(statusword),
        "statusword": statusword,
        "actual_mm": controller.read(ACTUAL, i) / counts_per_mm,
        "target_mm": controller.read(TARGET, i) / counts_per_mm,
        "error_code": controller.read(DRIVE_ERROR, i),
    }


def status_rows(status: dict[str, Any]) -> list[tuple[str, str]]:
    """The same for people."""
    program, motion, statistics = status["program"], status["motion"], status["statistics"]
    rows = [
        ("controller", f"node {status['node']} on {status['bus']}: {status['state']}"),
        ("fault", "none" if status["fault"] is None else _fault_words(status["fault"])),
        ("program", _program_words(program)),
        (
            "motion",
            f"arc length {motion['arc_length_mm']:.6f} mm, feed {motion['feed_mm_s']:.3f} mm/s, "
            f"time {motion['time_s']:.3f} s",
        ),
    ]
    rows.append(("override", _override_words(status["override"])))
    for i, axis in enumerate(status["axes"], start=1):
        error = f", error 0x{axis['error_code']:04X}" if axis["error_code"] else ""
        rows.append(
            (
                f"axis {i}",
                f"node {axis['node']}: {axis['state']}, at {axis['actual_mm']:.6f} mm, "
                f"target {axis['target_mm']:.6f} mm{error}",
            )
        )
    rows.append(
        (
            "statistics",
            ", ".join(f"{name.replace('_', ' ')} {value}" for name, value in statistics.items()),
        )
    )
    return rows


def _override_words(override: dict[str, Any]) -> str:
    saturated = ", as much as the program allows here" if override["saturated"] else ""
    return f"{override['wanted_percent']} %, now {override['actual_percent']:.1f} %{saturated}"


def _fault_words(fault: dict[str, Any]) -> str:
    return f"{fault['text']} (code 0x{fault['code']:04X}, node {fault['node']}, detail {fault['detail']})"


def _program_words(program: dict[str, Any]) -> str:
    if program["state"] != "ready":
        return str(program["state"])
    return (
        f"{program['segments']} segments, {program['pieces']} pieces, {program['ticks']} ticks, "
        f"{program['duration_s']:.3f} s, {program['length_mm']:.3f} mm, CRC-32 {program['crc32']:08x}"
    )
