# SPDX-License-Identifier: MIT
"""hodograph campaign on one core: the table, errors, and continuation after any interruption. Run by pytest; starts
processes, and writes to temporary folders.
"""

from __future__ import annotations

import io
import json
import random
import subprocess
import sys
from pathlib import Path

import pytest
from campaign_files import EXAMPLES, MACHINE, PATH, Write, table
from filelock import lock_descriptor

from hodograph.campaign import runner
from hodograph.campaign import runner as engines
from hodograph.campaign.definition import load_campaign
from hodograph.campaign.results import NAME, journal, write_csv
from hodograph.campaign.runner import Here, run_campaign
from hodograph.cli.main import main
from hodograph.native import OfflineFault
from hodograph.pipeline import load_pipeline
from hodograph.simulate import simulate

MIXED = """
paths = ["path.toml"]
profiles = ["quintic", "minimax"]
samples = 6
[vary.time_constant_s]
factor_uniform = [0.8, 1.2]
[vary.gain_rad_s_v]
values = [60, 80]
[[faults]]
name = "none"
[[faults]]
name = "load"
rules = ["load at={at} for=20 node=2 volts=3"]
random = { at = [5, 100] }
"""


def run(file: Path, folder: Path, *more: str) -> int:
    return main(["campaign", str(file), "-o", str(folder), "--workers", "1", *more])


def test_rows_are_what_simulate_gives(write: Write, tmp_path: Path) -> None:
    text = 'paths = ["{examples}/alpha.toml", "path.toml"]\n[[faults]]\nname = "none"\n'
    text += '[[faults]]\nname = "jump"\nrules = ["encoder-jump at=50 node=3 counts=9000"]\n'
    assert run(write(text), tmp_path / "out") == 0
    rows = table(tmp_path / "out")
    assert [row["path"] for row in rows] == ["alpha", "alpha", "path", "path"]
    assert rows[0]["encoders_sha256"].startswith("81c8a7cb")
    pipeline = load_pipeline(EXAMPLES / "alpha.toml")
    drives = pipeline.machine.models(pipeline.machine.path_axes)
    for row, faults in (
        (rows[0], ()),
        (rows[1], (OfflineFault("encoder-jump", 1, 50, 2**32 - 1, 9000),)),
    ):
        motion = simulate(pipeline.image, drives, faults=faults)
        assert row["encoders_sha256"] == motion.encoders_sha256
        assert float(row["max_contour_error_um"]) == motion.max_contour_error_um
        assert float(row["rms_contour_error_um"]) == motion.rms_contour_error_um
        assert float(row["max_following_error_um"]) == motion.max_following_error_um
        assert float(row["max_volts"]) == motion.max_volts
        assert float(row["duration_s"]) == 1.1
        assert row["error"] == ""
    assert rows[1]["rules"] == "encoder-jump at=50 node=3 counts=9000"
    assert rows[1]["encoders_sha256"] != rows[0]["encoders_sha256"]


