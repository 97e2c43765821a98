# SPDX-License-Identifier: MIT
"""Commands that write or print results: report, paper. Started by cli/main. Reads path files or a toolpath, writes the
report, and prints to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace

from ..errors import InputError
from ..job_simulation import simulate_job
from ..names import is_toolpath
from ..pipeline import load_pipeline
from .output import print_json, progress, require_places
from .path_commands import print_notes, simulate_pipeline
from .toolpath_commands import refuse_toolpath_options, toolpath_job


def report(options: Namespace) -> None:
    """hodograph report."""
    from ..report import write_report

    require_places(folders=[options.output])
    toolpaths = [file for file in options.files if is_toolpath(file)]
    if toolpaths:
        if len(options.files) > 1:
            raise InputError(
                f"{toolpaths[0]}: a report is of one toolpath, or of path files: "
                "give one toolpath at a time, each with its own --output"
            )
        _report_of_toolpath(options)
        return
    refuse_toolpath_options(options, options.files[0])
    pipelines = [load_pipeline(file, options.machine, allow_space=True) for file in options.files]
    cases = []
    for pipeline in pipelines:
        print_notes(pipeline, pipeline.compilation.plan)
        cases.append((pipeline, simulate_pipeline(pipeline, options.kernel), None))
    print(write_report(cases, options.output))


def _report_of_toolpath(options: Namespace) -> None:
    from ..report import write_toolpath_report

    job = toolpath_job(options, options.files[0])
    with progress("simulate", "section", len(job.sections)) as bar:
        run = simulate_job(job, options.kernel, progress=lambda done, total: bar(done))
    print(write_toolpath_report(run, options.output))


def paper(options: Namespace) -> None:
    """hodograph paper."""
    from ..paper import compare, comparison_text

    comparison = compare()
    if options.json:
        print_json(comparison)
    else:
        print(comparison_text(comparison))


COMMANDS = {"report": report, "paper": paper}
