# SPDX-License-Identifier: MIT
"""Goals of `make bench` beside figures. Run by pytest; writes to temporary folders."""

from __future__ import annotations

import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from bench_goals import goal_lines, judged  # noqa: E402

FILE = """
[[goal]]
text = "few"
figure = ["one", "*", "errors"]
at_most = 2

[[goal]]
text = "many"
figure = ["one", "a", "runs"]
at_least = 10
load = true

[[goal]]
text = "equal"
figure = ["two", "same"]
is = true

[[goal]]
text = "elsewhere"
figure = ["three", "x"]
at_most = 1
"""


def test_the_worst_of_the_figures_counts(tmp_path: Path) -> None:
    file = tmp_path / "goals.toml"
    file.write_text(FILE)
    figures = {
        "one": {"a": {"errors": 1, "runs": 9.5}, "b": {"errors": 2}, "c": {"errors": None}},
        "two": {"same": True},
    }
    assert [(j.text, j.found, j.kept) for j in judged(file, figures)] == [
        ("few", "2", True),
        ("many", "9.5", False),
        ("equal", "yes", True),
        ("elsewhere", "-", None),
    ]
    figures["one"]["b"]["errors"] = 2.1
    figures["two"]["same"] = False
    found = judged(file, figures)
    assert [j.verdict for j in found] == [
        "MISSED",
        "missed (a time: look at the load)",
        "MISSED",
        "not measured",
    ]
    lines = goal_lines(found)
    assert len(lines) == 5
    assert lines[1].split() == ["few", "at", "most", "2", "2.1", "MISSED"]


def test_every_goal_is_of_a_benchmark_that_is_there() -> None:
    folder = ROOT / "benchmarks"
    found = judged(folder / "goals.toml", {})
    assert len(found) > 20
    assert {j.kept for j in found} == {None}
    text = (folder / "goals.toml").read_text()
    names = {line.split('"')[1] for line in text.splitlines() if line.startswith("figure")}
    assert all((folder / f"{name}.py").exists() for name in names)
