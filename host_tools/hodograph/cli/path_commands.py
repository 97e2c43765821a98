# SPDX-License-Identifier: MIT
"""Commands that need no bus: spline, feed, compile, inspect, simulate. Started by cli/main; other commands use its
functions. Reads path and machine files, writes images and tables, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..bustime import require_fit
from ..config import Machine
from ..errors import HodographError, InputError
from ..feed import FeedPlan
from ..names import is_toolpath
from ..native import NativeProgram
from ..pipeline import Pipeline, load_pipeline
from ..program import Program, decode, inspect_dict, inspect_text
from ..program.check import check, coefficients_in_range
from ..program.image import LARGEST_BANK, RECORD_BYTES, memory_bytes, read_image
from ..program.stops import stops_dict, stops_text
from ..simulate import Motion, StoppedRun, last_tick_s, simulate_on, simulate_stop, write_trace
from ..spline import PHSpline, coordinates
from ..spline.spatial import SpatialPHSpline
from .output import (
    duration_text,
    json_text,
    note,
    number,
    print_json,
    print_rows,
    progress,
    require_places,
    size_text,
    write_file,
)
from .toolpath_commands import refuse_toolpath_options, section_pipeline, simulate_toolpath


def spline(options: Namespace) -> None:
    """hodograph spline."""
    pipeline = load_pipeline(options.file, allow_space=True)
    found, unit = pipeline.found_spline, pipeline.unit
    curve = found.spline
    for line in found.notes:
        note(f"{options.file.name}: {line}")
    result: dict[str, object] = {
        "closed": curve.closed,
        "segments": curve.segment_count,
        "nodal_points": curve.axes_nodes.tolist(),
        "length_mm": curve.length_mm,
        "segment_lengths_mm": curve.segment_lengths_mm.tolist(),
        "newton_iterations": found.newton_iterations,
        "max_curvature_per_mm": curve.max_curvature_per_mm(),
        "trial_iterations": found.trial_iterations,
        "changed_sides": found.changed_sides,
        "extra_turning_rad": found.extra_turning_rad,
        "bending_ratio": found.bending_ratio,
    }
    if options.at is not None:
        s = np.atleast_1d(_within("--at", options.at, curve.length_mm, unit))
        result["points"] = curve.axes_point(s).tolist()
        result["tangents"] = coordinates(curve.tangent(s)).tolist()
        result["curvatures"] = curve.curvature(s).tolist()
        if isinstance(curve, SpatialPHSpline):
            result["torsions"] = curve.torsion(s).tolist()
    if options.json:
        print_json(result)
        return
    print_rows(
        [
            ("path", f"{'closed' if curve.closed else 'open'}, {curve.segment_count} segments"),
            ("length", f"{number(curve.length_mm)} {unit}"),
            ("greatest curvature", f"{number(curve.max_curvature_per_mm())} /{unit}"),
            ("Newton iterations", str(found.newton_iterations)),
        ]
    )
    if options.at is not None:
        _print_places(curve, s, unit)


def _print_places(curve: PHSpline | SpatialPHSpline, s: NDArray[np.float64], unit: str) -> None:
    columns = [(f"curvature /{unit}", curve.curvature(s))]
    if isinstance(curve, SpatialPHSpline):
        columns.append((f"torsion /{unit}", curve.torsion(s)))
    points = curve.axes_point(s)
    first = 1 if unit == "mm" else 4
    own = [f"{axis} mm" for axis in "xyz"] if unit == "mm" else []
    own += [f"axis {first + k}" for k in range(len(own), points.shape[1])]
    names = own + [name for name, _ in columns]
    print(f"{f's {unit}':>12} " + " ".join(f"{name:>16}" for name in names))
    for at, row in zip(s, np.column_stack((points, *(v for _, v in columns))), strict=True):
        print(f"{at:12.6g} " + " ".join(f"{value:16.9f}" for value in row))


def _within(what: str, values: list[float], end: float, unit: str) -> np.ndarray:
    array = np.asarray(values, dtype=np.float64)
    bad = array[~((array >= 0) & (array <= end * (1 + 1e-12)))]
    if bad.size:
        raise InputError(f"{what} {bad[0]:g}: must be from 0 to {end:.9g} {unit}")
    return np.minimum(array, end)


def print_notes(pipeline: Pipeline, plan: FeedPlan) -> None:
    """The notes of a path, each with the file's name."""
    for line in pipeline.notes(plan):
        note(f"{pipeline.file.file.name}: {line}")


