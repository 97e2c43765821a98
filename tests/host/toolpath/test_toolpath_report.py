# SPDX-License-Identifier: MIT
"""The report and `verify` of a toolpath: their figures and texts are those of the file and the run. Run by pytest;
writes to temporary folders.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.job import load_job
from hodograph.job_simulation import JobMotion, simulate_job
from hodograph.job_view import curve_view
from hodograph.report.toolpath_figures import widest_corners
from hodograph.report.toolpath_report import view_data, write_toolpath_report

ROOT = Path(__file__).resolve().parents[3]
MILL = ROOT / "examples" / "machines" / "mill.toml"
TEXT = "G0 X2\nF1200\nG1 X6 (</script>)\nY4\nG4 P0\nG0 X3 Y3 Z1\nM2\n"


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> JobMotion:
    file = tmp_path_factory.mktemp("job") / "part.ngc"
    file.write_text(TEXT)
    return simulate_job(load_job(file, load_machine(MILL)))


def test_rapid_moves_are_those_of_the_file(run: JobMotion) -> None:
    first, last = run.job.sections
    assert first.is_rapid_at(np.array([0.0, 1.0, 3.0, 8.0])).tolist() == [True, True, False, False]
    assert last.is_rapid_at(np.array([0.5])).all()


def test_corners_are_the_programmed_ones_and_inside_the_tolerance(run: JobMotion) -> None:
    (place,) = widest_corners(run.job)
    assert place.section.fitted.reference.point[place.vertex].tolist() == [6.0, 0.0, 0.0]
    assert 0.002 < place.distance_mm < place.section.tolerance_mm


def test_every_point_of_the_view_has_the_line_that_programmed_it(run: JobMotion) -> None:
    view = view_data(run)
    columns = {name: np.array(view[name]) for name in "xyzflr"}
    assert {column.size for column in columns.values()} == {columns["x"].size}
    line = columns["l"]
    assert sorted(set(line.tolist())) == [1, 3, 4, 6]
    assert (columns["y"][line == 3] < 0.011).all()
    assert (columns["x"][line == 4] > 5.989).all()
    assert (columns["r"] == np.isin(line, (1, 6))).all()
    assert view["text"] == {"1": "G0 X2", "3": "G1 X6 (</script>)", "4": "Y4", "6": "G0 X3 Y3 Z1"}


def test_a_long_job_is_thinned_but_keeps_its_ends(
    run: JobMotion, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("hodograph.report.toolpath_report.MOST_POINTS", 50)
    view = view_data(run)
    xs = np.array(view["x"])
    assert xs.size <= 50 + 2 * len(run.job.sections)
    assert (xs[0], xs[-1]) == (0.0, 3.0)


def test_the_page_needs_nothing_else_and_holds_its_data(run: JobMotion, tmp_path: Path) -> None:
    page = write_toolpath_report(run, tmp_path / "report").read_text(encoding="utf-8")
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.DOTALL)
    assert data is not None
    assert json.loads(data[1])["text"]["3"] == "G1 X6 (</script>)"
    assert not re.search(r'(?:src|href)="(?!data:|#)', page)
    assert {file.name for file in (tmp_path / "report").iterdir()} == {
        "report.html", "path.png", "feed.png", "corners.png",
    }  # fmt: skip


def test_one_toolpath_at_a_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["report", "a.ngc", "b.ngc", "--machine", str(MILL), "-o", str(tmp_path)]) == 2
    assert "one toolpath" in capsys.readouterr().err


def test_verify_goes_through_all_sections(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "part.ngc"
    file.write_text(TEXT)
    assert main(["verify", str(file), "--machine", str(MILL), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["kept"]
    assert [(one["first_line"], one["last_line"]) for one in found["section"]] == [(1, 4), (6, 6)]
    for one in found["section"]:
        assert 0.9 < one["peak"]["x_jerk_mm_s3"]["ratio"] < 1.001
        assert one["controller"] == {
            "accepted": True, "code": 0, "piece": None, "text": "accepted",
        }  # fmt: skip
        for stops in (one["stops"]["hold"], one["stops"]["fault"]):
            assert 0 < stops["pieces"] == stops["proved"] + len(stops["not_proved_at_mm"])
    assert main(["verify", str(file), "--machine", str(MILL), "--program", "x.hdgp"]) == 2
    assert "--program" in capsys.readouterr().err


def test_the_view_of_the_live_page_is_the_planned_path_in_machine_coordinates(
    run: JobMotion, tmp_path: Path
) -> None:
    view = curve_view(run.job)
    columns = {name: np.array(view[name]) for name in "xyzflr"}
    at = np.column_stack([columns[name] for name in "xyz"])
    assert at[[0, -1]].tolist() == [[0.0, 0.0, 0.0], [3.0, 3.0, 1.0]]
    assert view["text"]["3"] == "G1 X6 (</script>)"  # type: ignore[index]
    assert view["tolerance"] == 0.01
    assert columns["f"][columns["r"] == 0].max() == pytest.approx(20.0, rel=1e-3)
    programmed = np.column_stack([view["programmed"][name] for name in "xyz"])  # type: ignore[index]
    assert [6.0, 0.0, 0.0] in programmed.tolist()
    text = MILL.read_text(encoding="utf-8").replace("[0, 0, 0]", "[5, 0, -2]")
    (tmp_path / "moved.toml").write_text(
        text.replace("../drives", str(MILL.parent.parent / "drives"))
    )
    moved = curve_view(load_job(run.job.file, load_machine(tmp_path / "moved.toml")))
    there = np.column_stack([moved[name] for name in "xyz"])
    assert (there[[0, -1]] - at[[0, -1]]).tolist() == [[5.0, 0.0, -2.0]] * 2
