# SPDX-License-Identifier: MIT
"""Output of commands besides their results: notes, progress, numbers as text. Run by pytest; starts `hodograph` and
opens pseudo terminals, and writes to temporary folders.
"""

from __future__ import annotations

import io
import os
import pty
import re
import subprocess
import sys
import threading
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from hodograph.cli import (
    demo_command,
    path_commands,
    report_commands,
    run_command,
    toolpath_commands,
)
from hodograph.cli import waiting as waiting_module
from hodograph.cli.main import _AWAITED, _MODULES, main
from hodograph.cli.output import (
    WANTED,
    duration_text,
    note,
    progress,
    require_places,
    size_text,
    write_file,
)
from hodograph.cli.waiting import held, waiting
from hodograph.errors import InputError

HANGS_S = 600.0  # of real time: none of these takes a second
ALPHA = str(Path(__file__).resolve().parents[3] / "examples" / "alpha.toml")


class Terminal(io.StringIO):
    """A terminal that remembers all it was sent."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        self.written.set()
        return super().write(text)


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """A terminal on which the line comes at once; tests redirect stderr to it."""
    stream = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(waiting_module, "AFTER_S", 0.0)
    monkeypatch.setattr(waiting_module, "EVERY_S", 0.005)
    monkeypatch.setattr(WANTED, "notes", True)
    monkeypatch.setattr(WANTED, "progress", True)
    return stream


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (0.0, "0 s"),
        (0.0123, "12.3 ms"),
        (0.771675, "0.771675 s"),
        (59.9, "59.9 s"),
        (60.0, "1 min 0.0 s"),
        (119.96, "2 min 0.0 s"),
        (125.3, "2 min 5.3 s"),
        (3599.96, "1 h 0 min 0 s"),
        (3725.0, "1 h 2 min 5 s"),
        (90_061.0, "25 h 1 min 1 s"),
    ],
)
def test_times_for_people(seconds: float, text: str) -> None:
    assert duration_text(seconds) == text


@pytest.mark.parametrize(
    ("size", "text"),
    [
        (0, "0 bytes"),
        (7672, "7672 bytes"),
        (129_008, "129008 bytes (126 KiB)"),
        (12 * 2**20, "12582912 bytes (12 MiB)"),
        (11 * 2**30, "11811160064 bytes (11 GiB)"),
    ],
)
def test_sizes_for_people(size: int, text: str) -> None:
    assert size_text(size) == text


# -- the line of a command that computes ---------------------------------------------------------------


def test_the_line_shows_and_goes(terminal: Terminal) -> None:
    with redirect_stderr(terminal), waiting("spline"):
        assert terminal.written.wait(HANGS_S)
    text = terminal.getvalue()
    assert re.match(r"\rspline: \d+ s\x1b\[K", text)
    assert text.endswith("\r\x1b[K")


def test_the_line_goes_before_results_and_notes(
    terminal: Terminal, monkeypatch: pytest.MonkeyPatch
) -> None:
    out = Terminal()
    with redirect_stderr(terminal), redirect_stdout(out), waiting("spline"):
        assert terminal.written.wait(HANGS_S)
        monkeypatch.setattr(waiting_module, "AFTER_S", 1e9)  # it does not come again
        note("something")
        before = terminal.getvalue()
        print("a result")
    assert before.endswith("\r\x1b[Khodograph: something\n")
    assert terminal.getvalue() == before
    assert out.getvalue() == "a result\n"


def test_a_bar_has_the_terminal_for_itself(terminal: Terminal) -> None:
    with redirect_stderr(terminal), waiting("simulate"):
        assert terminal.written.wait(HANGS_S)
        with held():
            terminal.written.clear()
            assert not terminal.written.wait(0.1)
        assert terminal.written.wait(HANGS_S)


def test_files_see_no_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(waiting_module, "EVERY_S", 0.001)
    monkeypatch.setattr(waiting_module, "AFTER_S", 0.0)
    with waiting("spline"):
        threading.Event().wait(0.05)
    assert capsys.readouterr() == ("", "")


def test_a_dumb_terminal_sees_no_line(terminal: Terminal, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TERM", "dumb")
    with redirect_stderr(terminal), waiting("spline"):
        assert not terminal.written.wait(0.05)


def test_the_line_goes_with_an_error(terminal: Terminal) -> None:
    def fail() -> None:
        with redirect_stderr(terminal), waiting("spline"):
            assert terminal.written.wait(HANGS_S)
            raise ValueError("no")

    with pytest.raises(ValueError, match="no"):
        fail()
    end = len(terminal.getvalue())
    assert terminal.getvalue().endswith("\r\x1b[K")
    terminal.written.clear()
    assert not terminal.written.wait(0.05)
    assert len(terminal.getvalue()) == end


# -- quiet -----------------------------------------------------------------------------------------------


def on_terminal(*words: str) -> tuple[int, str, str]:
    """Exit status, stdout, and what a terminal gets as stderr."""
    leader, follower = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "hodograph", *words],
        stdout=subprocess.PIPE,
        stderr=follower,
        env={**os.environ, "TERM": "xterm", "FORCE_COLOR": "1"},
    )
    os.close(follower)
    reported = b""
    try:
        while part := os.read(leader, 4096):
            reported += part
    except OSError:  # how Linux reports the end of a terminal
        pass
    finally:
        os.close(leader)
    out, _ = process.communicate()
    return process.returncode, out.decode(), reported.decode()


COLOUR = re.compile(r"\x1b\[[0-9;]*m")


def test_a_terminal_gets_no_colours() -> None:
    status, out, err = on_terminal("simulate", ALPHA)
    assert status == 0
    assert not COLOUR.search(out + err)
    status, _, err = on_terminal("nothing")
    assert (status, bool(COLOUR.search(err))) == (2, False)


@pytest.mark.parametrize("words", [["--quiet", "simulate", ALPHA], ["simulate", ALPHA, "-q"]])
def test_quiet_on_a_terminal(words: list[str]) -> None:
    status, out, err = on_terminal(*words)
    assert (status, err) == (0, "")
    assert "greatest contour error" in out


def test_quiet_leaves_errors(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--quiet", "feed", "nothing.toml"]) == 2
    assert capsys.readouterr().err == "hodograph: nothing.toml: no such file\n"


def test_quiet_leaves_out_notes_and_lasts_for_one_command(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "closed.toml"
    file.write_text(
        "[path]\nclosed = true\ncontrol_points = [[0, 0], [9, 0], [9, 9], [0, 9], [0, 0], [9, 0], [9, 9]]\n"
    )
    assert main(["spline", str(file), "-q"]) == 0
    assert capsys.readouterr().err == ""
    assert main(["spline", str(file)]) == 0
    assert "closed.toml" in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--quiet", "--no-progress"])
def test_no_progress(option: str, terminal: Terminal, capsys: pytest.CaptureFixture[str]) -> None:
    with redirect_stderr(terminal):
        assert main(["simulate", ALPHA, option]) == 0
        with progress("anything", "tick", 10) as bar:
            bar(5)
    assert terminal.getvalue() == ""


def test_progress_without_these(terminal: Terminal, capsys: pytest.CaptureFixture[str]) -> None:
    with redirect_stderr(terminal):
        assert main(["simulate", ALPHA]) == 0
    assert "\r" in terminal.getvalue()


def command(*words: str, before: str = "", after: str = "") -> subprocess.CompletedProcess[str]:
    """`hodograph` by a shell, as with redirections."""
    line = f'{before} "{sys.executable}" -m hodograph {" ".join(words)} {after}'
    return subprocess.run(
        ["bash", "-c", line], capture_output=True, text=True, timeout=120, check=False
    )


def test_a_full_disk_after_stdout_is_one_message() -> None:
    done = command("schema", "path", after="> /dev/full")
    assert done.returncode == 2
    assert done.stderr == "hodograph: output: cannot be written: No space left on device\n"


@pytest.mark.parametrize("stream", [">&-", "2>&-", ">&- 2>&-"])
def test_closed_streams_change_nothing(stream: str) -> None:
    done = command("schema", "path", after=stream)
    assert (done.returncode, done.stderr) == (0, "")


def test_each_command_that_takes_long_shows_its_time() -> None:
    """The others end at once, or go on until Ctrl-C with lines of their own."""
    at_once = {"init", "schema", "completion", "dbc", "resume", "override", "quick-stop", "reset"}
    until_interrupted = {"rig", "monitor", "record", "status"}
    assert _MODULES.keys() - _AWAITED == at_once | until_interrupted


# -- files that are written ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "words",
    [
        ("demo", "--no-browser", "--output", "file/out"),
        ("report", ALPHA, "-o", "file/out"),
        ("run", ALPHA, "--report", "file/out"),
        ("run", ALPHA, "--trace", "none/out.csv"),
        ("run", ALPHA, "--record", "none/out.log"),
        ("simulate", ALPHA, "--trace", "none/out.csv"),
        ("compile", ALPHA, "-o", "none/out.hdgp"),
        ("import", "part.ngc", "-o", "none/out.toml"),
    ],
    ids=lambda words: f"{words[0]} {words[-2]}",
)
def test_a_place_that_cannot_be_written_is_found_before_the_work(
    words: tuple[str, ...],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Nothing is planned, started or moved."""
    (tmp_path / "file").touch()
    (tmp_path / "part.ngc").write_text("G1 X1 F100\n")
    for module in (path_commands, report_commands, run_command, demo_command):
        monkeypatch.setattr(module, "load_pipeline", None)
    monkeypatch.setattr(toolpath_commands, "toolpath_job", None)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    assert main(words) == 2
    reason = "Not a directory" if words[-1].startswith("file") else "No such file or directory"
    (line,) = (x for x in capsys.readouterr().err.splitlines() if "using the local bus" not in x)
    assert line == f"hodograph: {words[-1]}: cannot be written: {reason}"
    assert {file.name for file in tmp_path.iterdir()} <= {"file", "part.ngc", "hodograph"}