def feed(options: Namespace) -> None:
    """hodograph feed."""
    pipeline = load_pipeline(options.file, options.machine, allow_space=True)
    program = _program_of(pipeline)
    plan = pipeline.plan if program is None else pipeline.compilation.plan
    print_notes(pipeline, plan)
    at_s = None
    if options.at is not None:
        at_s = _within("--at", options.at, plan.duration_s, "s")
    if options.json:
        print_json(_feed_document(pipeline, plan, program, at_s))
    else:
        _print_feed(pipeline, plan, program, at_s)


def _feed_document(
    pipeline: Pipeline, plan: FeedPlan, program: Program | None, at_s: np.ndarray | None
) -> dict[str, object]:
    result: dict[str, object] = {
        "profile": plan.profile,
        "n_c": plan.n_c,
        "evaluations": plan.evaluations,
        "ramp_time_s": plan.ramp_time_s,
        "duration_s": plan.duration_s,
        "planning_s": pipeline.planning_s,
        "peak": {
            name: {"value": peak.value, "limit": peak.limit.given, "at_mm": peak.s_mm}
            for name, peak in pipeline.peaks_of(plan).items()
        },
        "peak_acceleration_mm_s2": plan.peak_acceleration_mm_s2,
        "peak_jerk_mm_s3": plan.peak_jerk_mm_s3,
    }
    if program is not None:
        result["stops"] = stops_dict(program.stops, program.piece_starts_mm)
    if at_s is not None:
        result["arc_length_mm"] = np.atleast_1d(plan.arc_length(at_s)).tolist()
        result["feed_mm_s"] = np.atleast_1d(plan.feed(at_s)).tolist()
    return result


def _print_feed(
    pipeline: Pipeline, plan: FeedPlan, program: Program | None, at_s: np.ndarray | None
) -> None:
    unit = pipeline.unit
    slope = "" if plan.n_c is None else f", n_c {plan.n_c:.6g} ({plan.evaluations} evaluations)"
    ramps = [] if plan.ramp_time_s is None else [("ramps", f"{number(plan.ramp_time_s)} s")]
    print_rows(
        [
            ("profile", plan.profile + slope),
            ("feed", f"{number(plan.feed_mm_s)} {unit}/s"),
            *ramps,
            ("duration", duration_text(plan.duration_s)),
            ("planned in", duration_text(pipeline.planning_s)),
            ("peak acceleration", f"{number(plan.peak_acceleration_mm_s2)} {unit}/s^2"),
            ("peak jerk", f"{number(plan.peak_jerk_mm_s3)} {unit}/s^3"),
        ]
    )
    if program is not None:
        for line in stops_text(program.stops, program.piece_starts_mm, pipeline.unit):
            print(line)
    print(f"{'limited quantity':28} {'peak':>12} {'limit':>12} {'used %':>8} {f'at {unit}':>12}")
    for name, peak in pipeline.peaks_of(plan).items():
        print(
            f"{name:28} {peak.value:12.6g} {peak.limit.given:12.6g} "
            f"{100.0 * peak.value / peak.limit.given:8.2f} {peak.s_mm:12.6g}"
        )
    if at_s is not None:
        print(f"{'t s':>12} {f'arc length {unit}':>16} {f'feed {unit}/s':>16}")
        for at, s, v in zip(at_s, plan.arc_length(at_s), plan.feed(at_s), strict=True):
            print(f"{at:12.6g} {s:16.9f} {v:16.9f}")


