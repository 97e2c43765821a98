# SPDX-License-Identifier: MIT
"""Violations in a case's record, and the figures of the result table. Used by faults/case_runner and faults/case_table.
No I/O.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil
from typing import Any

import numpy as np

from ..bus.capture.setpoint_check import find_jumps, find_rough_starts, step_limits
from ..config import SPACE_AXES
from ..fixed_point import MM_PER_Q40
from ..native import Contour, NativeProgram
from .case_record import CaseRecord, Emergency
from .case_run import REST_TOLERANCE_COUNTS, CaseRun

CONTROLLER_KILLED = "kill-controller"
_PATH_TOLERANCE_MM = 3e-6
"""Rounding to counts of 1 nm, and the kernel's own error."""

_FOLLOWS_TICKS = 100
"""Least time for which a drive has to follow its setpoint at the place of rest, where it settles."""

_PROVISIONAL = {0x1000, 0xFF02}
"""Codes of the controller for a drive until the drive's own emergency code has come (docs/guides/faults.md, policy)."""

Times = tuple[int | None, float | None]
"""Ticks, milliseconds."""


@dataclass(frozen=True)
class Verdict:
    """A case in figures. Latencies are None where nothing was detected, or nothing moved."""

    scenario: str
    seed: int
    drawn: dict[str, int | str]
    injected: int
    codes: tuple[int, ...]
    latency_ticks: int | None
    latency_ms: float | None
    rest_ticks: int | None
    rest_ms: float | None
    recovery_ms: float | None
    violations: tuple[str, ...]
    wall_s: float

    @property
    def detected(self) -> bool:
        """Whether a fault was raised."""
        return bool(self.codes)

    @classmethod
    def of(cls, summary: Mapping[str, Any]) -> Verdict:
        """The verdict that `summary` was made from."""
        lists = {key: tuple(summary[key]) for key in ("codes", "violations")}
        return cls(**{**summary, **lists})

    def summary(self) -> dict[str, object]:
        """For JSON."""
        return {
            "scenario": self.scenario,
            "seed": self.seed,
            "drawn": self.drawn,
            "injected": self.injected,
            "codes": list(self.codes),
            "latency_ticks": self.latency_ticks,
            "latency_ms": self.latency_ms,
            "rest_ticks": self.rest_ticks,
            "rest_ms": self.rest_ms,
            "recovery_ms": self.recovery_ms,
            "violations": list(self.violations),
            "wall_s": round(self.wall_s, 3),
        }


def judge(record: CaseRun) -> Verdict:
    """Checks a case record against the expectation of its scenario."""
    evidence = record.evidence
    violations = list(record.troubles)
    codes: list[int] = []
    latency: Times = (None, None)
    rest: Times = (None, None)
    if evidence is None:
        violations.append("no recording")
    else:
        codes, latency, rest = _reaction(record, evidence)
        violations += _bad_setpoints(record, evidence)
        violations += [
            f"node {node} still moves at the end of the recording"
            for node in evidence.still_moving(REST_TOLERANCE_COUNTS)
        ]
        violations += _not_seen_at_rest(record, evidence, codes)
        violations += _not_on_path(record, evidence)
    violations += _unexpected(record, codes, latency, rest)
    violations += _not_recovered(record)
    return Verdict(
        scenario=record.case.scenario.name,
        seed=record.case.seed,
        drawn=dict(record.case.drawn),
        injected=len(record.injections)
        + (record.case.scenario.action not in ("none", "watch-drives")),
        codes=tuple(codes),
        latency_ticks=latency[0],
        latency_ms=latency[1],
        rest_ticks=rest[0],
        rest_ms=rest[1],
        recovery_ms=None if record.recovery_ms is None else round(record.recovery_ms, 3),
        violations=tuple(violations),
        wall_s=record.wall_s,
    )


def _reaction(record: CaseRun, evidence: CaseRecord) -> tuple[list[int], Times, Times]:
    """Fault codes, times from the injection to the fault and to rest."""
    found = _reported_faults(record, evidence)
    rest: Times
    codes = sorted({e.code for e in found} | set(record.fault_codes))
    if not found:
        return codes, (None, None), (None, None)
    fault_us = found[0].time_us
    latency = _between(evidence, record.began_us, fault_us)
    rest_us = record.rest_us
    if rest_us is None:
        seen = evidence.last_motions_us(REST_TOLERANCE_COUNTS).values()
        rest_us = max((time_us for time_us in seen if time_us is not None), default=None)
    rest = (None, None) if rest_us is None else _between(evidence, record.began_us, rest_us)
    return codes, latency, rest


def _reported_faults(record: CaseRun, evidence: CaseRecord) -> list[Emergency]:
    """Faults since the injection: those that the controller reported, or the drives if it was killed."""
    if record.case.scenario.action == CONTROLLER_KILLED:
        found = evidence.emergencies(evidence.drives, evidence.nodes)
    else:
        found = evidence.emergencies(evidence.control, (record.clean_run.machine.node,))
    return [emergency for emergency in found if emergency.time_us >= record.began_us]


def _between(evidence: CaseRecord, from_us: int, to_us: int) -> tuple[int, float]:
    ticks = evidence.tick_at(to_us) - evidence.tick_at(from_us)
    return max(0, ticks), max(0.0, round((to_us - from_us) / 1000, 3))


