# SPDX-License-Identifier: MIT
"""Runs of the tests over and over: another verdict in one of them is seen, and each mode is what it says. Run by
pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

import pytest

import repeat_tests
from repeat_tests import main

SOUND = ["sh", "-c", "echo 5 passed, 0 failed"]


def run(folder: Path, *words: str) -> int:
    return main(["--out", str(folder), *words])


def test_runs_with_the_same_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(tmp_path, "--runs", "3", *SOUND) == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[-1] == "3 runs, the same verdict: 5 passed, 0 failed"
    assert [line.split()[1] for line in lines[-4:-1]] == ["idle", "busy", "one-core"]
    assert sorted(log.name for log in tmp_path.iterdir()) == [
        "01-idle.log",
        "02-busy.log",
        "03-one-core.log",
    ]


def test_one_run_with_another_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    once = tmp_path / "once"
    script = f"mkdir {once} && echo 5 passed, 0 failed || echo 4 passed, 0 failed"
    assert run(tmp_path, "--runs", "2", "--modes", "idle", "sh", "-c", script) == 1
    assert "2 different verdicts: 4 passed, 0 failed; 5 passed, 0 failed" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo failed: a test; echo 5 passed, 1 failed; exit 1", "failed: a test"),
        ("echo 5 passed, 0 failed; exit 1", "1 runs, the same verdict: 5 passed, 1 failed"),
        ("exit 0", "0 passed, 1 failed"),  # no count
    ],
)
def test_a_failure(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], script: str, said: str
) -> None:
    assert run(tmp_path, "--runs", "1", "sh", "-c", script) == 1
    assert said in capsys.readouterr().out


def test_one_core_is_one_core(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = "import os; print(len(os.sched_getaffinity(0)), 'passed, 0 failed')"
    assert run(tmp_path, "--runs", "1", "--modes", "one-core", sys.executable, "-c", script) == 0
    assert capsys.readouterr().out.endswith(": 1 passed, 0 failed\n")


def test_busy_processes_live_as_long_as_the_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(repeat_tests.shutil, "which", lambda _: None)
    before = {
        child
        for file in Path(f"/proc/{os.getpid()}/task").glob("*/children")
        for child in file.read_text().split()
    }
    script = f"echo $(cat /proc/{os.getpid()}/task/*/children); echo 5 passed, 0 failed"
    assert run(tmp_path, "--runs", "1", "--modes", "busy", "sh", "-c", script) == 0
    children = set((tmp_path / "01-busy.log").read_text().split("\n")[0].split()) - before
    assert len(children) == repeat_tests.BUSY_PROCESSES + 1  # and the run itself
    assert not any(Path(f"/proc/{child}").exists() for child in children)


def test_an_unknown_mode(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        run(tmp_path, "--modes", "idle asleep")
    assert "no mode asleep; there are idle, busy, one-core" in capsys.readouterr().err
