# SPDX-License-Identifier: MIT
"""Bad input on the command line: documented exit status, one line on stderr, nothing on stdout. Run by pytest; starts
processes, and writes to temporary folders.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import can
import pytest

from hodograph.cli import main as cli_main
from hodograph.cli.main import main

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
ALPHA = str(EXAMPLES / "alpha.toml")

PATH = """
[path]
closed = {closed}
control_points = {points}
[feed]
profile = "quintic"
nominal_mm_s = {feed}
ramp_time_s = 0.1
[machine]
file = "{machine}"
"""


def path_file(
    folder: Path,
    points: str = "[[0, 0], [12, 18], [24, 27], [36, 9]]",
    closed: str = "false",
    feed: str = "100",
) -> str:
    file = folder / "path.toml"
    machine = EXAMPLES / "machines" / "paper_alpha.toml"
    file.write_text(PATH.format(points=points, closed=closed, feed=feed, machine=machine))
    return str(file)


def failed(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str]:
    """Exit status and the last line on stderr; earlier lines may only be notes."""
    status = main(arguments)
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    lines = err.splitlines()
    assert all(line.startswith("hodograph: ") for line in lines), err
    return status, lines[-1]


USAGE = [
    ((), r"COMMAND"),
    (("simulat",), r'no command "simulat"; did you mean "simulate"\?'),
    (
        ("simulate", ALPHA, "--kernal", "fixed"),
        r'--kernal fixed; did you mean "--kernel"\? .*simulate',
    ),
    (
        ("--quite", "simulate", ALPHA),
        r'unknown argument: --quite; did you mean "--quiet"\? \(see hodograph --help',
    ),
    (
        ("simulate", ALPHA, "other.toml"),
        r"unknown argument: other.toml \(see hodograph simulate --help\)",
    ),
    (("quik-stop",), r'did you mean "quick-stop"\?'),
    (("spline",), r"FILE"),
    (("spline", ALPHA, "--jsn"), r"--jsn"),
    (("spline", ALPHA, "--at", "x"), r'"x" is not a number'),
    (("spline", ALPHA, "--at", "nan"), r'"nan" is not finite'),
    (("spline", ALPHA, "--at", "1e9"), r"--at 1e\+09: must be from 0 to 99\.9"),
    (("spline", ALPHA, "--at", "-1"), r"--at -1: must be from 0"),
    (("feed", ALPHA, "--at", "2"), r"--at 2: must be from 0 to 1\.09"),
    (("simulate", ALPHA, "--kernel", "quad"), r"--kernel.*quad"),
    (("status", "--node", "200"), r'"200" is not a node number'),
    (("status", "--bus", ":"), r'--bus ":": write interface:channel'),
    (("run", ALPHA, ALPHA, "--trace", "x.csv"), r"--trace: takes one FILE"),
    (("spline", "/nonexistent/x.toml"), r"/nonexistent/x\.toml: no such file"),
    (("inspect", "/nonexistent/x.hdgp"), r"/nonexistent/x\.hdgp: no such file"),
    (("compile", ALPHA, "-o", "/nonexistent/x.hdgp"), r"/nonexistent/x\.hdgp: cannot be written"),
]


@pytest.mark.parametrize(("arguments", "message"), USAGE, ids=[u[1] for u in USAGE])
def test_usage(
    capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...], message: str
) -> None:
    status, line = failed(capsys, *arguments)
    assert status == 2
    assert re.search(message, line), line


PATHS = [
    ({"points": "[[0, 0], [1, 1], [2, 0]]"}, 2, r"3 control points.*at least 4"),
    ({"points": "[[0, 0], [1, 1], [1, 1], [2, 0], [3, 3]]"}, 2, r"control point 2 repeats"),
    ({"points": "[[0, 0], [1, 1], [2, 0], [3, nan]]"}, 2, r"point 3 holds nan"),
    ({"feed": "1e9"}, 2, r"nominal_mm_s must be from"),
    ({"points": "[[0, 0], [300, 0], [600, 0], [900, 10]]"}, 3, r"travel"),
]


@pytest.mark.parametrize(("change", "status", "message"), PATHS, ids=[p[2] for p in PATHS])
def test_paths(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    change: dict[str, str],
    status: int,
    message: str,
) -> None:
    output = tmp_path / "out.hdgp"
    found, line = failed(capsys, "compile", path_file(tmp_path, **change), "-o", str(output))
    assert (found, bool(re.search(message, line))) == (status, True), line
    assert list(tmp_path.iterdir()) == [tmp_path / "path.toml"]


def test_a_bend_without_headroom_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Two points 0.7 um apart in a bend that turns back: its plan leaves nothing for a changing override."""
    file = tmp_path / "needle.toml"
    file.write_text(
        "[path]\nclosed = false\n"
        "through = [[0, 0], [10, 0], [10.0005, 0.0005], [10, 0.001], [0, 0.001]]\n"
        "[feed]\nprofile = 'optimal'\nnominal_mm_s = 100\n"
        f"[machine]\nfile = '{EXAMPLES / 'machines/paper_alpha.toml'}'\n"
    )
    status, line = failed(capsys, "compile", str(file))
    assert status == 3
    assert re.search(r"piece at 10\.47\d* mm, where the curvature is up to .* no headroom", line), (
        line
    )
    assert "smooth the path" in line