def _program_of(pipeline: Pipeline) -> Program | None:
    """The program, for the stops that `feed` prints; None: there is no machine, or `compile` would refuse it."""
    if pipeline.machine_or_none is None:
        return None
    try:
        return pipeline.program
    except HodographError as error:
        note(f"no program: {error}")
        return None


def compile_(options: Namespace) -> None:
    """hodograph compile."""
    require_places(options.output)
    if is_toolpath(options.file):
        pipeline = section_pipeline(options)
    else:
        refuse_toolpath_options(options, options.file)
        pipeline = load_pipeline(options.file, options.machine, allow_space=True)
    require_fit(pipeline.whole_machine)
    output = options.output or Path(pipeline.file.name + ".hdgp")
    require_places(output)
    image = pipeline.image
    print_notes(pipeline, pipeline.compilation.plan)
    write_file(output, image)
    _warn_of_size(image, pipeline.machine)
    program = pipeline.program
    if options.json:
        print_json({"file": str(output), "bytes": len(image)} | inspect_dict(program))
        return
    print(
        f"{output}: {size_text(len(image))}, {program.segment_count} segments, {program.piece_count} feed "
        f"pieces, {program.ticks} ticks of {program.period_us} us"
    )
    for line in stops_text(program.stops, program.piece_starts_mm, pipeline.unit):
        print(line)


def _warn_of_size(image: bytes, machine: Machine) -> None:
    """Warns if `upload` would refuse the program for its size."""
    needed = memory_bytes(image, RECORD_BYTES[machine.kernel])
    room, whose = machine.program_bytes, f"[controller] program_bytes of {machine.file.name}"
    if room is None:
        room, whose = LARGEST_BANK, "the largest controller there is"
    if needed > room:
        note(
            f"takes {needed} bytes of a controller with its precomputed coefficients, more than the {room} of {whose}: "
            "upload will refuse it; split the path"
        )


def decode_file(file: Path, image: bytes) -> Program:
    """The program in an image; errors name the file."""
    try:
        return decode(image)
    except InputError as error:
        raise InputError(f"{file}: {error}") from None


def inspect(options: Namespace) -> None:
    """hodograph inspect."""
    image = read_image(options.file)
    if image is None:
        program = load_pipeline(options.file, options.machine, allow_space=True).program
    else:
        program = decode_file(options.file, image)
    if not coefficients_in_range(program):
        raise InputError(f"{options.file}: {_unsound(program)}")
    try:
        with np.errstate(divide="raise", invalid="raise", over="raise"):
            found = inspect_dict(program)
            text = json_text(found) if options.json else inspect_text(program, full=options.full)
    except (ArithmeticError, ValueError) as error:
        raise InputError(f"{options.file}: {_unsound(program)}") from error
    print(text)


def _unsound(program: Program) -> str:
    """The error for commands that cannot use an image."""
    try:
        fault = check(program)
    except (ArithmeticError, ValueError):
        fault = None
    if fault is None:
        return "a number in the program image is out of range"
    return f"no program: {fault.code.text} ({fault.code.name}, code {fault.code}, {fault.place})"


def simulate_pipeline(pipeline: Pipeline, kernel: str | None, *, keep_rows: bool = True) -> Motion:
    """A run of a path without a bus. Without rows (one for each tick) its memory does not grow with time."""
    image = pipeline.image
    with progress("simulate", "tick", pipeline.program.ticks) as bar:
        return simulate_on(
            pipeline.machine,
            image,
            kernel,
            keep_rows=keep_rows,
            progress=lambda done, total: bar(done),
        )