def test_places_that_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder may be new; nothing is made."""
    monkeypatch.chdir(tmp_path)
    require_places(Path("new.csv"), None, folders=[Path("a/b"), tmp_path / "c", None, Path()])
    assert not list(tmp_path.iterdir())
    with pytest.raises(InputError, match="Is a directory"):
        require_places(tmp_path)
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(InputError, match="a/b: cannot be written: Permission denied"):
        require_places(folders=[Path("a/b")])


def test_a_link_stays_one(tmp_path: Path) -> None:
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_bytes(b"old")
    link.symlink_to(target)
    write_file(link, b"new")
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_a_device_can_be_written_where_its_folder_cannot() -> None:
    require_places(Path("/dev/null"))
    write_file(Path("/dev/null"), b"image")
    assert not Path("/dev/null").is_file()


def test_a_pipe_stays_a_pipe(tmp_path: Path) -> None:
    """As /dev/stdout, or /dev/null for root: it is written into, not replaced by a file."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    found: list[bytes] = []
    reader = threading.Thread(target=lambda: found.append(pipe.read_bytes()))
    reader.start()
    write_file(pipe, b"image")
    reader.join()
    assert found == [b"image"]
    assert pipe.is_fifo()


def test_without_a_home_matplotlib_says_nothing(tmp_path: Path) -> None:
    """It warns on stderr, beside our notes, when it can make no folder below the user's; here a file is in the way."""
    home = tmp_path / "home"
    home.touch()
    program = (
        "from hodograph.cli.main import main; main(['schema', 'path'])\n"
        "import matplotlib; print(matplotlib.get_cachedir())"
    )
    done = subprocess.run(
        [sys.executable, "-c", program],
        env=os.environ | {"HOME": str(home), "XDG_CONFIG_HOME": str(home), "MPLCONFIGDIR": ""},
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stderr == ""
    assert str(home) not in done.stdout.splitlines()[-1]
