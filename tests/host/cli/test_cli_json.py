# SPDX-License-Identifier: MIT
"""--json: exactly the promised keys, and values that agree with each other. Run by pytest; writes to temporary
folders.
"""

from __future__ import annotations

import csv
import hashlib
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hodograph.cli.main import main
from hodograph.program.image import RECORD_BYTES, memory_bytes

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
NAMES = ["alpha", "heart", "star"]

SPLINE_KEYS = {
    "closed", "segments", "nodal_points", "length_mm", "segment_lengths_mm", "newton_iterations",
    "max_curvature_per_mm", "trial_iterations", "changed_sides", "extra_turning_rad", "bending_ratio",
}  # fmt: skip
FEED_KEYS = {
    "profile", "n_c", "evaluations", "ramp_time_s", "duration_s", "peak_acceleration_mm_s2",
    "peak_jerk_mm_s3", "planning_s", "peak", "stops",
}  # fmt: skip
SIMULATE_KEYS = {
    "ticks", "setpoints_sha256", "encoders_sha256", "max_contour_error_um", "max_following_error_um",
    "max_volts", "kernel", "stops",
}  # fmt: skip
TRACE_HEADER = (
    "tick,t_s,arc_length_mm,feed_mm_s,x_cmd_mm,y_cmd_mm,x_set_counts,y_set_counts,x_act_mm,y_act_mm,"
    "contour_error_um,x_volts,y_volts"
)


def result(capsys: pytest.CaptureFixture[str], *arguments: str) -> Any:
    assert main(arguments) == 0
    out = capsys.readouterr().out
    assert out.count("\n") == 1
    return json.loads(out)


@pytest.mark.parametrize("name", NAMES)
def test_spline(capsys: pytest.CaptureFixture[str], name: str) -> None:
    file = str(EXAMPLES / f"{name}.toml")
    found = result(capsys, "spline", file, "--json")
    assert set(found) == SPLINE_KEYS
    assert found["closed"] == (name != "alpha")
    assert len(found["segment_lengths_mm"]) == found["segments"]
    assert len(found["nodal_points"]) == found["segments"] + 1
    assert sum(found["segment_lengths_mm"]) == pytest.approx(found["length_mm"], rel=1e-12)


def test_spline_at(capsys: pytest.CaptureFixture[str]) -> None:
    file = str(EXAMPLES / "alpha.toml")
    plain = result(capsys, "spline", file, "--json")
    joints = np.concatenate(([0], np.cumsum(plain["segment_lengths_mm"])))
    found = result(capsys, "spline", file, "--json", "--at", *(repr(float(s)) for s in joints))
    assert set(found) == SPLINE_KEYS | {"points", "tangents", "curvatures"}
    np.testing.assert_allclose(found["points"], plain["nodal_points"], atol=1e-9)
    np.testing.assert_allclose(np.hypot(*np.transpose(found["tangents"])), 1, atol=1e-12)
    assert max(map(abs, found["curvatures"])) <= plain["max_curvature_per_mm"] * (1 + 1e-9)


