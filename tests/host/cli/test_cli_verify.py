# SPDX-License-Identifier: MIT
"""hodograph verify: keys, exit statuses, and inputs. Run by pytest; writes to temporary folders."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from hodograph.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
KEYS = {
    "stops",
    "controller", "kept", "duration_s", "length_mm", "samples", "peak", "excesses", "setpoints", "bus_noise",
}  # fmt: skip
PEAK_KEYS = {"value", "at_most", "limit", "ratio", "s_mm", "t_s"}


def path_file(folder: Path, limits: str, machine: bool = True) -> Path:
    text = (EXAMPLES / "alpha.toml").read_text()
    text = text[: text.index("[limits]")] + "[limits]\n" + limits
    if machine:
        text += f'\n[machine]\nfile = "{EXAMPLES / "machines/paper_alpha.toml"}"\n'
    file = folder / "path.toml"
    file.write_text(text)
    return file


def document(capsys: pytest.CaptureFixture[str], status: int, *arguments: str) -> Any:
    assert main(["verify", "--json", *arguments]) == status
    return json.loads(capsys.readouterr().out)


def test_keys(capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, 0, str(EXAMPLES / "alpha.toml"))
    assert set(found) == KEYS
    assert set(found["setpoints"]) == {"fixed", "float", "double"}
    assert found["kept"]
    assert found["stops"]["hold"] == {
        "pieces": 38,
        "proved": 38,
        "proved_time_share": 1.0,
        "not_proved_at_mm": [],
    }
    fault = found["stops"]["fault"]
    assert 0 < fault["proved"] < fault["pieces"]
    # what is open is the long piece of constant feed: few pieces, much of the time
    assert fault["proved_time_share"] < 0.5 < fault["proved"] / fault["pieces"]
    assert not found["excesses"]
    for peak in found["peak"].values():
        assert set(peak) == PEAK_KEYS
    assert found["peak"]["jerk_mm_s3"]["limit"] == 50000.0
    assert found["peak"]["centripetal_mm_s2"]["ratio"] is None


def test_beyond_a_limit(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = path_file(tmp_path, 'policy = "report"\n[limits.axis]\njerk_mm_s3 = [5e4, 4e4]')
    found = document(capsys, 7, str(file))
    assert not found["kept"]
    assert {one["quantity"] for one in found["excesses"]} == {"y_jerk_mm_s3"}
    assert main(["verify", str(file)]) == 7
    captured = capsys.readouterr()
    assert f"worst place of each stretch ({len(found['excesses'])}):" in captured.out
    assert "beyond its limits by more than 0.1 %: y_jerk_mm_s3" in captured.err


def test_a_little_beyond_is_reported_and_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    peak = document(capsys, 0, str(EXAMPLES / "alpha.toml"))["peak"]["y_jerk_mm_s3"]["value"]
    limits = f'policy = "report"\n[limits.axis]\njerk_mm_s3 = [5e4, {peak / 1.0005}]'
    file = path_file(tmp_path, limits)
    found = document(capsys, 0, str(file))
    assert found["kept"]
    assert found["excesses"][0]["ratio"] == pytest.approx(1.0005, abs=1e-4)  # verify.peaks.GAP
    assert main(["verify", str(file)]) == 0
    reported = f"({len(found['excesses'])}, none by more than 0.1 %):"
    assert f"worst place of each stretch {reported}" in capsys.readouterr().out


def test_a_given_image(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is the image that is verified: the file's own plan would keep this limit."""
    image = tmp_path / "alpha.hdgp"
    assert main(["compile", str(EXAMPLES / "alpha.toml"), "-o", str(image)]) == 0
    capsys.readouterr()
    file = path_file(tmp_path, "feed_mm_s = 50")
    assert document(capsys, 0, str(file))["peak"]["feed_mm_s"]["value"] == pytest.approx(50.0)
    found = document(capsys, 7, str(file), "--program", str(image))
    assert found["peak"]["feed_mm_s"]["value"] == pytest.approx(100.0)
    assert main(["verify", str(file), "--program", str(file)]) == 2
    assert "is not a program image" in capsys.readouterr().err
    image.write_bytes(image.read_bytes()[:-1])
    assert main(["verify", str(file), "--program", str(image)]) == 2


def test_without_a_machine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    found = document(capsys, 0, str(path_file(tmp_path, "", machine=False)))
    assert "x_volts" not in found["peak"]
    file = path_file(tmp_path, "volts = 3", machine=False)
    assert main(["verify", str(file)]) == 2
    assert "volts needs a machine" in capsys.readouterr().err