def simulate_(options: Namespace) -> None:
    """hodograph simulate."""
    require_places(options.trace)
    if is_toolpath(options.file):
        simulate_toolpath(options)
        return
    refuse_toolpath_options(options, options.file)
    pipeline = load_pipeline(options.file, options.machine, allow_space=True)
    times = {"hold": options.hold_at, "stop": options.stop_at, "fault": options.fault_at}
    for kind, values in times.items():
        _within(f"--{kind}-at", values, last_tick_s(pipeline.program), "s")
    motion = simulate_pipeline(pipeline, options.kernel, keep_rows=options.trace is not None)
    print_notes(pipeline, pipeline.compilation.plan)
    stops = [
        _stopped(pipeline, options.kernel, kind, at_s)
        for kind, values in times.items()
        for at_s in values
    ]
    if options.trace is not None:
        write_trace(motion, options.trace)
        for stop in stops:
            name = f"{options.trace.stem}.{stop.kind}-{_shortest(stop.at_s)}{options.trace.suffix}"
            write_trace(stop.motion, options.trace.with_name(name))
    if options.json:
        print_json(motion.summary() | {"stops": [stop.summary() for stop in stops]})
        return
    print_rows(motion_rows(motion))
    if stops:
        _print_stops(stops, pipeline.unit)


def _shortest(value: float) -> str:
    """A number as a part of a file name; different numbers give different names."""
    short = f"{value:g}"
    return short if float(short) == value else repr(value)


def _stopped(pipeline: Pipeline, kernel: str | None, kind: str, at_s: float) -> StoppedRun:
    machine = pipeline.machine
    return simulate_stop(
        NativeProgram(pipeline.image),
        machine.models(machine.path_axes),
        kind,
        at_s,
        kernel=kernel or machine.kernel,
        counts_per_mm=machine.path_counts,
        feedforward=machine.path_feedforward,
        names=machine.path_names,
        units=machine.path_units,
    )


def _print_stops(stops: list[StoppedRun], unit: str) -> None:
    off = "contour um" if unit == "mm" else "mdeg"
    print(
        f"{'stop':<10} {'at s':>9} {'rest after s':>12} {'bound s':>9} {f'dist. {unit}':>9} {f'{unit}/s^2':>9} "
        f"{f'{unit}/s^3':>9} {off:>10}"
    )
    for stop in stops:
        most = {
            unit: max(value for name, value in stop.peak.items() if name.endswith(unit))
            for unit in ("acceleration_mm_s2", "jerk_mm_s3")
        }
        print(
            f"{stop.kind:<10} {_shortest(stop.at_s):>9} {stop.rest_after_s:12.6g} {stop.bound_s:9.4g} "
            f"{stop.distance_mm:9.6g} {most['acceleration_mm_s2']:9.6g} {most['jerk_mm_s3']:9.6g} "
            f"{stop.peak['contour_error_um']:10.4g}"
        )


def volts_words(motion: Motion) -> str:
    """The greatest voltage of a run, as text."""
    return "not reported by the drives" if motion.max_volts is None else f"{motion.max_volts:.3f} V"


def motion_rows(motion: Motion) -> list[tuple[str, str]]:
    """A run's results as text."""
    mdeg = motion.max_following_error_mdeg
    turning = "" if mdeg is None else f", {mdeg:.1f} mdeg"
    off = "mdeg" if motion.turns_alone else "um"
    return [
        ("ticks", f"{motion.ticks} of {motion.period_us} us, kernel {motion.kernel}"),
        ("greatest contour error", f"{motion.max_contour_error_um:.3f} {off}"),
        *_orientation_rows(motion),
        ("greatest following error", f"{motion.max_following_error_um:.1f} um{turning}"),
        ("greatest voltage", volts_words(motion)),
        ("setpoints SHA-256", motion.setpoints_sha256),
        ("encoders SHA-256", motion.encoders_sha256),
    ]


def _orientation_rows(motion: Motion) -> list[tuple[str, str]]:
    """The greatest errors of the axes after x, y, z."""
    if not motion.extra_names:
        return []
    every = zip(motion.extra_names, motion.units[3:], motion.max_orientation_error, strict=True)
    text = ", ".join(f"{name} {1000.0 * most:.3f} m{unit}" for name, unit, most in every)
    return [("greatest orientation error", text.replace("mmm", "um"))]


COMMANDS = {
    "spline": spline,
    "feed": feed,
    "compile": compile_,
    "inspect": inspect,
    "simulate": simulate_,
}
