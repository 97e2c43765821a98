# SPDX-License-Identifier: MIT
"""A machine whose tick cannot fit is refused before any frame is sent, with values that would fit. Run by pytest;
starts `hodograph-hub`, and writes to temporary folders.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

import pytest

from hodograph.bustime import require_fit
from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.errors import InputError

LIMITS = "velocity_mm_s = 500\nacceleration_mm_s2 = 5000\njerk_mm_s3 = 200000\n"

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


@pytest.mark.parametrize(
    ("feedforward", "drives", "advice"),
    [
        (
            "{velocity = 1, torque_permille_s_m = 1}",
            2,
            r"period_us = 2000 or at most 1 drive or \[axis.feedforward\] velocity = 0$",
        ),
        ("{torque_permille_s_m = 1}", 3, r"at most 2 drives or no \[axis.feedforward\]$"),
        ("{velocity = 1}", 3, r"at most 2 drives or \[axis.feedforward\] velocity = 0$"),
        ("{}", 4, r"period_us = 2000 or at most 3 drives$"),
    ],
)
def test_what_feedforward_takes(tmp_path: Path, feedforward: str, drives: int, advice: str) -> None:
    file = Path(machine(tmp_path, 1_000_000, 1000))
    head = file.read_text().split("[[axis]]")[0]
    axis = f'[[axis]]\nname = "a"\nnode = %d\ntravel_mm = [0, 1]\n{LIMITS}feedforward = {feedforward}\n'
    axis += 'drive = "../drives/alpha_x.toml"\n'
    file.write_text(head + "".join(axis % node for node in range(2, 2 + drives)))
    with pytest.raises(InputError, match=rf"{drives} drives need up to .*: use .*{advice}"):
        require_fit(load_machine(file))


def test_drives_without_a_model_send_no_volts(tmp_path: Path) -> None:
    file = Path(machine(tmp_path, 1_000_000, 1000))
    head = file.read_text().split("[[axis]]")[0]
    axis = f'[[axis]]\nname = "a"\nnode = %d\ntravel_mm = [0, 1]\n{LIMITS}feedforward = {{torque_permille_s_m = 1}}\n'
    file.write_text(head + "".join(axis % node for node in (2, 3, 4)))
    require_fit(load_machine(file))
    require_fit(load_machine(EXAMPLES / "machines" / "real_drives.toml"))