def test_summary_and_report(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file, folder = write(MIXED), tmp_path / "out"
    assert run(file, folder, "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["runs"], found["failed"], found["folder"]) == (48, 0, str(folder))
    assert [g["fault"] for g in found["groups"]] == ["none", "load"] * 2
    for place, group in enumerate(found["groups"]):
        errors = [
            float(r["max_contour_error_um"]) for r in table(folder)[12 * place : 12 * place + 12]
        ]
        assert group["contour_error_um"]["max"] == max(errors)
        assert min(errors) <= group["contour_error_um"]["median"] <= max(errors)
    assert run(file, folder) == 0
    reported = capsys.readouterr()
    assert "path, quintic, load" in reported.out
    assert "48 of 48 runs are done: going on" in reported.err
    html = (folder / "report.html").read_text()
    assert html.count("<img ") == 2
    for name in ("spread", "dependence"):
        assert (folder / f"{name}.png").read_bytes().startswith(b"\x89PNG")


def test_failures_are_rows(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A drive that cannot be, a path beyond the machine's travel: the rest is run."""
    far = PATH.replace("[0, 0], [4, 6]", "[0, 0], [40, 600]")
    (tmp_path / "far.toml").write_text(far)
    text = 'paths = ["far.toml", "path.toml"]\n[vary.gain_rad_s_v]\nvalues = [80, -1]\n'
    assert run(write(text), tmp_path / "out") == 0
    rows = table(tmp_path / "out")
    assert [bool(row["error"]) for row in rows] == [True, True, False, True]
    assert "far.toml" in rows[0]["error"]
    assert rows[1]["error"] == rows[0]["error"]
    assert "plant figures must be positive" in rows[3]["error"]
    assert rows[3]["max_contour_error_um"] == ""
    assert "3 of 4 runs failed, the first is run 0: " in capsys.readouterr().err


def test_nothing_succeeds(write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = 'paths = ["path.toml"]\n[vary.gain_rad_s_v]\nvalues = [-2, -1]\n'
    assert run(write(text), tmp_path / "out") == 6
    assert "2 of 2 runs failed" in capsys.readouterr().err
    assert len(table(tmp_path / "out")) == 2


def test_goes_on_wherever_it_was_cut(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The journal cut at any byte, as when the process is killed or the machine stops: the same table."""
    monkeypatch.setattr(runner, "BATCH_TICKS", 1500)  # a few runs each
    campaign, file = load_campaign(write(MIXED)), tmp_path / NAME

    def result() -> str:
        text = io.StringIO()
        design = campaign.design
        with journal(tmp_path, campaign.fingerprint, design.total, fresh=False) as made:
            write_csv(design, run_campaign(campaign, made, Here(), lambda done: None), text)
        return text.getvalue()

    whole, data = result(), file.read_bytes()
    lines = data.splitlines(keepends=True)
    assert len(lines) > 8
    draw = random.Random(5)
    for cut in (0, 1, len(lines[0]), len(data) - 1, *(draw.randrange(len(data)) for _ in range(6))):
        file.write_bytes(data[:cut])
        assert result() == whole
        assert file.read_bytes().startswith(lines[0])


def test_what_is_done_is_not_done_again(
    write: Write, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file, folder = write('paths = ["path.toml"]'), tmp_path / "out"
    assert run(file, folder) == 0

    def never(*_: object) -> None:
        raise AssertionError("nothing was left to do")

    monkeypatch.setattr(runner, "make_runs", never)
    monkeypatch.setattr(runner, "build", never)
    assert run(file, folder) == 0


def test_another_campaign_is_not_mixed_in(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    assert run(write('paths = ["path.toml"]\nfeeds_mm_s = [50]'), folder) == 0
    before = (folder / "runs.journal").read_bytes()
    other = write('paths = ["path.toml"]\nfeeds_mm_s = [60]')
    capsys.readouterr()
    assert run(other, folder) == 2
    assert "holds runs of another campaign" in capsys.readouterr().err
    assert (folder / "runs.journal").read_bytes() == before
    assert run(other, folder, "--fresh") == 0
    assert [row["feed_mm_s"] for row in table(folder)] == ["60.0"]


def test_two_at_once_are_refused(
    write: Write, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    with (folder / "runs.journal").open("wb") as held:
        assert lock_descriptor(held.fileno(), blocking=False)
        assert run(write('paths = ["path.toml"]'), folder) == 2
    assert "another `hodograph campaign` is at work on it" in capsys.readouterr().err


def test_machine_of_the_campaign(write: Write, tmp_path: Path) -> None:
    """It replaces the path's own; gains and feedforward of a third can be tried on it."""
    text = f'paths = ["path.toml"]\nmachine = "{EXAMPLES}/machines/paper_heart.toml"\n'
    text += f'[[gains]]\nname = "heart"\n[[gains]]\nname = "alpha"\nmachine = "{MACHINE}"\n'
    assert run(write(text), tmp_path / "out") == 0
    pipeline = load_pipeline(tmp_path / "path.toml", EXAMPLES / "machines" / "paper_heart.toml")
    own = simulate(pipeline.image, pipeline.machine.models(pipeline.machine.path_axes))
    rows = table(tmp_path / "out")
    assert rows[0]["encoders_sha256"] == own.encoders_sha256
    assert rows[1]["encoders_sha256"] != own.encoders_sha256


def test_without_dask(
    write: Write,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def missing(name: str) -> None:
        raise ImportError(name)

    monkeypatch.setattr(engines, "import_module", missing)
    file, folder = write('paths = ["path.toml"]'), tmp_path / "out"
    assert main(["campaign", str(file), "-o", str(folder), "--workers", "2"]) == 2
    assert "pip install 'hodograph[campaign]'" in capsys.readouterr().err
    assert run(file, folder) == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--workers", "0"), "not a whole number from 1"),
        (("--workers", "2", "--scheduler", "tcp://x:1"), "give one of them"),
        (("-o", "{file}/out"), "cannot be written"),
    ],
)
def test_bad_options(
    write: Write,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    options: tuple[str, ...],
    message: str,
) -> None:
    file = write('paths = ["path.toml"]')
    given = [option.replace("{file}", str(file)) for option in options]
    assert main(["campaign", str(file), "-o", str(tmp_path / "out"), *given]) == 2
    assert message in capsys.readouterr().err


def test_dask_is_not_loaded_before_it_is_needed() -> None:
    text = "import sys, hodograph.cli.campaign_command; sys.exit('distributed' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", text], check=False).returncode == 0
