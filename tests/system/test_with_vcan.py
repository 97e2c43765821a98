# SPDX-License-Identifier: MIT
"""tools/with-vcan: a command on a user-mode bus behaves as one run here, and nothing is left behind.

A bus is a kernel that boots: most tests share one, and those that end one in their own way use it for all there is to
see. Each wait has a limit below that of pytest (pyproject.toml), and says what did not come. Run by pytest; starts
tools/with-vcan, and writes to temporary folders.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
WITH_VCAN = str(ROOT / "tools/with-vcan")
HANGS_S = 600.0
WAIT_S = 300.0
LOOK_S = 0.02

SEND = """
import socket, sys
s = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
s.bind((sys.argv[3] if len(sys.argv) > 3 else "vcan0",))
for _ in range(int(sys.argv[2])):
    s.send(bytes([int(sys.argv[1]), 0, 0, 0, 1, 0, 0, 0, 42, 0, 0, 0, 0, 0, 0, 0]))
"""
RECEIVE = """
import socket, sys
s = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
s.bind((sys.argv[1] if len(sys.argv) > 1 else "vcan0",))
print("listening", flush=True)
print(s.recv(16)[0])
"""


class OpenBus:
    """A bus held open by a sleeping command."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.process = subprocess.Popen(
            [WITH_VCAN, "--user-mode", "--name", name, "sh", "-c", "echo up; exec sleep 600"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
        )
        assert line_of(self.process) == b"up\n"

    def command(self, *words: str) -> list[str]:
        return [WITH_VCAN, "--join", "--bus", self.name, *words]

    def run(self, *words: str, **more: object) -> subprocess.CompletedProcess[bytes]:
        options = {"stdin": subprocess.DEVNULL, "capture_output": True, "timeout": HANGS_S} | more
        if "input" in options:
            del options["stdin"]
        return subprocess.run(self.command(*words), check=False, **options)  # type: ignore[call-overload,no-any-return]

    def end(self, number: int) -> int:
        self.process.send_signal(number)
        with self.process:
            return self.process.wait(HANGS_S)


@contextlib.contextmanager
def started(command: list[str]) -> Iterator[subprocess.Popen[bytes]]:
    """A running command with its output as a pipe; it has to end by itself or by the test."""
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE) as process:
        try:
            yield process
        except BaseException:
            process.kill()
            raise


def line_of(process: subprocess.Popen[bytes]) -> bytes:
    """The next line of its output; a process that says nothing for too long is killed."""
    assert process.stdout is not None
    late = threading.Timer(WAIT_S, process.kill)
    late.start()
    try:
        line = process.stdout.readline()
    finally:
        late.cancel()
    assert line, f"no line in {WAIT_S:g} s, or the end: {process.args}"
    return line


@contextlib.contextmanager
def opened(name: str) -> Iterator[OpenBus]:
    bus = OpenBus(f"{name}-{os.getpid()}")
    try:
        yield bus
    finally:
        assert bus.end(signal.SIGTERM) == 128 + signal.SIGTERM


@pytest.fixture(scope="module")
def bus() -> Iterator[OpenBus]:
    with opened("t") as it:
        yield it


def processes_of(name: str) -> list[int]:
    """Processes, stubs and zombies included, whose command line has the bus's folder."""
    found = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with contextlib.suppress(OSError):
            if f"/{name}/".encode() in path.read_bytes():
                found.append(int(path.parent.name))
    return found


def folder_of(name: str) -> Path:
    return Path(f"/tmp/hodograph-bus-{os.getuid()}") / name


def wait_until(what: str, happened: Callable[[], bool]) -> None:
    end_s = time.monotonic() + WAIT_S
    while not happened():
        assert time.monotonic() < end_s, f"not in {WAIT_S:g} s: {what}"
        time.sleep(LOOK_S)


@pytest.mark.parametrize(
    ("script", "status"), [("exit 0", 0), ("exit 7", 7), ("kill -KILL $$", 137), ("kill $$", 143)]
)
def test_exit_status_passes_through(bus: OpenBus, script: str, status: int) -> None:
    assert bus.run("sh", "-c", script).returncode == status


def test_unknown_command_is_127_with_one_line(bus: OpenBus) -> None:
    done = bus.run("no-such-command")
    assert done.returncode == 127
    assert done.stderr.decode().splitlines() == [
        "with-vcan: cannot run no-such-command: No such file or directory"
    ]


