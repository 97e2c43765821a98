# SPDX-License-Identifier: MIT
"""hodograph verify: compares a program with the limits of its path file. Started by cli/main. Reads files, and prints
to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict, dataclass
from math import isfinite
from pathlib import Path

from ..config import PLANE_AXES, Drive, Machine
from ..errors import InputError, LimitError
from ..feed import Peak
from ..machine_limits import ProvedStops, controller_verdict, proved_limits, proved_stops
from ..names import is_toolpath
from ..native.program import NativeFault, NativeProgram
from ..pipeline import Pipeline, load_pipeline
from ..program import compile_program, encode
from ..program.compiler import ProgramOptions
from ..program.image import read_image
from ..verify import (
    TOLERANCE,
    BusNoise,
    Sampled,
    Verification,
    bus_noise,
    sampled,
    verify_program,
)
from .output import number, print_json
from .path_commands import decode_file, print_notes
from .toolpath_commands import refuse_toolpath_options, toolpath_job

COUNTS_PER_MM = 1_000_000
"""Default without a machine."""

_MOST_LINES = 20


def verify(options: Namespace) -> None:
    """Prints peaks and limits. Raises LimitError: a limit is exceeded by more than TOLERANCE."""
    if is_toolpath(options.file):
        _verify_toolpath(options)
        return
    refuse_toolpath_options(options, options.file)
    pipeline = load_pipeline(options.file, options.machine, allow_space=True)
    native = _planned(pipeline) if options.program is None else _given(options.program)
    given = options.program is not None  # else the controller's check has accepted it already
    checked = _check(pipeline, native, options.program or options.file, given=given)
    if options.json:
        print_json(checked.document())
    else:
        print(checked.text())
    if checked.fault is not None:
        raise LimitError(f"{options.file}: the controller would refuse it: {checked.fault.text}")
    _require_kept(str(options.file), [checked.found])


@dataclass(frozen=True)
class _Checked:
    """A program compared with its limits: the verdict of the controller, proved stops, peaks, setpoints."""

    machine: Machine | None
    fault: NativeFault | None
    stops: tuple[ProvedStops, ...] | None
    found: Verification
    drives_see: tuple[Sampled, ...]
    noise: BusNoise
    axes: list[tuple[str, str]]

    def document(self) -> dict[str, object]:
        """For --json."""
        verdict = _verdict_document(self.machine, self.fault)
        stops = {"stops": _stops_document(self.stops)}
        return verdict | stops | _document(self.found, self.drives_see, self.noise)

    def text(self) -> str:
        """The result as text."""
        lines = [_verdict(self.machine, self.fault)]
        lines += [_stops_line(one) for one in self.stops or ()]
        return "\n".join([*lines, _text(self.found, self.drives_see, self.noise, self.axes)])


def _check(pipeline: Pipeline, native: NativeProgram, file: Path, *, given: bool) -> _Checked:
    """Checks a program of a pipeline; `given`: it comes from a file, so the controller's check has not seen it."""
    machine = pipeline.machine_or_none
    program = decode_file(file, native.image)
    fault = controller_verdict(native, machine) if given and machine is not None else None
    native.require()
    counts_per_mm = COUNTS_PER_MM if machine is None else machine.counts_per_mm
    return _Checked(
        machine,
        fault,
        None if machine is None or fault is not None else proved_stops(native, program, machine),
        verify_program(program, pipeline.limits, _drives(machine)),
        sampled(native),
        bus_noise(counts_per_mm, program.period_us),
        _axes(pipeline, program.axis_count),
    )


def _axes(pipeline: Pipeline, count: int) -> list[tuple[str, str]]:
    """Name and unit of each path axis."""
    names = pipeline.limits.of_axes(count).names
    return [(name, pipeline.limits.unit(k)) for k, name in enumerate(names)]


def _require_kept(place: str, found: list[Verification]) -> None:
    """Raises LimitError: a limit is exceeded by more than TOLERANCE."""
    beyond = {peak.quantity: None for one in found if not one.kept for peak in one.exceeded}
    if beyond:
        raise LimitError(
            f"{place}: beyond its limits by more than {100 * TOLERANCE:g} %: {', '.join(beyond)}"
        )


def _verify_toolpath(options: Namespace) -> None:
    """The programs of all sections, one after the other."""
    if options.program is not None:
        raise InputError(
            f"{options.file}: --program is for path files; a toolpath is verified as it is planned now: leave it out"
        )
    job = toolpath_job(options, options.file)
    found, documents = [], []
    for index, section in enumerate(job.sections, 1):
        pipeline = section.pipeline
        checked = _check(pipeline, pipeline.accepted, options.file, given=False)
        found.append(checked.found)
        if options.json:
            documents.append(section.lines_summary() | checked.document())
        else:
            print(f"section {index}, lines {section.first_line} … {section.last_line}")
            print(checked.text() + "\n")
    if options.json:
        print_json({"kept": all(one.kept for one in found), "section": documents})
    _require_kept(str(options.file), found)


def _verdict(machine: Machine | None, fault: NativeFault | None) -> str:
    """The verdict of the controller's own check on the limits of the machine."""
    if machine is None:
        return "controller's check: no machine, so no limits of its axes are proved (use --machine FILE)"
    if fault is not None:
        return f"controller's check: refused, {fault.text} (code {fault.code}, piece {fault.index})"
    return f"controller's check: proved at all times and overrides: {proved_limits(machine)}"


