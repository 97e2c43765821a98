# SPDX-License-Identifier: MIT
"""Where the work is done: in this process, on this machine's cores or on a cluster; the last two by Dask.

Dask is loaded only here and only when it is asked for: it takes half a second, and is an extra of the package.
"""

from __future__ import annotations

import logging
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from importlib import import_module
from multiprocessing.resource_tracker import ensure_running
from threading import current_thread, main_thread
from types import FrameType
from typing import Any, Protocol, TypeVar

from .. import __version__
from ..errors import InputError, RunError, one_line

T = TypeVar("T")
Task = tuple[Any, ...]

AHEAD = 4
"""Tasks given out for each worker, so that none waits for us and few are lost by an interruption."""
ANSWER_S, WORKER_S = 10, 60
"""How long to wait for a scheduler, and for its first worker."""


class Engine(Protocol):
    """Makes calls somewhere."""

    def share(self, value: object) -> Any:
        """What stands for `value` in tasks; it is sent to each worker once."""

    def results(self, function: Callable[..., T], tasks: Iterable[Task]) -> Iterator[T]:
        """`function` of each task, as they are done, in any order."""


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
        """As they are done, with few ahead. Raises RunError when workers are lost again and again."""
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
                        f"campaign: workers died over the same task ({one_line(error)}): look at their memory and "
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


@contextmanager
def _local(workers: int) -> Iterator[Any]:
    dask = _dask()
    with _deaf_children():
        cluster = dask.LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
        )
    with cluster, dask.Client(cluster) as client:
        yield client


@contextmanager
def _deaf_children() -> Iterator[None]:
    """Processes begun inside take no notice of Ctrl-C, which terminals send to all: we end them ourselves.

    The signal is blocked for all threads and processes begun meanwhile; the resource tracker has to be there before,
    because starting it unblocks the signal.
    """
    ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _interruptions() -> Iterator[Callable[[], None]]:
    """Ctrl-C counts where the result is called: inside Dask it could leave a lock held that closing then waits for.

    A second one counts at once.
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

    if current_thread() is not main_thread():  # nobody else gets signals
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
        _look_at_workers(client, address)
        yield client


def _look_at_workers(client: Any, address: str) -> None:
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
