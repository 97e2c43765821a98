# SPDX-License-Identifier: MIT
"""hodograph run: path files and toolpaths on the bus. Started by cli/main. Reads files, may start processes, moves the
axes, writes recordings, tables and reports, and prints to stdout and stderr.
"""

from __future__ import annotations

import sys
from argparse import Namespace
from pathlib import Path
from typing import Any

from ..bus.address import BusAddress
from ..bus.capture.recordings import check_suffix
from ..bus.own_bus import opened_bus
from ..bus.run import BusRun, run_program
from ..bustime import require_fit
from ..errors import BusError, InputError
from ..job_run import JobRun, NoRoomError, PreparedJob, operator_stops, prepared, run_job
from ..job_simulation import write_job_trace
from ..names import is_toolpath
from ..pipeline import Pipeline, load_pipeline, start_counts
from ..simulate import write_trace
from .bus_session import await_enter, pass_stop, session
from .motion_commands import print_run
from .output import duration_text, note, number, print_json, print_rows, progress, require_places
from .path_commands import print_notes
from .stream_command import has_paths, stream_on
from .toolpath_commands import job_rows, refuse_toolpath_options, toolpath_job

Task = Pipeline | PreparedJob
"""The prepared run of a FILE: a path file's program, or the programs of a toolpath."""


def run(options: Namespace) -> None:
    """hodograph run."""
    _check_outputs(options)
    with opened_bus(options.bus, note, None if options.pace == "fast" else 1.0) as address:
        _run_all(options, address)


def _run_all(options: Namespace, address: BusAddress) -> None:
    if not address.is_raw:
        raise BusError(
            f"{address}: run records at full bus load, which takes SocketCAN: use socketcan:CHANNEL "
            "(slcand makes one of a serial adapter)"
        )
    if len(options.files) == 1 and has_paths(options.files[0]):
        if any((options.trace, options.report)):
            raise InputError(
                f"{options.files[0]}: --trace and --report take one path: a list of paths is streamed"
            )
        refuse_toolpath_options(options, options.files[0])
        stream_on(options, address)
        return
    try:
        tasks = [_task(options, file) for file in options.files]
    except NoRoomError as error:
        if len(options.files) > 1 or any((options.trace, options.report)):
            raise
        note(f"{error}: it is streamed")
        stream_on(options, address)
        return
    runs = [_run_one(task, address, options) for task in tasks]
    _print_runs(options, runs)
    if options.trace is not None:
        _write_trace(runs[0], options.trace)
    if options.report is not None:
        _write_report(tasks, runs, options.report)


def _print_runs(options: Namespace, runs: list[BusRun | JobRun]) -> None:
    """Prints the results before files are written, which may fail: the motion cannot be repeated exactly."""
    if options.json:
        _print_json(options.files, runs)
        return
    for file, found in zip(options.files, runs, strict=True):
        if isinstance(found, BusRun):
            print_run(str(file), found)
        else:
            _print_job_run(str(file), found)


def _check_outputs(options: Namespace) -> None:
    """Raises InputError: an output file cannot be written."""
    if options.trace is not None and len(options.files) > 1:
        raise InputError("--trace: takes one FILE; run the others by themselves")
    if options.record is not None:
        check_suffix(options.record)
        if len(options.files) > 1:
            raise InputError("--record: takes one FILE; run the others by themselves")
    if options.report is not None:
        for file in filter(is_toolpath, options.files):
            raise InputError(f"{file}: --report takes path files only: use --trace and --json")
    require_places(options.trace, options.record, folders=[options.report])


def _task(options: Namespace, file: Path) -> Task:
    """Prepares all files, so that each error of the input is found before anything moves."""
    if not is_toolpath(file):
        refuse_toolpath_options(options, file)
        if options.no_stops:
            raise InputError(f"{file}: --no-stops is for toolpaths, not for path files")
        pipeline = load_pipeline(file, options.machine, allow_space=True)
        require_fit(pipeline.whole_machine)
        pipeline.image  # noqa: B018
        return pipeline
    job = toolpath_job(options, file)
    require_fit(job.machine)
    if not options.no_stops and not sys.stdin.isatty():
        for line, code in operator_stops(job):
            raise InputError(
                f"{file}:{line}: {code} waits for the operator, and standard input is no terminal: "
                "add --no-stops to go on without waiting"
            )
    return prepared(job, options.kernel or job.machine.kernel)


def _run_one(task: Task, address: BusAddress, options: Namespace) -> BusRun | JobRun:
    if isinstance(task, PreparedJob):
        with (
            session(task.job.machine, address, options) as at,
            progress(f"run {task.job.file.name}", "tick", task.ticks) as bar,
        ):
            operator = pass_stop if options.no_stops else await_enter
            return run_job(at, task, operator, bar, options.record, unhomed=options.unhomed)
    machine = task.machine
    print_notes(task, task.compilation.plan)
    with (
        session(task.whole_machine, address, options) as at,
        progress(f"run {task.file.name}", "tick", task.program.ticks) as bar,
    ):
        kernel = options.kernel or machine.kernel
        return run_program(
            *(at, machine, task.image, kernel, bar, options.record),
            unhomed=options.unhomed,
            on=task.whole_machine,
            start=start_counts(task, kernel),
        )


def _write_trace(found: BusRun | JobRun, file: Path) -> None:
    if isinstance(found, BusRun):
        write_trace(found.motion, file)
    else:
        write_job_trace(found.motion, file)


def _write_report(tasks: list[Task], runs: list[BusRun | JobRun], folder: Path) -> None:
    from ..report import write_report

    cases = [
        (task, found.motion, found)
        for task, found in zip(tasks, runs, strict=True)
        if isinstance(task, Pipeline) and isinstance(found, BusRun)
    ]
    note(f"report: {write_report(cases, folder)}")


def _print_json(files: list[Path], runs: list[BusRun | JobRun]) -> None:
    results: list[dict[str, Any]] = [found.summary() for found in runs]
    if len(results) == 1:
        print_json(results[0])
    else:
        print_json([{"file": str(f)} | found for f, found in zip(files, results, strict=True)])


def _print_job_run(title: str, found: JobRun) -> None:
    """A job's results as text."""
    motion = found.motion
    wall_s = sum(one.wall_s for one in found.runs)
    frames = sum(one.frames for one in found.runs)
    errors_um = max(one.motion.max_contour_error_um for one in found.runs)
    rows = [
        ("bus", f"{found.runs[0].bus}, pace {found.runs[0].pace}, {frames} frames"),
        ("time", f"{duration_text(wall_s)} for {duration_text(motion.duration_s)} of motion"),
        ("deadline misses", str(sum(one.deadline_misses or 0 for one in found.runs))),
        *job_rows(motion.job),
        ("greatest contour error", f"{errors_um:.3f} um"),
    ]
    print(title)
    print_rows([(f"  {name}", value) for name, value in rows])
    print(f"{'section':>8} {'lines':>15} {'s':>9} {'contour um':>11}  setpoints SHA-256")
    for k, (section, one) in enumerate(zip(motion.job.sections, found.runs, strict=True), 1):
        lines = f"{section.first_line} … {section.last_line}"
        own = one.motion
        print(
            f"{k:8} {lines:>15} {number(own.ticks * own.period_us / 1e6):>9} "
            f"{own.max_contour_error_um:11.3f}  {own.setpoints_sha256}"
        )


COMMANDS = {"run": run}