def test_only_a_path(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What a command does not need may be missing."""
    file = tmp_path / "bare.toml"
    file.write_text("[path]\nclosed = true\nthrough = [[0,0],[9,0],[5,6]]\n")
    assert main(["spline", str(file), "--json"]) == 0
    capsys.readouterr()
    status, line = failed(capsys, "feed", str(file), "--json")
    assert status == 2
    assert "bare.toml: the section [feed] is missing" in line
    feed = "[feed]\nprofile='quintic'\nnominal_mm_s=10\nramp_time_s=0.1\n"
    file.write_text(file.read_text() + feed)
    assert main(["feed", str(file), "--json"]) == 0
    capsys.readouterr()
    file.write_text(file.read_text() + "[machine]\nfile = 'no.toml'\n")
    assert main(["spline", str(file), "--json"]) == 0
    capsys.readouterr()
    status, line = failed(capsys, "simulate", str(file), "--json")
    assert status == 2
    assert re.search(r"bare\.toml: \[machine\] file names .*no\.toml, which is not there", line)


def test_no_machine(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = Path(path_file(tmp_path))
    file.write_text(file.read_text().partition("[machine]")[0])
    status, line = failed(capsys, "compile", str(file))
    assert status == 2
    assert "names no machine" in line
    assert main(["feed", str(file)]) == 0


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda image: image[:100], "truncated"),
        (lambda image: image[:-1], "truncated"),
        (lambda image: b"NOPE" + image[4:], "HDGP"),
        (lambda image: image[:4] + b"\x63" + image[5:], "version"),
        (lambda image: image[:200] + bytes([image[200] ^ 1]) + image[201:], "CRC"),
        (lambda image: b"", "truncated"),
    ],
    ids=["header cut", "one byte short", "magic", "version", "one bit", "empty"],
)
def test_spoilt_images(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], spoil: object, message: str
) -> None:
    file = tmp_path / "program.hdgp"
    assert main(["compile", path_file(tmp_path), "-o", str(file)]) == 0
    capsys.readouterr()
    assert callable(spoil)
    file.write_bytes(spoil(file.read_bytes()))
    status, line = failed(capsys, "inspect", str(file))
    assert status == 2
    assert message in line
    assert str(file) in line


def test_no_bus(capsys: pytest.CaptureFixture[str]) -> None:
    status, line = failed(capsys, "status", "--bus", "socketcan:vcan7")
    assert status == 4
    assert "tools/with-vcan" in line


def test_a_waiting_time_is_not_below_zero(capsys: pytest.CaptureFixture[str]) -> None:
    status, line = failed(capsys, "status", "--wait", "-1")
    assert status == 2
    assert 'argument --wait: "-1" is below 0' in line


def test_unknown_interface(capsys: pytest.CaptureFixture[str]) -> None:
    status, line = failed(capsys, "status", "--bus", "nocan:7")
    assert status == 4
    assert "nocan:7: cannot be opened" in line


def test_no_node(capsys: pytest.CaptureFixture[str]) -> None:
    """On python-can's own virtual bus nobody answers."""
    status, line = failed(capsys, "status", "--bus", "virtual:empty", "--wait", "0.3")
    assert status == 4
    assert re.search(
        r"no answer from node 1 on virtual:empty in 0\.3 s: start the controller", line
    )


def test_module_and_debug(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hodograph", "spline", str(tmp_path / "none.toml")]
    plain = subprocess.run(command, capture_output=True, text=True, check=False)
    assert plain.returncode == 2
    assert plain.stderr.count("\n") == 1
    debug = subprocess.run(
        command,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"HODOGRAPH_DEBUG": "1"},
    )
    assert debug.returncode == 2
    assert "Traceback" in debug.stderr


def test_closed_pipe() -> None:
    """`hodograph ... | head -0` ends quietly."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run(
        [sys.executable, "-m", "hodograph", "spline", ALPHA, "--json"],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        check=False,
    )
    os.close(writing)
    assert done.stderr == ""
    assert done.returncode == 1


@pytest.mark.parametrize(("number", "status"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_second_signal_ends_the_process_at_once(
    number: signal.Signals, status: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first one ends the command with a line; after it no exception can come into the last lines of `main`."""
    said: list[object] = []
    before = signal.signal(number, signal.SIG_DFL)

    def complain(text: str) -> None:
        said.extend((text, signal.getsignal(number)))

    monkeypatch.setattr(cli_main, "complain", complain)
    monkeypatch.setattr(cli_main, "_run", lambda options: signal.raise_signal(number))
    try:
        assert main(["feed", ALPHA]) == status
    finally:
        signal.signal(number, before)
    assert len(said) == 2
    assert said[1] is signal.SIG_DFL


def test_run_needs_socketcan(capsys: pytest.CaptureFixture[str]) -> None:
    status, line = failed(capsys, "run", ALPHA, "--bus", "virtual:x")
    assert status == 4
    assert "takes SocketCAN" in line


def test_home_checks_the_bus_time_of_its_file(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """It configures the controller, as `upload` does."""
    machines = Path(ALPHA).parent / "machines"
    text = (
        (machines / "paper_alpha.toml").read_text().replace('"../drives', f'"{machines}/../drives')
    )
    file = tmp_path / "slow.toml"
    file.write_text(re.sub(r"bitrate = \d+", "bitrate = 125000", text))
    assert "bitrate = 125000" in file.read_text()
    status, line = failed(capsys, "home", str(file), "--bus", "virtual:x")
    assert status == 2
    assert "at 125000 bit/s, but period_us is 1000" in line


def test_no_cases_are_no_success(capsys: pytest.CaptureFixture[str]) -> None:
    status, line = failed(capsys, "faults", "sync-lost", "--seeds", "0")
    assert status == 2
    assert "--seeds" in line


@pytest.mark.parametrize(
    "words",
    [
        ("start",),
        ("stop",),
        ("hold",),
        ("resume",),
        ("override", "50"),
        ("home",),
        ("quick-stop",),
        ("reset",),
        ("status",),
    ],
)
def test_every_command_takes_node_and_bit_rate_from_a_machine_file(
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    words: tuple[str, ...],
) -> None:
    machines = Path(ALPHA).parent / "machines"
    text = (machines / "paper_alpha.toml").read_text()
    text = text.replace('"../drives', f'"{machines}/../drives')
    text = re.sub(r"bitrate = \d+", "bitrate = 500000", text)
    file = tmp_path / "other.toml"
    file.write_text(text.replace("node = 1\n", "node = 77\n"))
    opened: list[int] = []
    real = can.Bus

    def opening(*args: Any, **options: Any) -> Any:
        opened.append(options["bitrate"])
        return real(*args, **options)

    monkeypatch.setattr(can, "Bus", opening)
    more = ("--machine", str(file), "--bus", "virtual:empty", "--wait", "0.1")
    status, line = failed(capsys, *words, *more)
    assert status == 4
    assert "node 77" in line
    assert opened == [500_000]


SEALED = {
    "period": (16, 4, 0),
    "coefficient of a segment": (152, 8, 2**62),
    "least coefficient": (176, 8, 2**63),
    "duration of a piece": (-88, 8, 0),
}
"""What is put into an image, which then gets the right CRC: place (from the end of the pieces where negative), bytes,
value.
"""
STOP_BYTES = 16
"""Behind the pieces, for each of them."""


@pytest.mark.parametrize("name", SEALED)
@pytest.mark.parametrize("more", [(), ("--json",), ("--full",)])
def test_numbers_that_no_program_has(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, more: tuple[str, ...]
) -> None:
    """Whoever sealed the image: this is input, no error of ours."""
    file = tmp_path / "program.hdgp"
    assert main(["compile", path_file(tmp_path), "-o", str(file)]) == 0
    capsys.readouterr()
    image = bytearray(file.read_bytes())
    at, size, value = SEALED[name]
    pieces = int.from_bytes(image[24:28], "little")
    at %= len(image) - STOP_BYTES * pieces
    image[at : at + size] = value.to_bytes(size, "little")
    image[12:16] = zlib.crc32(image[16:]).to_bytes(4, "little")
    file.write_bytes(image)
    status, line = failed(capsys, "inspect", str(file), *more)
    assert status == 2
    assert str(file) in line