def _stops_line(stops: ProvedStops) -> str:
    """Number of pieces from which all stops are proved to keep the machine's limits, and their share of the time."""
    tested = (
        ""
        if stops.proved == stops.pieces
        else f" ({100 * stops.time_share:.0f} % of their time); the others are tested, not proved"
    )
    return (
        f"{stops.name}: the same limits are proved until standstill in {stops.proved} of {stops.pieces} "
        f"feed pieces in which one may begin{tested}"
    )


def _stops_document(stops: tuple[ProvedStops, ...] | None) -> dict[str, object] | None:
    if stops is None:
        return None
    return {
        one.kind: {
            "pieces": one.pieces,
            "proved": one.proved,
            "proved_time_share": one.time_share,
            "not_proved_at_mm": one.open_mm,
        }
        for one in stops
    }


def _verdict_document(machine: Machine | None, fault: NativeFault | None) -> dict[str, object]:
    if machine is None:
        return {"controller": None}
    if fault is None:
        return {"controller": {"accepted": True, "code": 0, "piece": None, "text": "accepted"}}
    refusal = {"code": fault.code, "piece": fault.index, "text": fault.text}
    return {"controller": {"accepted": False} | refusal}


def _planned(pipeline: Pipeline) -> NativeProgram:
    if pipeline.machine_or_none is not None:
        print_notes(pipeline, pipeline.compilation.plan)
        return pipeline.accepted
    print_notes(pipeline, pipeline.plan)
    options = ProgramOptions(pipeline.file.name)
    return NativeProgram(encode(compile_program(pipeline.curve, pipeline.plan, options)))


def _given(file: Path) -> NativeProgram:
    image = read_image(file)
    if image is None:
        raise InputError(f"{file}: is not a program image: make one with hodograph compile")
    decode_file(file, image)  # its errors name the file
    return NativeProgram(image)


def _drives(machine: Machine | None) -> tuple[Drive, ...]:
    """The drives of the path's axes; empty: one of them is not known."""
    if machine is None or len(machine.axes) < PLANE_AXES:
        return ()
    known = [axis.drive for axis in machine.path_axes if axis.drive is not None]
    return tuple(known) if len(known) == len(machine.path_axes) else ()


def _document(
    found: Verification, drives_see: tuple[Sampled, ...], noise: BusNoise
) -> dict[str, object]:
    return {
        "kept": found.kept,
        "duration_s": found.duration_s,
        "length_mm": found.length_mm,
        "samples": found.samples,
        "peak": {peak.quantity: _entry(peak) for peak in found.peaks},
        "excesses": [{"quantity": peak.quantity} | _entry(peak) for peak in found.excesses],
        "setpoints": {
            one.kernel: {k: v for k, v in asdict(one).items() if k != "kernel"}
            for one in drives_see
        },
        "bus_noise": asdict(noise),
    }


def _entry(peak: Peak) -> dict[str, object]:
    limited = isfinite(peak.limit.value)
    return {
        "value": peak.value,
        "at_most": peak.most,
        "limit": peak.limit.value if limited else None,
        "ratio": peak.usage if limited else None,
        "s_mm": peak.s_mm,
        "t_s": peak.t_s,
    }


def _text(
    found: Verification,
    drives_see: tuple[Sampled, ...],
    noise: BusNoise,
    axes: list[tuple[str, str]],
) -> str:
    lines = [
        f"{'quantity':<24} {'peak':>12} {'at most':>12} {'limit':>10} {'ratio':>8} {'s mm':>10} {'t s':>9}",
        *(_row(peak) for peak in found.peaks),
        "",
    ]
    if found.excesses:
        within = f", none by more than {100 * TOLERANCE:g} %" if found.kept else ""
        lines.append(
            f"beyond a limit, worst place of each stretch ({len(found.excesses)}{within}):"
        )
        lines += [_row(peak) for peak in found.excesses[:_MOST_LINES]]
        if len(found.excesses) > _MOST_LINES:
            lines.append(f"  ... {len(found.excesses) - _MOST_LINES} more (--json lists them)")
    else:
        lines.append("nothing beyond a limit")
    lines += ["", *_sampled_rows(drives_see, axes)]
    lines.append(
        f"rounding to counts adds up to {number(noise.acceleration_mm_s2)} mm/s^2 and "
        f"{number(noise.jerk_mm_s3)} mm/s^3 on the bus"
    )
    return "\n".join(lines)


def _sampled_rows(drives_see: tuple[Sampled, ...], axes: list[tuple[str, str]]) -> list[str]:
    """The table of setpoints by kernel; `axes` are names and units."""
    heads = [f"{name} {unit}/s^{order}" for order in (2, 3) for name, unit in axes]
    rows = [
        f"{'setpoints of kernel':<24} "
        + " ".join(f"{one:>12}" for one in heads)
        + f" {'noise':>10}"
    ]
    for one in drives_see:
        values = (number(value) for value in (*one.acceleration_mm_s2, *one.jerk_mm_s3))
        cells = " ".join(f"{value:>12}" for value in values)
        rows.append(f"{one.kernel:<24} {cells} {number(one.noise_mm_s3):>10}")
    return rows


def _row(peak: Peak) -> str:
    limited = isfinite(peak.limit.value)
    limit = number(peak.limit.value) if limited else "-"
    ratio = f"{peak.usage:.5f}" if limited else "-"
    return (
        f"{peak.quantity:<24} {number(peak.value):>12} {number(peak.most):>12} {limit:>10} {ratio:>8} "
        f"{peak.s_mm:>10.4f} {peak.t_s:>9.4f}"
    )


COMMANDS = {"verify": verify}
