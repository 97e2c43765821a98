# SPDX-License-Identifier: MIT
"""The program of a path file, computed once for all system tests of a process that use the same files.

System tests are about what happens to a program on a bus. Most of them compile one of a few example files, which costs
more processor time than the rest of the test. Results are kept by the whole content of path file and machine, so a test
that changes a value gets a program of its own. Commands in other processes compile as always.
"""

from __future__ import annotations

import pickle
from functools import cached_property
from typing import Any

import pytest

from hodograph.errors import HodographError
from hodograph.pipeline import Pipeline

_STEPS = ("spline_result", "spatial_spline_result", "curve", "_timed_plan", "_judged")
"""What `Pipeline` computes. All results are frozen; `_judged` has the program as the controller accepts it."""

_MOST = 200
_kept: dict[tuple[str, bytes], Any] = {}


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
            if len(_kept) >= _MOST:
                _kept.clear()
            _kept[key] = compute(pipeline)
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