def test_streams_pass_through_unchanged(bus: OpenBus) -> None:
    data = os.urandom(700_000)
    done = bus.run("sh", "-c", "echo words >&2; cat", input=data)
    assert done.stdout == data
    assert done.stderr == b"words\n"


def waiting_in(pipe: int) -> int:
    """Bytes."""
    return int(struct.unpack("i", fcntl.ioctl(pipe, termios.FIONREAD, bytes(4)))[0])


def test_a_slow_reader_holds_up_only_itself(bus: OpenBus) -> None:
    with started(bus.command("yes")) as flood:
        assert flood.stdout is not None
        pipe = flood.stdout.fileno()
        full = fcntl.fcntl(pipe, fcntl.F_GETPIPE_SZ)
        wait_until("the pipe is full", lambda: waiting_in(pipe) == full)
        assert bus.run("echo", "through").stdout == b"through\n"
        flood.stdout.close()
        assert flood.wait(HANGS_S) == 128 + signal.SIGPIPE


def test_folder_environment_user_and_mask_are_kept(bus: OpenBus, tmp_path: Path) -> None:
    script = 'pwd; echo "$WORD"; id -u; umask; touch made'
    environment = os.environ | {"WORD": "a 'quoted'\nword"}
    done = bus.run("sh", "-c", script, cwd=tmp_path, env=environment, umask=0o027)
    uid = os.getuid()
    assert done.stdout.decode() == f"{tmp_path}\na 'quoted'\nword\n{uid}\n0027\n"
    assert (tmp_path / "made").stat().st_mode & 0o777 == 0o640


def test_frames_go_from_one_shell_to_another(bus: OpenBus) -> None:
    with started(bus.command(sys.executable, "-c", RECEIVE)) as receiver:
        assert line_of(receiver) == b"listening\n"
        assert bus.run(sys.executable, "-c", SEND, "17", "1").returncode == 0
        assert line_of(receiver) == b"17\n"
        assert receiver.wait(HANGS_S) == 0


def test_a_second_bus_is_there_and_apart(bus: OpenBus) -> None:
    with started(bus.command(sys.executable, "-c", RECEIVE, "vcan1")) as receiver:
        assert line_of(receiver) == b"listening\n"
        assert bus.run(sys.executable, "-c", SEND, "1", "2", "vcan0").returncode == 0
        assert bus.run(sys.executable, "-c", SEND, "2", "1", "vcan1").returncode == 0
        assert line_of(receiver) == b"2\n"


def test_two_buses_are_two_and_of_one_that_ends_nothing_is_left(bus: OpenBus) -> None:
    with opened("other") as other:
        with started(other.command(sys.executable, "-c", RECEIVE)) as receiver:
            assert line_of(receiver) == b"listening\n"
            bus.run(sys.executable, "-c", SEND, "1", "3")
            other.run(sys.executable, "-c", SEND, "2", "1")
            assert line_of(receiver) == b"2\n"
        assert processes_of(other.name)
    assert processes_of(other.name) == []
    assert not folder_of(other.name).exists()


@pytest.mark.parametrize("name", ["INT", "TERM", "HUP"])
def test_signals_reach_the_command(bus: OpenBus, name: str) -> None:
    script = f"trap 'echo got {name}; exit 9' {name}; echo ready; while :; do sleep 0.05; done"
    with started(bus.command("sh", "-c", script)) as process:
        assert line_of(process) == b"ready\n"
        process.send_signal(signal.Signals[f"SIG{name}"])
        assert line_of(process) == f"got {name}\n".encode()
        assert process.wait(HANGS_S) == 9


def test_a_killed_client_takes_its_command_along(bus: OpenBus) -> None:
    mark = f"sleep 31{os.getpid()}"
    with started(bus.command("sh", "-c", f"echo ready; exec {mark}")) as process:
        assert line_of(process) == b"ready\n"
        process.kill()
    listing = ["sh", "-c", "cat /proc/[0-9]*/cmdline | tr '\\0' ' '"]
    wait_until("the command is gone", lambda: mark not in bus.run(*listing).stdout.decode())


