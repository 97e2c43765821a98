# SPDX-License-Identifier: MIT
"""A machine whose tick cannot fit is refused before anything is sent, with what would fit."""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from hodograph.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"


def machine(folder: Path, bitrate: int, period_us: int) -> str:
    shutil.copytree(EXAMPLES, folder / "examples")
    file = folder / "examples" / "machines" / "paper_alpha.toml"
    text = file.read_text().replace("bitrate = 1000000", f"bitrate = {bitrate}")
    file.write_text(text.replace("period_us = 1000", f"period_us = {period_us}"))
    return str(file)


@pytest.mark.parametrize("command", [("compile",), ("upload",), ("goto",), ("run",)])
@pytest.mark.parametrize(
    ("bitrate", "period_us", "advice"),
    [
        (250_000, 1000, "use period_us = 4000 or bitrate = 800000$"),
        (500_000, 1000, "use period_us = 2000 or bitrate = 800000$"),
        (125_000, 4000, "use period_us = 8000 or bitrate = 250000 or at most 1 drive$"),
        (125_000, 1000, "use period_us = 8000 or bitrate = 800000$"),
    ],
)
def test_refused_with_advice(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    command: tuple[str],
    bitrate: int,
    period_us: int,
    advice: str,
) -> None:
    file = machine(tmp_path, bitrate, period_us)
    assert main([*command, str(EXAMPLES / "alpha.toml"), "--machine", file]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.search(rf"paper_alpha.toml: \[bus\] 2 drives need .*{advice}", err.strip())
    assert list(Path.cwd().glob("*.hdgp")) == []
