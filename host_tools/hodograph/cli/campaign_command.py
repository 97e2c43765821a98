# SPDX-License-Identifier: MIT
"""hodograph campaign: many simulated runs, one table. Started by cli/main. Reads the campaign file, starts processes,
writes files, and prints to stdout and stderr.
"""

from __future__ import annotations

import io
from argparse import Namespace
from pathlib import Path

from ..campaign.definition import Campaign, load_campaign
from ..campaign.results import Results, journal, write_csv
from ..campaign.runner import available_cores, default_folder, engine, run_campaign
from ..campaign.summary import groups, text
from ..errors import InputError, RunError
from .output import note, print_json, progress, write_file


def campaign(options: Namespace) -> None:
    """Makes the missing runs, writes table and report. Raises RunError: no run succeeds."""
    workers = options.workers or available_cores()
    if options.scheduler is not None and options.workers is not None:
        raise InputError(
            "--workers is about this machine, --scheduler about a cluster: give one of them"
        )
    asked = load_campaign(options.file)
    folder: Path = options.output or default_folder(asked.file)
    total = asked.design.total
    with journal(folder, asked.fingerprint, total, fresh=options.fresh) as made:
        before = made.results.count
        if before:
            note(f"{folder}: {before} of {total} runs are done: going on")
        if before < total:
            with (
                engine(workers, options.scheduler) as somewhere,
                progress("campaign", "run", total) as bar,
            ):
                run_campaign(asked, made, somewhere, bar)
        _write(asked, made.results, folder)
    _print_results(asked, made.results, folder, json=options.json)


def _write(asked: Campaign, results: Results, folder: Path) -> None:
    from ..campaign.report import write_report

    stream = io.StringIO()
    write_csv(asked.design, results, stream)
    write_file(folder / "runs.csv", stream.getvalue().encode())
    write_report(asked, results, folder)


def _print_results(asked: Campaign, results: Results, folder: Path, *, json: bool) -> None:
    found = groups(asked.design, results)
    if json:
        print_json(
            {
                "folder": str(folder),
                "runs": asked.design.total,
                "failed": len(results.errors),
                "groups": [group.as_dict() for group in found],
            }
        )
    else:
        print(text(found))
        print(
            f"{folder / 'runs.csv'}: {asked.design.total} runs; figures: {folder / 'report.html'}"
        )
    if results.errors:
        number, error = min(results.errors.items())
        message = f"{len(results.errors)} of {asked.design.total} runs failed, the first is run {number}: {error}"
        if len(results.errors) == asked.design.total:
            raise RunError(message)
        note(message)


COMMANDS = {"campaign": campaign}
