# SPDX-License-Identifier: MIT
"""Commands on toolpaths of other programs: import, and simulate of such a file. Started by cli/main; other commands use
its functions. Reads toolpath and machine files, writes tables and TOML files, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace
from dataclasses import asdict
from enum import Enum
from pathlib import Path

import tomlkit

from ..config import load_machine
from ..errors import InputError
from ..job import DEFAULT_TOLERANCE_MM, Job, JobSection, load_job
from ..job_simulation import simulate_job, write_job_trace
from ..names import TOOLPATH_SUFFIXES, is_toolpath
from ..pipeline import Pipeline
from ..toolpath.files import ReadOptions, asked_tolerance_mm
from ..toolpath.moves import Command
from .output import note, number, print_json, print_rows, progress, require_places, write_file

_OPTIONS = (
    "tolerance",
    "feed",
    "feed_of",
    "layer",
    "id",
    "gap",
    "lift",
    "scale",
    "unit",
    "columns",
    "noise",
    "closed",
    "block_delete",
    "skip_optional_stops",
)


def refuse_toolpath_options(options: Namespace, file: Path) -> None:
    """Raises InputError: options of toolpaths are given with a path file."""
    for name in _OPTIONS:
        if getattr(options, name) not in (None, [], (), False):
            raise InputError(
                f"{file}: --{name.replace('_', '-')} is for toolpaths, not for path files: leave it out"
            )


def toolpath_job(options: Namespace, file: Path) -> Job:
    """The job of a file on options.machine, its notes on stderr. Raises InputError: no machine."""
    if options.machine is None:
        raise InputError(f"{file}: a toolpath names no machine: add --machine FILE")
    machine = load_machine(options.machine)
    job = load_job(file, machine, tolerance_of(options), reading_of(options))
    for line in job.notes:
        note(line)
    return job


def tolerance_of(options: Namespace) -> float:
    """The tolerance of a toolpath from the command line, in mm."""
    given: float | None = options.tolerance
    least = DEFAULT_TOLERANCE_MM if given is None else given
    return asked_tolerance_mm(least, reading_of(options))


def reading_of(options: Namespace) -> ReadOptions:
    """The reading options of a toolpath from the command line."""
    return ReadOptions(
        feed_mm_s=options.feed,
        feeds=tuple(options.feed_of),
        layers=tuple(options.layer),
        ids=tuple(options.id),
        gap_mm=options.gap,
        lift_mm=options.lift,
        scale=options.scale,
        unit_mm=options.unit,
        columns=options.columns,
        noise_mm=options.noise,
        closed=options.closed,
        block_delete=options.block_delete,
        skip_optional_stops=options.skip_optional_stops,
    )


def require_toolpath(file: Path) -> None:
    """Raises InputError: the name of a file is not that of a toolpath."""
    if not is_toolpath(file):
        raise InputError(
            f"{file}: no toolpath by the end of its name: rename it to end in one of "
            f"{' '.join(TOOLPATH_SUFFIXES)}, or give - for G-code from standard input"
        )


def section_pipeline(options: Namespace) -> Pipeline:
    """The pipeline of a toolpath that is one section. Raises PlanError: it has several."""
    return toolpath_job(options, options.file).only_section(str(options.command)).pipeline


def simulate_toolpath(options: Namespace) -> None:
    """hodograph simulate of a toolpath."""
    for kind in ("hold", "stop", "fault"):
        if getattr(options, f"{kind}_at"):
            raise InputError(
                f"--{kind}-at: is for path files; a toolpath runs from its start to its end"
            )
    job = toolpath_job(options, options.file)
    with progress("simulate", "section", len(job.sections)) as bar:
        run = simulate_job(
            job,
            options.kernel,
            keep_rows=options.trace is not None,
            progress=lambda done, total: bar(done),
        )
    if options.trace is not None:
        write_job_trace(run, options.trace)
    if options.json:
        print_json(run.summary())
        return
    print_rows(
        [
            *job_rows(job),
            ("duration", f"{number(run.duration_s)} s, {run.ticks} ticks, without dwells"),
            ("planned in", f"{run.planning_s:.3g} s, fitted in {job.fit_s:.3g} s"),
        ]
    )


def import_(options: Namespace) -> None:
    """hodograph import."""
    require_toolpath(options.file)
    require_places(options.output)
    job = toolpath_job(options, options.file)
    found = imported(job)
    if options.output is not None:
        write_file(options.output, tomlkit.dumps(found).encode())
    if options.json:
        print_json(found)
    elif options.output is None:
        print_rows(
            [*job_rows(job), ("duration", f"{number(sum(map(_duration_s, job.sections)))} s")]
        )
        print(
            f"{'section':>8} {'lines':>15} {'length mm':>12} {'segments':>9} {'bound um':>9} {'s':>9}"
        )
        for k, one in enumerate(job.sections, start=1):
            print(
                f"{k:8} {f'{one.first_line} … {one.last_line}':>15} {number(one.length_mm):>12} "
                f"{one.fitted.curve.segment_count:9} {one.deviation_um:9.3f} "
                f"{number(_duration_s(one)):>9}"
            )


def job_rows(job: Job) -> list[tuple[str, str]]:
    """The figures of a toolpath as text."""
    return [
        (
            "toolpath",
            f"lines that move: {job.lines}, sections from rest to rest: {len(job.sections)}",
        ),
        ("curves", f"{job.segments} PH segments, {number(job.length_mm)} mm"),
        ("deviation", f"below {job.deviation_um:.3f} um, certified"),
        ("dwells", f"{number(job.dwell_s)} s"),
    ]


def _duration_s(section: JobSection) -> float:
    return section.pipeline.plan.duration_s


def imported(job: Job) -> dict[str, object]:
    """A job for JSON and TOML: its figures, its sections, and its commands with their places."""
    sections = [
        {
            "first_line": one.first_line,
            "last_line": one.last_line,
            "tolerance_mm": one.tolerance_mm,
            "length_mm": one.length_mm,
            "segments": one.fitted.curve.segment_count,
            "deviation_bound_um": one.deviation_um,
            "duration_s": _duration_s(one),
        }
        | one.turning_summary
        for one in job.sections
    ]
    events = [
        {"section": k} | _event(command) | ({} if at is None else {"at_mm": at})
        for k, one in enumerate(job.sections, start=1)
        for at, command in [*((None, c) for c in one.before), *one.events]
    ]
    last = [{"section": len(sections) + 1} | _event(command) for command in job.after]
    return {
        "file": str(job.file),
        **job.summary(),
        "duration_s": sum(map(_duration_s, job.sections)),
        "notes": list(job.notes),
        "section": sections,
        "event": [*events, *last],
    }


def _event(command: Command) -> dict[str, object]:
    own = {
        name: value.name.lower() if isinstance(value, Enum) else value
        for name, value in asdict(command).items()
    }
    return {"command": type(command).__name__, **own}


COMMANDS = {"import": import_}
