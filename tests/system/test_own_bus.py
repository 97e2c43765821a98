# SPDX-License-Identifier: MIT
"""Commands without --bus: the local bus of this user if the Linux kernel has no vcan0; and `hodograph demo`. Run by
pytest; starts `hodograph` and hubs, and writes to temporary folders.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import pytest

from hodograph.bus import own_bus
from hodograph.bus.address import parse_address
from hodograph.bus.hub import LocalHub, is_served
from hodograph.errors import BusError, InputError

ROOT = Path(__file__).resolve().parents[2]
ALPHA = ROOT / "examples/alpha.toml"
HANGS_S = 300.0


@pytest.fixture
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Mapping[str, str]:
    """A user without $HODOGRAPH_BUS, with a folder of their own."""
    monkeypatch.delenv("HODOGRAPH_BUS", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return dict(os.environ)


def hodograph(environment: Mapping[str, str], *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "hodograph", *words]
    return subprocess.run(
        command,
        env=dict(environment),
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
        stdin=subprocess.DEVNULL,
    )


@contextmanager
def simulated_machine(environment: Mapping[str, str]) -> Iterator[subprocess.Popen[str]]:
    command = [sys.executable, "-m", "hodograph", "rig", str(ALPHA)]
    with subprocess.Popen(
        command, env=dict(environment), stderr=subprocess.PIPE, text=True
    ) as machine:
        try:
            assert machine.stderr is not None
            for line in machine.stderr:
                if "Ctrl-C ends them" in line:
                    break
            yield machine
        finally:
            machine.send_signal(signal.SIGINT)


@pytest.fixture(scope="module")
def simulated() -> str:
    """The hash of the setpoints that `simulate` gives."""
    return setpoints(hodograph(os.environ, "simulate", str(ALPHA), "--json"))


def setpoints(kernel_run: subprocess.CompletedProcess[str]) -> str:
    assert kernel_run.returncode == 0, kernel_run.stderr
    return str(json.loads(kernel_run.stdout)["setpoints_sha256"])


def test_a_long_folder_for_temporary_files_is_left_out(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The system has a limit for the path of a socket, which such a folder can exceed; a relative one is not used."""
    folder = tmp_path / ("x" * 100)
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    for runtime in (str(folder), "relative", ""):
        monkeypatch.setenv("XDG_RUNTIME_DIR", runtime)
        assert own_bus.own_path() == Path(f"/tmp/hodograph-{os.getuid()}/bus")
    with LocalHub() as hub:
        assert Path(hub.address.channel).is_relative_to("/tmp")
        assert not Path(hub.address.channel).is_relative_to(folder)
    with pytest.raises(InputError, match="107 bytes"):
        parse_address(f"local:{folder}/bus")


def test_run_serves_a_bus_of_its_own_and_says_so(
    environment: Mapping[str, str], simulated: str
) -> None:
    run = hodograph(environment, "run", str(ALPHA), "--json", "--pace", "fast")
    assert setpoints(run) == simulated
    assert "using the local bus local:" in run.stderr


def test_other_commands_find_the_bus_of_a_simulated_machine(
    environment: Mapping[str, str],
) -> None:
    with simulated_machine(environment) as machine:
        status = hodograph(environment, "status", "--json")
        run = hodograph(environment, "run", str(ALPHA), "--json")
    assert machine.returncode == 0
    assert status.returncode == 0, status.stderr
    assert setpoints(run)
    after = hodograph(environment, "status")
    assert after.returncode == 4
    assert "hodograph rig FILE" in after.stderr
    assert "Traceback" not in after.stderr


def test_a_given_bus_that_is_not_there_is_an_error(environment: Mapping[str, str]) -> None:
    run = hodograph(environment, "run", str(ALPHA), "--bus", "socketcan:vcan97")
    assert run.returncode == 4
    assert "local bus local:" not in run.stderr


def test_a_folder_of_another_user_is_refused(
    environment: Mapping[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = os.getuid
    (tmp_path / "hodograph").mkdir()
    monkeypatch.setattr(os, "getuid", lambda: real() + 1)
    with pytest.raises(BusError, match="another user"), own_bus.opened_bus(None, print):
        pass


def test_the_hub_ends_with_the_command(
    environment: Mapping[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    with own_bus.opened_bus(None, print) as address:
        assert is_served(Path(address.channel))
        assert own_bus.bus_address(None) == address
    assert not is_served(Path(address.channel))
    assert str(address) in capsys.readouterr().out


def test_a_bus_whose_hub_was_killed_is_served_again(tmp_path: Path) -> None:
    """Its socket file stays; one that is served is left alone, and so is a file that is no socket."""
    path, file = tmp_path / "bus", tmp_path / "file"
    with LocalHub(paths=[path]) as hub:
        assert hub.child is not None
        hub.child.kill()
        hub.child.wait()
    assert path.is_socket()
    assert not is_served(path)
    with LocalHub(paths=[path]):
        assert is_served(path)
        with pytest.raises(BusError), LocalHub(paths=[path]):
            pass
        assert is_served(path)
    file.write_text("not a bus")
    with pytest.raises(BusError), LocalHub(paths=[file]):
        pass
    assert file.read_text() == "not a bus"


def test_demo(environment: Mapping[str, str], simulated: str, tmp_path: Path) -> None:
    """Live page, run and report, with the setpoints of `simulate`."""
    demo = hodograph(
        environment, "demo", "--no-browser", "--json", "--output", str(tmp_path / "out")
    )
    assert setpoints(demo) == simulated
    reported = json.loads(demo.stdout)
    assert reported["page"].startswith("http://127.0.0.1:")
    assert Path(reported["report"]).stat().st_size > 100_000
    assert reported["page"] in demo.stderr
