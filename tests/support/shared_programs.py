# SPDX-License-Identifier: MIT
"""Programs that are computed once for all tests of a process. Used by conftest.py of several folders and by
program/test_stop_planning. While tests run it replaces `plan_stops` of hodograph.program.compiler and steps of
`Pipeline`, and keeps up to 200 results in memory; `MonkeyPatch` restores the replaced functions. No I/O of its own.

Most tests of a program's motion compile one of a few example files, which costs more processor time than the rest of
the test. Commands that a test starts as processes are not affected.

- `stops_planned_once`, a fixture for the conftest.py of a folder: `compile_path` plans the stops of a motion once.
  Planning the stops takes nine tenths of the time of `compile_path`. The key of a stored result is everything that
  determines it: the program image without name and events, the limits for holds and for fault stops, and the settings
  of StopTerms.
- `share_programs`, for system tests: a `Pipeline` computes each of its steps once. The key of a result is the whole
  content of path file and machine file. So a test that changes a value does not get another test's program.
"""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property
from typing import Any

import pytest

from hodograph.errors import HodographError
from hodograph.events import no_events
from hodograph.feed import FeedPlan
from hodograph.pipeline import Pipeline
from hodograph.program import Program, compiler, encode
from hodograph.program.stop_planning import StopTerms, fault_limits, hold_limits, plan_stops

_STEPS = ("spline_result", "spatial_spline_result", "curve", "_timed_plan", "_judged")
"""What `Pipeline` computes. All results are frozen; `_judged` has the program as the controller accepts it."""

_MOST = 200
_kept: dict[tuple[str, bytes], Any] = {}


@pytest.fixture(scope="module")
def stops_planned_once() -> Iterator[None]:
    """While the tests of a file run, stops that were planned in this process are not planned again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiler, "plan_stops", _stops)
        yield


@pytest.fixture(autouse=True, scope="module")
def all_stops_planned_once(stops_planned_once: None) -> None:
    """`stops_planned_once` in all tests of the folder whose conftest.py imports both."""


def _stops(program: Program, plan: FeedPlan, terms: StopTerms) -> Program:
    motion = replace(program, name="", events=no_events())
    limits = hold_limits(plan, terms), fault_limits(plan, terms)
    key = (
        "stops",
        pickle.dumps((encode(motion), limits, terms.stop_time_ms, terms.quick, terms.only_fault)),
    )
    if key not in _kept:
        _keep(key, plan_stops(motion, plan, terms))
    return replace(_kept[key], name=program.name, events=program.events)


def _keep(key: tuple[str, bytes], result: Any) -> None:
    if len(_kept) >= _MOST:
        _kept.clear()
    _kept[key] = result


def share_programs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Until the end of a test, `Pipeline` takes results from those that other tests have computed."""
    for step in _STEPS:
        made = cached_property(_shared(step, Pipeline.__dict__[step].func))
        made.__set_name__(Pipeline, step)
        monkeypatch.setattr(Pipeline, step, made)


def _shared(step: str, compute: Any) -> Any:
    def result(pipeline: Pipeline) -> Any:
        key = _key(step, pipeline)
        if key is None:
            return compute(pipeline)
        if key not in _kept:
            _keep(key, compute(pipeline))
        return _kept[key]

    return result


def _key(step: str, pipeline: Pipeline) -> tuple[str, bytes] | None:
    """The step and the content of both files; None for a pipeline of another kind, or one without its machine."""
    if type(pipeline) is not Pipeline:
        return None
    try:
        return step, pickle.dumps((pipeline.file, pipeline.machine_or_none))
    except HodographError:
        return None
