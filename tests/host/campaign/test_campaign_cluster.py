# SPDX-License-Identifier: MIT
"""Campaigns by Dask: on the cores of this computer, killed and continued, and on a cluster, which may lose workers. Run
by pytest; starts processes, and writes to temporary folders.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from campaign_files import Write

from hodograph.cli.main import main

TEXT = """
paths = ["path.toml"]
profiles = ["quintic"]
samples = 1200
[vary.time_constant_s]
factor_uniform = [0.8, 1.2]
[vary.gain_rad_s_v]
values = [60, -1]
"""
HANGS_S = 600
LOOK_S = 0.01
COMMAND = [sys.executable, "-m", "hodograph", "campaign"]
KILLED = """
import json, os, signal, sys
from hodograph.campaign.results import Journal
from hodograph.cli.main import main

left, cut = int(sys.argv[1]), int(sys.argv[2])
write = Journal._write

def killing(self, value):
    global left
    left -= 1
    if left == 0:
        line = json.dumps(value, separators=(",", ":")).encode() + b"\\n"
        self._stream.write(line[:cut])
        self._stream.flush()
        os.kill(os.getpid(), signal.SIGKILL)
    write(self, value)

Journal._write = killing
main(sys.argv[3:])
"""
"""A campaign that is killed when it has written so many bytes of the line of this number of its journal."""
DASK = [sys.executable, "-m", "dask"]


def campaign(file: Path, folder: Path, *more: str) -> bytes:
    """Runs a campaign in this process; returns its table."""
    assert main(["campaign", str(file), "-o", str(folder), *more]) == 0
    return (folder / "runs.csv").read_bytes()


@contextmanager
def under_way(file: Path, folder: Path, *options: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process that makes the campaign (on two cores), when its first batch is done."""
    child = subprocess.Popen(
        [*COMMAND, str(file), "-o", str(folder), *(options or ("--workers", "2"))],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        start_new_session=True,
    )
    journal = folder / "runs.journal"
    while not (journal.exists() and b'{"runs"' in journal.read_bytes()):
        assert child.poll() is None, child.communicate()[1].decode()
        time.sleep(LOOK_S)
    yield child
    child.kill()


@pytest.mark.long
def test_killed_and_gone_on_with_on_two_cores(write: Write, tmp_path: Path) -> None:
    """In the middle of it, between two lines of its journal or within one."""
    file = write(TEXT)
    whole = campaign(file, tmp_path / "one", "--workers", "1")
    for line, cut in ((3, 1000), (4, 10_000_000)):
        folder = tmp_path / f"two-{line}"
        words = [str(line), str(cut), "campaign", str(file), "-o", str(folder), "--workers", "2"]
        done = subprocess.run(
            [sys.executable, "-c", KILLED, *words],
            start_new_session=True,
            capture_output=True,
            timeout=HANGS_S,
            check=False,
        )
        assert done.returncode == -signal.SIGKILL, done.stderr.decode()
        assert not (folder / "runs.csv").exists()
        assert campaign(file, folder, "--workers", "1") == whole


@contextmanager
def cluster(folder: Path) -> Iterator[tuple[str, subprocess.Popen[bytes]]]:
    """A scheduler and two workers on loopback, as one would start them on machines of their own; one of the workers."""
    at = folder / "scheduler.json"
    hosts = ["--host", "127.0.0.1", "--no-dashboard"]
    options = {"cwd": folder, "stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = [*DASK, "scheduler", "--scheduler-file", str(at), "--port", "0", *hosts]
    worker = [*DASK, "worker", "--scheduler-file", str(at), "--nthreads", "1", "--no-nanny", *hosts]
    worker += ["--local-directory", str(folder)]
    children = [subprocess.Popen(command, **options) for command in (scheduler, worker, worker)]  # type: ignore[call-overload]
    try:
        while not at.exists():
            assert children[0].poll() is None
            time.sleep(LOOK_S)
        yield json.loads(at.read_text())["address"], children[-1]
    finally:
        for child in children:
            child.kill()
            child.wait()


def test_a_cluster_gives_the_same_table(
    write: Write, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    file = write(TEXT)
    with cluster(tmp_path) as (address, worker):
        far = campaign(file, tmp_path / "far", "--scheduler", address)
        with under_way(file, tmp_path / "lost", "--scheduler", address) as child:
            worker.kill()
            _, reported = child.communicate(timeout=HANGS_S)
            assert child.returncode == 0, reported.decode()
    assert far == campaign(file, tmp_path / "near", "--workers", "1")
    assert (tmp_path / "lost" / "runs.csv").read_bytes() == far
    assert far.count(b"plant figures must be positive") == 1200
    assert "Traceback" not in capfd.readouterr().err + reported.decode()


def test_ctrl_c_is_one_line(write: Write, tmp_path: Path) -> None:
    """A terminal sends it to all processes; the next start goes on."""
    endless = TEXT.replace("samples = 1200", "samples = 20000")
    with under_way(write(endless), tmp_path / "out") as child:
        os.killpg(child.pid, signal.SIGINT)
        _, reported = child.communicate(timeout=HANGS_S)
    assert child.returncode == 130
    assert all(line.startswith("hodograph: ") for line in reported.decode().splitlines()), (
        reported.decode()
    )


def test_no_scheduler(
    write: Write,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.setattr("hodograph.campaign.runner.ANSWER_S", 1)
    file = write(TEXT)
    for address in ("tcp://127.0.0.1:9", "nonsense://x"):
        assert main(["campaign", str(file), "-o", str(tmp_path), "--scheduler", address]) == 2
        reported = capsys.readouterr().err
        assert f"--scheduler {address}: no Dask scheduler answers" in reported
        assert "Traceback" not in reported
