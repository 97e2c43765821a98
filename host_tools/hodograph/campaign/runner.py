# SPDX-License-Identifier: MIT
"""Executes a campaign and makes its complete table, with one of three engines: this process, the cores of this
computer, or a cluster (the last two by Dask). Used by cli/campaign_command. Starts processes or connects to a cluster,
writes the journal, and changes the handler of Ctrl-C while it runs.

Dask is an optional dependency and takes half a second to load, so it is loaded only here and only if needed.
"""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from multiprocessing.resource_tracker import ensure_running
from pathlib import Path
from threading import current_thread, main_thread
from types import FrameType
from typing import Any, Protocol, TypeVar

from .. import __version__
from ..errors import InputError, RunError, one_line
from .definition import Campaign
from .execute import Built, Outcome, build, make_runs
from .results import Journal, Results
from .run_settings import Design

T = TypeVar("T")
Task = tuple[Any, ...]

AHEAD = 4
"""Tasks in the queue of each worker: no worker waits for this process, and few tasks are lost by an interruption."""
ANSWER_S, WORKER_S = 10, 60
"""How long to wait for a scheduler, and for its first worker."""


class Engine(Protocol):
    """An engine: executes tasks in this process or elsewhere."""

    def share(self, value: object) -> Any:
        """A reference to `value` for tasks; the value is sent to each worker once."""

    def results(self, function: Callable[..., T], tasks: Iterable[Task]) -> Iterator[T]:
        """The results of `function` for each task, as they are finished, in any order."""


class Here:
    """In this process, one after the other."""

    def share(self, value: object) -> Any:
        """The value itself."""
        return value

    def results(self, function: Callable[..., T], tasks: Iterable[Task]) -> Iterator[T]:
        """One by one."""
        return (function(*task) for task in tasks)


class OnDask:
    """By a Dask client."""

    def __init__(self, client: Any) -> None:
        self._client = client

    def share(self, value: object) -> Any:
        """A task that gives it: workers get it from one another, or again from the scheduler when one is lost."""
        return self._client.submit(_same, value, pure=False)

    def results(self, function: Callable[..., T], tasks: Iterable[Task]) -> Iterator[T]:
        """The results as they are finished, with few tasks ahead. Raises RunError: workers are lost repeatedly."""
        dask = _dask()
        waiting = iter(tasks)
        ahead = AHEAD * max(1, len(self._client.scheduler_info(n_workers=-1)["workers"]))
        with _interruptions() as take:
            running = dask.as_completed(self._submit(function, waiting, ahead))
            for future in running:
                take()
                try:
                    result = future.result()
                except dask.KilledWorker as error:
                    raise RunError(
                        f"campaign: workers died over the same task ({one_line(error)}): check their memory and "
                        "their logs; given again, the command goes on where it was"
                    ) from None
                running.update(self._submit(function, waiting, 1))
                yield result

    def _submit(self, function: Callable[..., T], tasks: Iterator[Task], most: int) -> list[Any]:
        return [
            self._client.submit(function, *task, pure=False)
            for _, task in zip(range(most), tasks, strict=False)
        ]


def _same(value: T) -> T:
    return value


def available_cores() -> int:
    """The cores that this process may use."""
    return len(os.sched_getaffinity(0))


@contextmanager
def engine(workers: int, scheduler: str | None) -> Iterator[Engine]:
    """An engine on so many cores of this machine, or on the cluster of a Dask scheduler.

    Raises InputError: Dask is not installed, no scheduler answers, or its workers cannot do this work.
    """
    if scheduler is None and workers == 1:
        yield Here()
        return
    with _cluster(scheduler) if scheduler is not None else _local(workers) as client:
        yield OnDask(client)


def _dask() -> Any:
    """The module. Raises InputError: it is not installed."""
    try:
        return import_module("distributed")
    except ImportError:
        raise InputError(
            "campaign: needs Dask, which is not installed: pip install 'hodograph[campaign]', "
            "or use --workers 1 for one core without it"
        ) from None


_ANY_LOCAL_PORT = "127.0.0.1:0"
"""Of the scheduler's web server. Without it Dask takes port 8787 of all interfaces, and warns if it is in use."""


@contextmanager
def _local(workers: int) -> Iterator[Any]:
    dask = _dask()
    with _interrupts_ignored_by_children():
        cluster = dask.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=_ANY_LOCAL_PORT,
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,
        )
    with cluster, dask.Client(cluster) as client:
        yield client


@contextmanager
def _interrupts_ignored_by_children() -> Iterator[None]:
    """Processes begun inside ignore Ctrl-C, which terminals send to all; this process ends them.

    The signal is blocked for all threads and processes begun inside. The resource tracker has to run before, because
    starting it unblocks the signal.
    """
    ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _interruptions() -> Iterator[Callable[[], None]]:
    """Defers Ctrl-C until the result is called: inside Dask it could leave a lock held for which closing then waits. A
    second Ctrl-C takes effect at once.
    """
    asked = False

    def ask(_number: int, _frame: FrameType | None) -> None:
        nonlocal asked
        if asked:
            raise KeyboardInterrupt
        asked = True

    def take() -> None:
        if asked:
            raise KeyboardInterrupt

    if current_thread() is not main_thread():  # only the main thread gets signals
        yield take
        return
    before = signal.signal(signal.SIGINT, ask)
    try:
        yield take
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _cluster(address: str) -> Iterator[Any]:
    dask = _dask()
    try:
        client = dask.Client(address, timeout=ANSWER_S)
    except (OSError, ValueError) as error:
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers ({one_line(error)}): start one by `dask scheduler`, "
            "and `dask worker ADDRESS` on each machine"
        ) from None
    with client:
        _check_workers(client, address)
        yield client


def _check_workers(client: Any, address: str) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKER_S)
        found = client.run(version)
    except TimeoutError:
        raise InputError(
            f"--scheduler {address}: has no workers: start some by `dask worker {address}`"
        ) from None
    except ImportError as error:
        raise InputError(
            f"--scheduler {address}: a worker cannot load hodograph ({one_line(error)}): install it there"
        ) from None
    others = {worker: theirs for worker, theirs in found.items() if theirs != __version__}
    if others:
        worker, theirs = next(iter(others.items()))
        raise InputError(
            f"--scheduler {address}: worker {worker} has hodograph {theirs}, here is {__version__}: install the same"
        )


def version() -> str:
    """Of Hodograph, as a worker has it."""
    return __version__


BATCH_TICKS = 250_000
"""Ticks of a batch: about a quarter of a second, compared with which the cost of a task (a millisecond) is small."""


def run_campaign(
    campaign: Campaign, journal: Journal, workers: Engine, progress: Callable[[int], None]
) -> Results:
    """Executes the programs and runs that the journal lacks, and returns all results. `progress` is called with the
    number of finished runs.
    """
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
    """Marks all runs of programs that could not be made as failed."""
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
    """The default folder for results: in the current folder, with the name of the campaign file."""
    return Path(file.stem)
