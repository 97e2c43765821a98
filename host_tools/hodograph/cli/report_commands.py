# SPDX-License-Identifier: MIT
"""Commands that write or print results: report, paper."""

from __future__ import annotations

from argparse import Namespace

from ..pipeline import load_pipeline
from .output import print_json
from .path_commands import print_notes, simulate_pipeline


def report(options: Namespace) -> None:
    """hodograph report."""
    from ..report import write_report

    pipelines = [load_pipeline(file, options.machine, allow_space=True) for file in options.files]
    cases = []
    for pipeline in pipelines:
        print_notes(pipeline, pipeline.plan)
        cases.append((pipeline, simulate_pipeline(pipeline, options.kernel), None))
    print(write_report(cases, options.output))


def paper(options: Namespace) -> None:
    """hodograph paper."""
    from ..paper import compare, comparison_text

    comparison = compare()
    if options.json:
        print_json(comparison)
    else:
        print(comparison_text(comparison))


COMMANDS = {"report": report, "paper": paper}