def test_spline_in_space(capsys: pytest.CaptureFixture[str]) -> None:
    file = str(EXAMPLES / "helix.toml")
    plain = result(capsys, "spline", file, "--json")
    assert set(plain) == SPLINE_KEYS
    joints = np.concatenate(([0], np.cumsum(plain["segment_lengths_mm"])))
    found = result(capsys, "spline", file, "--json", "--at", *(repr(float(s)) for s in joints))
    assert set(found) == SPLINE_KEYS | {"points", "tangents", "curvatures", "torsions"}
    np.testing.assert_allclose(found["points"], plain["nodal_points"], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(found["tangents"], axis=1), 1, atol=1e-12)
    np.testing.assert_allclose(found["curvatures"][1:-1], 0.0497, rtol=0.03)
    np.testing.assert_allclose(found["torsions"][1:-1], 0.00396, rtol=0.2)
    assert main(["spline", file, "--at", "0", "50"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"s mm +x mm +y mm +z mm +curvature /mm +torsion /mm\n", out)


def test_a_command_for_paths_in_the_plane_refuses_one_in_space(
    capsys: pytest.CaptureFixture[str],
) -> None:
    machine = str(EXAMPLES / "machines/paper_alpha.toml")
    assert main(["tune", machine, "--path", str(EXAMPLES / "helix.toml")]) == 3
    caught = capsys.readouterr()
    assert caught.out == ""
    assert re.fullmatch(r".*helix\.toml: \[path\] has points \[x, y, z\]: .*\n", caught.err)


@pytest.mark.parametrize("name", NAMES)
def test_feed(capsys: pytest.CaptureFixture[str], name: str) -> None:
    file = str(EXAMPLES / f"{name}.toml")
    found = result(capsys, "feed", file, "--json")
    assert set(found) == FEED_KEYS
    assert (found["n_c"] is None) == (name == "star")
    assert found["planning_s"] > 0
    for peak in found["peak"].values():
        assert set(peak) == {"value", "limit", "at_mm"}
    length = result(capsys, "spline", file, "--json")["length_mm"]
    at = result(capsys, "feed", file, "--json", "--at", "0", repr(found["duration_s"]))
    assert set(at) == FEED_KEYS | {"arc_length_mm", "feed_mm_s"}
    np.testing.assert_allclose(at["arc_length_mm"], [0, length], atol=1e-9)
    np.testing.assert_allclose(at["feed_mm_s"], [0, 0], atol=1e-6)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("kernel", ["fixed", "float", "double"])
def test_simulate(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str, kernel: str
) -> None:
    file, trace = str(EXAMPLES / f"{name}.toml"), tmp_path / "trace.csv"
    found = result(capsys, "simulate", file, "--json", "--kernel", kernel, "--trace", str(trace))
    assert set(found) == SIMULATE_KEYS
    assert found["kernel"] == kernel
    assert 0 < found["max_contour_error_um"] < 60
    assert 0 < found["max_volts"] <= 5
    lines = trace.read_text().splitlines()
    assert lines[0] == TRACE_HEADER
    rows = list(csv.DictReader(lines))
    assert len(rows) == found["ticks"]
    setpoints = np.array([[int(r["x_set_counts"]), int(r["y_set_counts"])] for r in rows], "<i4")
    assert hashlib.sha256(setpoints.tobytes()).hexdigest() == found["setpoints_sha256"]
    actual = np.array([[float(r["x_act_mm"]), float(r["y_act_mm"])] for r in rows])
    counts = np.rint(actual * 1e6).astype("<i4")
    assert hashlib.sha256(counts.tobytes()).hexdigest() == found["encoders_sha256"]


def test_simulate_needs_no_given_folder(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Relative names in files are relative to the file, not to where one stands."""
    monkeypatch.chdir(tmp_path)
    assert result(capsys, "simulate", str(EXAMPLES / "alpha.toml"), "--json")["ticks"] > 1000


def test_feed_of_a_dense_path_is_that_of_its_program(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """Short segments lower the feed; `feed` has to say so, not only `simulate`."""
    points = [[0.05 * k, float(2.0 * np.sin(0.025 * k))] for k in range(60)]
    file = tmp_path / "dense.toml"
    file.write_text(
        f"[path]\nclosed = false\ncontrol_points = {points}\n[feed]\nnominal_mm_s = 200\n"
        f'ramp_time_s = 0.05\n[machine]\nfile = "{EXAMPLES / "machines/paper_alpha.toml"}"\n'
    )
    assert main(["feed", str(file), "--json"]) == 0
    out, notes = capsys.readouterr()
    assert "two neighbouring segments" in notes
    ticks = result(capsys, "simulate", str(file), "--json")["ticks"]
    assert ticks == np.ceil(json.loads(out)["duration_s"] * 1000.0) + 1


def test_compile_warns_of_what_the_machines_controller_cannot_hold(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """As `upload` counts: the image and the records that are prepared from it."""
    text = (EXAMPLES / "machines" / "paper_alpha.toml").read_text()
    text = text.replace('"../drives/', f'"{EXAMPLES}/drives/')
    output = tmp_path / "a.hdgp"

    def reported(room: int | None) -> str:
        machine = tmp_path / "machine.toml"
        line = "" if room is None else f"program_bytes = {room}\n"
        machine.write_text(text.replace("[controller]\n", f"[controller]\n{line}"))
        words = ["compile", str(EXAMPLES / "alpha.toml"), "--machine", str(machine)]
        assert main([*words, "-o", str(output)]) == 0
        return capsys.readouterr().err

    assert reported(None) == ""
    needed = memory_bytes(output.read_bytes(), RECORD_BYTES["fixed"])
    assert reported(needed) == ""
    assert (
        f"takes {needed} bytes of a controller with its precomputed coefficients, more than the {needed - 1} of "
        "[controller] program_bytes of machine.toml: upload will refuse it" in reported(needed - 1)
    )


def test_compile_and_inspect(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    output = tmp_path / "heart.hdgp"
    made = result(capsys, "compile", str(EXAMPLES / "heart.toml"), "-o", str(output), "--json")
    assert made["bytes"] == output.stat().st_size
    read = result(capsys, "inspect", str(output), "--json")
    assert read == result(capsys, "inspect", str(EXAMPLES / "heart.toml"), "--json")
    assert read["closed"]
    assert main(["inspect", str(output), "--full"]) == 0
    assert len(capsys.readouterr().out.splitlines()) > read["segments"] + read["pieces"]


def test_human_output(capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("spline", "feed", "simulate"):
        assert main([command, str(EXAMPLES / "alpha.toml")]) == 0
        assert "{" not in capsys.readouterr().out


def test_repeated_tail_is_dropped_with_a_note(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    text = (EXAMPLES / "heart.toml").read_text()
    head, tail = text.split("[40, -50],", 1)
    file = tmp_path / "heart.toml"
    repeated = "[40, -50], [-20, -50], [0, 5], [0, -5],"
    file.write_text((head + repeated + tail).partition("[machine]")[0])
    assert main(["spline", str(file), "--json"]) == 0
    out, err = capsys.readouterr()
    assert "repeat" in err
    plain = result(capsys, "spline", str(EXAMPLES / "heart.toml"), "--json")
    assert json.loads(out) == plain


def test_paper(capsys: pytest.CaptureFixture[str]) -> None:
    found = result(capsys, "paper", "--json")
    assert set(found) == {"alpha", "heart"}
    for curve in found.values():
        assert curve["n_c"]["paper"] == 8.12
        assert curve["n_c"]["ours"] == pytest.approx(8.35, abs=0.01)
        assert curve["peak_jerk_plain_mm_s3"]["ours"] == pytest.approx(1e5 / 3**0.5, rel=1e-6)
        assert curve["peak_jerk_modified_mm_s3"]["ours"] < 48200
    assert found["heart"]["vector_jerk_mm_s3_over_limit"]["ours"] > 1.3
    for name, plain, delayed in (("alpha", 10.51, 10.58), ("heart", 10.57, 10.87)):
        rows = found[name]
        assert rows["contour_error_um"]["ours_1ms"] == pytest.approx(plain, abs=0.02)
        assert rows["contour_error_delayed_um"]["ours_1ms"] == pytest.approx(delayed, abs=0.02)
        assert rows["max_volts_delayed"]["ours_1ms"] < 3.9
        assert rows["contour_error_um"]["ours"] > 20.0
        assert rows["n_c"]["ours_1ms"] is None
    assert found["alpha"]["vector_jerk_mm_s3_over_limit"]["ours"] < 0.5


def test_report(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Of two files with the same name."""
    files = [tmp_path / name / "alpha.toml" for name in ("a", "b")]
    for file in files:
        file.parent.mkdir()
        text = (EXAMPLES / "alpha.toml").read_text()
        file.write_text(text.replace('"machines/', f'"{EXAMPLES.resolve()}/machines/'))
    folder = tmp_path / "report"
    assert main(["report", *map(str, files), "-o", str(folder)]) == 0
    html = (folder / "report.html").read_text()
    names = {file.name for file in folder.glob("*.png")}
    assert names == {
        f"{name}_{figure}.png"
        for name in ("alpha", "alpha-2")
        for figure in ("path", "feed", "search", "joints", "contour", "drives")
    }
    assert '<h2 id="alpha-2">' in html
    assert html.count("data:image/png;base64,") == len(names)
    for outside in ("http://", "https://", "<script", "<link", 'src="alpha'):
        assert outside not in html
    assert capsys.readouterr().out.strip() == str(folder / "report.html")
