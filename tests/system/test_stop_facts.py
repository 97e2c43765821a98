# SPDX-License-Identifier: MIT
"""compile, inspect, feed and status give the same longest stops of a program. Run by pytest; starts a controller and
drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from bench import EXAMPLES, MakeBench
from hodograph.cli.main import main

PROGRAMS = [("alpha", "paper_alpha"), ("heart_optimal", "paper_heart")]


def result(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    capsys.readouterr()
    assert main(arguments) == 0
    return json.loads(capsys.readouterr().out)


def text(capsys: pytest.CaptureFixture[str], *arguments: str) -> list[str]:
    """What is printed, each line with single spaces."""
    capsys.readouterr()
    assert main(arguments) == 0
    return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


@pytest.mark.parametrize(("name", "machine"), PROGRAMS)
def test_four_commands_say_the_same(
    make_bench: MakeBench,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    name: str,
    machine: str,
) -> None:
    make_bench(file=EXAMPLES / "machines" / f"{machine}.toml")
    file, image = str(EXAMPLES / f"{name}.toml"), str(tmp_path / "program.hdgp")
    compiled = result(capsys, "compile", file, "-o", image, "--json")["stops"]
    assert result(capsys, "inspect", image, "--json")["stops"] == compiled
    assert result(capsys, "feed", file, "--json")["stops"] == compiled
    empty = result(capsys, "status", "--json")["program"]["stops"]
    assert {value for kind in empty.values() for value in kind.values()} == {0}
    assert not any(line.startswith("fault stop") for line in text(capsys, "status"))
    assert main(["upload", image]) == 0
    loaded = result(capsys, "status", "--json")["program"]["stops"]
    assert set(loaded) == set(compiled) == {"hold", "fault"}
    for kind, stop in compiled.items():
        assert loaded[kind]["at_mm"] == pytest.approx(stop.pop("at_mm"), abs=0.0005)
        assert {key: loaded[kind][key] for key in stop} == pytest.approx(stop, rel=1e-12)
    for command in (("compile", file, "-o", image), ("inspect", image), ("feed", file)):
        lines = text(capsys, *command)
        for kind, words in (("hold", "hold, stop at most"), ("fault", "fault stop at most")):
            reported = f"{words} {compiled[kind]['time_s']:.4g} s and"
            assert any(line.startswith(reported) for line in lines), command
    lines = text(capsys, "status")
    assert any(f"hold, stop at most {compiled['hold']['time_s']:.4g} s" in line for line in lines)
    assert any(f"fault stop at most {compiled['fault']['time_s']:.4g} s" in line for line in lines)
