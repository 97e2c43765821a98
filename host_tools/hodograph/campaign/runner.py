# SPDX-License-Identifier: MIT
"""A campaign from its file to a table that is complete."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from .definition import Campaign
from .design import Design
from .engine import Engine, Task
from .execute import Built, Outcome, build, make_runs
from .journal import Journal
from .results import Results

BATCH_TICKS = 250_000
"""Ticks of a batch: a quarter of a second, beside which a task's own costs (a millisecond) do not count."""


def run_campaign(
    campaign: Campaign, journal: Journal, workers: Engine, progress: Callable[[int], None]
) -> Results:
    """Does what the journal does not have yet, and returns all. `progress` is called with the runs done."""
    results = journal.results
    for built in workers.results(build, _programs(campaign, journal)):
        journal.add_program(built)
    _fail_all(campaign.design, journal)
    progress(results.count)
    for outcomes in workers.results(make_runs, _batches(campaign.design, journal, workers)):
        journal.add_runs(outcomes)
        progress(results.count)
    return results


def _programs(campaign: Campaign, journal: Journal) -> Iterator[Task]:
    """What to compile: programs in the order of the design."""
    design = campaign.design
    number = 0
    for source in campaign.sources:
        for profile in design.profiles:
            for feed_mm_s in design.feeds_mm_s:
                if number not in journal.programs:
                    yield source, profile, feed_mm_s, number
                number += 1


def _span(design: Design, built: Built) -> tuple[int, int]:
    """The runs of a program: first, and first of the next."""
    first = built.number * design.program_size
    return first, first + design.program_size


def _fail_all(design: Design, journal: Journal) -> None:
    """Runs whose program there is not have all failed."""
    for built in journal.programs.values():
        missing = journal.results.missing(*_span(design, built)) if built.error else []
        if missing:
            journal.add_runs([Outcome(number, error=built.error) for number in missing])


def _batches(design: Design, journal: Journal, workers: Engine) -> Iterator[Task]:
    """Batches of runs of one program, in the order of their numbers."""
    shared = workers.share(design)
    for built in sorted(journal.programs.values(), key=lambda built: built.number):
        missing = journal.results.missing(*_span(design, built))
        if not missing:
            continue
        program = workers.share(built)
        size = max(1, BATCH_TICKS // built.ticks)
        for first in range(0, len(missing), size):
            yield shared, program, missing[first : first + size]


def default_folder(file: Path) -> Path:
    """Where results go if nobody says: beside nothing, here, by the name of the campaign file."""
    return Path(file.stem)
