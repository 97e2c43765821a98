# SPDX-License-Identifier: MIT
"""`hodograph stream --from-line` and `--from`: the axes have to stand there. Run by pytest; starts a controller and
drives on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import pytest

from bench import EXAMPLES, MakeBench
from hodograph.bus.sdo.stream_channel import ENDED, stream_status
from hodograph.cli.main import main

MILL = EXAMPLES / "machines" / "mill.toml"
JOB = "F6000\nG1 X12\nG4 P0.1\nG1 Y9\nG4 P0.1\nG1 X0 Y0 Z-3\nM2\n"
COUNTS_PER_MM = 1_000_000


@pytest.fixture
def words(tmp_path: Path) -> list[str]:
    file = tmp_path / "part.ngc"
    file.write_text(JOB)
    journal = tmp_path / "stream.json"
    return ["stream", str(file), "--machine", str(MILL), "--journal", str(journal)]


def test_axes_elsewhere_are_refused_and_the_message_helps(
    make_bench: MakeBench, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    controller = make_bench(file=MILL).controller
    assert main([*words, "--from-line", "4"]) == 5
    error = capsys.readouterr().err
    assert "12 mm from the path at line 4" in error
    assert stream_status(controller).state != ENDED
    assert controller.targets(3) == [0, 0, 0]
    command = error[error.index("hodograph goto ") :].split(",")[0]
    assert main(shlex.split(command)[1:]) == 0
    assert controller.targets(3) == [12 * COUNTS_PER_MM, 0, 0]
    capsys.readouterr()
    assert main([*words, "--from-line", "4", "--json"]) == 0
    done = json.loads(capsys.readouterr().out)
    assert done["sections"] == 2
    assert controller.targets(3) == [0, 0, -3 * COUNTS_PER_MM]
    assert stream_status(controller).state == ENDED
    again = ["stream", "--continue", "--journal", str(tmp_path / "stream.json")]
    assert main(again) == 2  # it is complete


def test_from_an_arc_length(
    make_bench: MakeBench, words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    controller = make_bench(file=MILL).controller
    assert main(["goto", str(MILL), "--to", "12", "4.5", "--z", "0"]) == 0
    capsys.readouterr()
    assert main([*words, "--from", "16.5", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["sections"] == 2
    assert controller.targets(3) == [0, 0, -3 * COUNTS_PER_MM]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (["--from-line", "0"], "lines count from 1"),
        (["--from-line", "9"], "no motion at line 9"),
        (["--from", "-1"], "an arc length of 0 mm or more"),
        (["--from", "nan"], "an arc length of 0 mm or more"),
        (["--from", "1e9"], "no place at 1e+09 mm"),
        (["--from-line", "4", str(MILL.parent.parent / "toolpaths/pocket.ngc")], "takes one FILE"),
    ],
)
def test_a_place_that_is_none(
    words: list[str], more: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [one for one in more if one.endswith(".ngc")]
    assert (
        main([*words[:2], *files, *words[2:], *more[: len(more) - len(files)], "--simulate"]) == 2
    )
    assert message in capsys.readouterr().err


def test_a_simulated_job_begins_there_too(
    words: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    found = []
    for more in ([], ["--from-line", "4"], ["--from", "12"]):
        assert main([*words, *more, "--simulate", "--json"]) == 0
        found.append(json.loads(capsys.readouterr().out))
    whole, line, arc = (one["duration_s"] for one in found)
    assert line == arc < whole
    assert found[1]["job"] == found[2]["job"]