def test_list_names_the_bus_and_unknown_names_are_refused(bus: OpenBus) -> None:
    listing = subprocess.run([WITH_VCAN, "--list"], capture_output=True, check=True, text=True)
    assert any(line.startswith(f"{bus.name}\tuser-mode\t") for line in listing.stdout.splitlines())
    command = [WITH_VCAN, "--join", "--bus", "no-such-bus", "true"]
    refused = subprocess.run(command, capture_output=True, check=False, text=True)
    assert refused.returncode == 125
    assert refused.stderr == "with-vcan: no bus named no-such-bus is open; tools/with-vcan --list\n"


def test_a_name_in_use_is_refused_and_its_bus_stays(bus: OpenBus) -> None:
    command = [WITH_VCAN, "--user-mode", "--name", bus.name, "true"]
    refused = subprocess.run(command, capture_output=True, check=False, text=True)
    assert refused.returncode == 125
    assert refused.stderr == (
        f"with-vcan: a bus named {bus.name} is open already; tools/with-vcan --list\n"
    )
    assert bus.run("true").returncode == 0


def test_inside_the_bus_that_is_there_is_used(bus: OpenBus) -> None:
    """Where the kernel has vcan0 there is nothing to open."""
    name = "readlink /proc/self/ns/net"
    plain = bus.run("sh", "-c", name).stdout
    assert bus.run(WITH_VCAN, "sh", "-c", name).stdout == plain


def test_a_kernel_with_can_gives_a_bus_in_a_namespace(bus: OpenBus, tmp_path: Path) -> None:
    """Inside user-mode Linux is a kernel with CAN: its namespaces stand for those of such a machine."""
    receive, send = f"{sys.executable} -c '{RECEIVE}'", f"{sys.executable} -c '{SEND}'"
    heard = tmp_path / "heard"
    ready = f"until grep -q listening {heard}; do sleep 0.05; done"
    script = (
        f"{WITH_VCAN} --own {receive} >{heard} & {ready}; {send} 3 2; kill $!; wait $!; cat {heard}"
    )
    done = bus.run("sh", "-c", script)
    assert done.stdout == b"listening\n"  # and no frame from the bus outside
    for name in ("vcan0", "vcan1"):
        heard.write_text("")
        inner = f"{receive} {name} >{heard} & {ready}; {send} 4 1 {name}; wait; cat {heard}"
        done = bus.run(WITH_VCAN, "--own", "sh", "-c", inner)
        assert done.stdout == b"listening\n4\n"


def test_beside_a_vcan0_the_second_bus_is_made(bus: OpenBus) -> None:
    """Where it may be: by root, whom `unshare` makes of everybody."""
    inner = f"ip link add dev vcan0 type vcan && ip link set vcan0 up && {WITH_VCAN} ip -o link show up type vcan"
    done = bus.run("unshare", "-rn", "sh", "-c", inner)
    names = [line.split()[1] for line in done.stdout.decode().splitlines()]
    assert names == ["vcan0:", "vcan1:"], done.stderr


def test_real_time_scheduling_is_allowed_inside(bus: OpenBus) -> None:
    program = (
        "import os; os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(50)); print('fifo')"
    )
    assert bus.run(sys.executable, "-c", program).stdout == b"fifo\n"


def test_nothing_is_left_after_sigkill() -> None:
    bus = OpenBus(f"kill-{os.getpid()}")
    bus.end(signal.SIGKILL)
    wait_until("no process is left", lambda: not processes_of(bus.name))
    wait_until("the folder is gone", lambda: not folder_of(bus.name).exists())


def test_nothing_runs_on_after_the_broker_is_killed() -> None:
    bus = OpenBus(f"broker-{os.getpid()}")
    process = bus.process.pid
    (broker,) = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    os.kill(int(broker), signal.SIGKILL)
    with bus.process:
        assert bus.process.wait(HANGS_S) == 125
    assert processes_of(bus.name) == []
    os.utime(folder_of(bus.name), (1, 1))  # a young one may be one that is just being made
    subprocess.run([WITH_VCAN, "--list"], capture_output=True, check=True)
    assert not folder_of(bus.name).exists()


def test_ctrl_c_while_booting_ends_at_once() -> None:
    name = f"early-{os.getpid()}"
    process = subprocess.Popen(
        [WITH_VCAN, "--user-mode", "--name", name, "sleep", "600"], stdin=subprocess.DEVNULL
    )
    wait_until("the bus has its folder", (folder_of(name) / "info.json").exists)
    process.send_signal(signal.SIGINT)
    assert process.wait(HANGS_S) == 130
    assert processes_of(name) == []
    assert not folder_of(name).exists()