def _bad_setpoints(record: CaseRun, evidence: CaseRecord) -> list[str]:
    """Violations: setpoint jumps, and setpoints away from the curve."""
    machine = record.clean_run.machine
    limits = step_limits(machine, record.clean_run.setpoints)
    frames = evidence.control if record.control is None else record.control
    bad = [str(jump) for jump in find_jumps(frames, machine.nodes, limits)[:3]]
    bad += find_rough_starts(frames, machine.nodes, REST_TOLERANCE_COUNTS)[:3]
    if not evidence.moved:
        return bad
    drawn = evidence.setpoints()[: min(record.clean_run.setpoints.shape[1], SPACE_AXES)]
    sent = np.logical_and.reduce([axis_sent for _, axis_sent in drawn])
    points = np.unique(np.stack([axis[sent] for axis, _ in drawn], axis=1), axis=0)
    worst_mm = _distance_mm(record, points)
    if worst_mm > _PATH_TOLERANCE_MM:
        bad.append(f"a setpoint is {worst_mm * 1e6:.1f} nm away from the curve")
    return bad


def _distance_mm(record: CaseRun, points: np.ndarray[tuple[int, int], np.dtype[np.int64]]) -> float:
    program = NativeProgram(record.clean_run.image)
    rows, nominal = program.setpoints("fixed", record.clean_run.machine.path_counts)
    contour, worst = Contour(program), 0.0
    places = nominal[:, : points.shape[1]].astype(np.float64)
    scale = record.clean_run.machine.counts_per_mm
    for point in points:
        near = int(np.argmin(np.sum((places - point) ** 2, axis=1)))
        arc_mm = float(rows["arc_length_q40_mm"][near]) * MM_PER_Q40
        worst = max(worst, abs(contour.distance_mm(arc_mm, *(point / scale))))
    return worst


def _not_seen_at_rest(record: CaseRun, evidence: CaseRecord, codes: list[int]) -> list[str]:
    """Violations of the time of rest; a rest that was not measured is not in time."""
    expect = record.case.scenario.expect
    if not codes or not expect.limits_rest or record.rest_us is not None:
        return []
    last = evidence.last_motions_us(REST_TOLERANCE_COUNTS)
    unknown = [node for node, time_us in last.items() if time_us is None]
    if expect.unseen and len(unknown) < len(last):
        return []
    return [f"no report shows when node {node} came to rest" for node in unknown]


def _not_on_path(record: CaseRun, evidence: CaseRecord) -> list[str]:
    """Violations of a stop that has to be on the path: it was late, or a quick stop ended it."""
    found = _reported_faults(record, evidence)
    if not record.case.scenario.expect.on_path or not found or not evidence.moved:
        return []
    most_ticks = ceil(record.clean_run.fault_stop_s / (record.clean_run.machine.period_us * 1e-6))
    fault_tick, bad = evidence.tick_at(found[0].time_us), []
    for node, (target, sent) in zip(evidence.nodes, evidence.setpoints(), strict=True):
        steps = np.flatnonzero((np.diff(target) != 0) & sent[1:] & sent[:-1])
        rest_tick = int(steps[-1]) + 1 if steps.size else 0
        if rest_tick > fault_tick + most_ticks:
            bad.append(
                f"setpoints of node {node} at rest {rest_tick - fault_tick} ticks after the fault, "
                f"the program's fault stops take {most_ticks} at most"
            )
        if not sent[rest_tick : rest_tick + _FOLLOWS_TICKS].all():
            bad.append(f"node {node} was not led to rest on the path")
    return bad


def _unexpected(record: CaseRun, codes: list[int], latency: Times, rest: Times) -> list[str]:
    expect, bad = record.case.scenario.expect, []
    if record.case.rules and not record.injections:
        bad.append("nothing was injected")
    if not codes and expect.codes and not expect.may:
        bad.append("no fault was raised")
    allowed = set(expect.codes)
    allowed |= _PROVISIONAL if allowed & set(codes) else set()
    names = ", ".join(f"0x{code:04X}" for code in codes if code not in allowed)
    if names:
        bad.append(f"fault {names} was raised, which is none of those expected")
    if not codes and not record.finished and not record.troubles:
        bad.append("the program did not come to its end, and no fault says why")
    for what, (ticks, ms), most_ticks, most_ms in (
        ("fault raised", latency, expect.within_ticks, expect.within_ms),
        ("axes at rest", rest, expect.rest_ticks, expect.rest_ms),
    ):
        if ticks is not None and ticks > most_ticks:
            bad.append(f"{what} after {ticks} ticks, {most_ticks} are allowed")
        if ms is not None and ms > most_ms:
            bad.append(f"{what} after {ms:.0f} ms, {most_ms} are allowed")
    return bad


def _not_recovered(record: CaseRun) -> list[str]:
    clean, again = record.clean_run.motion, record.again
    if again is None:
        return ["no clean run afterwards"] if not record.troubles else []
    bad = []
    most_ms = record.case.scenario.expect.recover_ms
    if record.recovery_ms is None or record.recovery_ms > most_ms:
        took = "no known time" if record.recovery_ms is None else f"{record.recovery_ms:.0f} ms"
        bad.append(f"reset after {took}, {most_ms} ms are allowed")
    if again.setpoints_sha256 != clean.setpoints_sha256:
        bad.append("the run afterwards has other setpoints")
    same = record.case.scenario.expect.same_encoders
    if same and again.encoders_sha256 != clean.encoders_sha256:
        bad.append("the run afterwards has other encoder positions")
    return bad
