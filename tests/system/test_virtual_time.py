# SPDX-License-Identifier: MIT
"""Virtual time: the result of a simulation depends on its inputs only, not on the load of the computer. Run by pytest;
starts hubs, devices, `hodograph` and busy processes, and writes to temporary folders.
"""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from bench import PAPER_ALPHA, MakeBench
from commands import run_command, running
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.capture.recordings.candump import candump_lines
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.processes import Process, drive_command, find_program
from hodograph.bus.sdo.controller import OFF
from hodograph.config import load_machine
from hodograph.data import EXAMPLES
from hodograph.errors import BusError
from hodograph.faults.case_runner import run_case
from hodograph.faults.scenario import draw, find_scenarios
from marks import long

STOP_S = 1.0


def bus_log(scenario: str) -> bytes:
    """The bus of a machine in which a fault is injected: its run, the fault, the recovery, the run again."""
    (found,) = find_scenarios(EXAMPLES / "faults", [scenario])
    record = run_case(draw(found, 0), None)
    assert record.troubles == []
    assert record.began_us
    return candump_lines(record.control, "bus")


def _children(of: int) -> list[int]:
    return [int(pid) for pid in Path(f"/proc/{of}/task/{of}/children").read_text().split()]


def _descendants(of: int) -> list[int]:
    found = []
    for pid in _children(of):
        with contextlib.suppress(OSError):
            found += [pid, *_descendants(pid)]
    return found


@contextlib.contextmanager
def stopping_processes() -> Iterator[list[int]]:
    """Stops each process of ours once, for a second; gives those that were stopped."""
    ending = threading.Event()
    stopped: list[int] = []

    def work() -> None:
        while not ending.wait(0.1):
            for pid in set(_descendants(os.getpid())).difference(stopped):
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGSTOP)
                    stopped.append(pid)
                    ending.wait(STOP_S)
                    os.kill(pid, signal.SIGCONT)

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield stopped
    finally:
        ending.set()
        thread.join()


@contextlib.contextmanager
def busy_processes(count: int) -> Iterator[None]:
    spin = [sys.executable, "-c", "while True: pass"]
    children = [subprocess.Popen(spin) for _ in range(count)]
    try:
        yield
    finally:
        for child in children:
            child.kill()
            child.wait()


@pytest.mark.parametrize("scenario", [long("tpdo1-lost"), "kill-host"])
def test_the_same_bytes_with_any_process_stopped(scenario: str) -> None:
    plain = bus_log(scenario)
    assert plain.count(b"\n") > 5000
    with stopping_processes() as stopped:
        assert bus_log(scenario) == plain
    assert len(stopped) >= 3  # hub, injector, drives, controller: those that lived for long enough


def test_a_started_process_waits_for_the_one_that_started_it(
    hub: LocalHub, clock: VirtualClock, tmp_path: Path
) -> None:
    """Both take part at the same instant. Which of them sends first must not depend on the computer."""
    done = tmp_path / "done"
    script = (
        "import pathlib; from hodograph.bus.clock import hub_clock; "
        f"hub_clock({hub.address.channel!r}); pathlib.Path({str(done)!r}).touch()"
    )
    child = Process("child", [sys.executable, "-c", script], clock)
    time.sleep(0.5)  # in real time: enough for a process that does not wait
    assert not done.exists()
    clock.sleep(0.001)
    assert clock.await_end("child", child.child) == 0
    assert done.exists()
    child.end()


@contextlib.contextmanager
def one_core_only() -> Iterator[None]:
    """This process and all that it starts."""
    cores = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(cores)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, cores)


def test_the_same_bytes_at_any_load() -> None:
    """Beside four busy processes, and all on one core."""
    scenario = "drive-fault"
    plain = bus_log(scenario)
    with busy_processes(4):
        assert bus_log(scenario) == plain
    with one_core_only():
        assert bus_log(scenario) == plain


@pytest.mark.long
def test_the_same_bytes_of_ten_runs_at_different_loads() -> None:
    """Alone, beside one to eight busy processes, all on one core, and with each process stopped for a second."""
    busy = [(busy_processes(count),) for count in (0, 1, 2, 4, 8)]
    conditions: list[tuple[contextlib.AbstractContextManager[object], ...]] = [
        *busy,
        (one_core_only(),),
        (one_core_only(), busy_processes(4)),
        (stopping_processes(),),
        (stopping_processes(), busy_processes(4)),
        (one_core_only(), stopping_processes(), busy_processes(2)),
    ]
    logs = []
    for condition in conditions:
        with contextlib.ExitStack() as stack:
            for part in condition:
                stack.enter_context(part)
            logs.append(bus_log("drive-fault"))
    assert logs[0].count(b"\n") > 5000
    assert [log == logs[0] for log in logs] == [True] * 10


def test_time_stands_still_for_who_computes(make_bench: MakeBench) -> None:
    bench = make_bench()
    before_s = bench.clock.now_s()
    time.sleep(0.05)  # in real time: nobody notices
    assert bench.clock.now_s() == before_s
    bench.clock.sleep(0.25)
    assert bench.clock.now_s() == pytest.approx(before_s + 0.25, abs=1e-6)


def test_syncs_come_on_the_tick_when_the_bus_is_free(make_bench: MakeBench) -> None:
    bench = make_bench()
    with Recorder(bench.bus) as recorder:
        bench.clock.sleep(2.0)
        frames = recorder.so_far()
    syncs = frames["time_us"][frames["id"] == 0x080]
    assert abs(syncs.size - 2000) <= 1
    apart = np.diff(syncs)
    longest_frame_us = 135  # which may be on the bus already
    assert np.abs(apart - 1000).max() <= longest_frame_us
    assert np.median(apart) == 1000


def test_a_suspended_drive_is_missed_and_found_again(
    make_bench: MakeBench, clock: VirtualClock
) -> None:
    controller = make_bench().controller
    controller.enable()
    clock.suspend("drives")
    clock.sleep(5.0)
    assert controller.state() == 6
    assert "0x8250, node 2, 2 positions missed in a row" in controller.fault_text()
    clock.resume("drives")
    assert run_command(clock, "reset", "--wait", "10").returncode == 0
    assert controller.state() == OFF


def test_a_command_that_is_killed_is_waited_for_no_more(
    make_bench: MakeBench, clock: VirtualClock
) -> None:
    controller = make_bench().controller
    with running(clock, "status", "--watch") as watch:
        watch.await_text("off")
        watch.kill()
    clock.sleep(1.0)
    assert controller.state() == OFF


def test_a_process_that_ends_before_it_takes_part(clock: VirtualClock) -> None:
    done = run_command(clock, "status", "--bus", "nonsense:")
    assert done.returncode == 2
    assert "write interface:channel" in done.stderr


def test_the_end_of_the_hub_is_said(hub: LocalHub, clock: VirtualClock) -> None:
    machine = load_machine(PAPER_ALPHA)
    drives = Process("drives", drive_command(machine, hub.address), clock)
    clock.sleep(0.001)  # they have begun
    assert hub.child is not None
    hub.child.terminate()
    with pytest.raises(BusError, match="the local bus has ended"):
        clock.sleep(1.0)
    assert drives.child.wait(60) == 4
    assert "the bus failed" in drives.text()
    drives.end()


INTERRUPTED = """
import contextlib, signal, sys
from hodograph.bus.clock import hub_clock

class Interrupted(Exception):
    pass

def interrupt(*_):
    raise Interrupted

clock = hub_clock(sys.argv[1])
signal.signal(signal.SIGALRM, interrupt)
for k in range(5000):
    before_s = clock.now_s()
    with contextlib.suppress(Interrupted):
        signal.setitimer(signal.ITIMER_REAL, 1e-6 * (1 + k % 300))
        while True:
            clock.sleep(0.0001)
    assert clock.now_s() >= before_s
before_s = clock.now_s()
clock.sleep(1.0)
assert abs(clock.now_s() - before_s - 1.0) < 1e-6
"""


def test_signals_at_any_instant_of_a_wait(hub: LocalHub) -> None:
    """As Ctrl-C would end it: time goes on afterwards, and never back. A process of its own, as it may hang."""
    command = [sys.executable, "-c", INTERRUPTED, hub.address.channel]
    assert subprocess.run(command, timeout=300, check=False).returncode == 0


def test_a_bus_belongs_to_its_thread(hub: LocalHub) -> None:
    """Rather an error than a wait for ever."""
    errors: list[BaseException] = []
    bus = LocalBus(hub.address.channel)

    def receive() -> None:
        try:
            bus.recv(1.0)
        except RuntimeError as error:
            errors.append(error)

    thread = threading.Thread(target=receive)
    thread.start()
    thread.join()
    bus.shutdown()
    assert "belongs to the thread" in str(errors[0])


@pytest.mark.parametrize(
    ("words", "status", "said"),
    [
        ([], 2, "one to four paths"),
        (["bus"], 2, "needs a '/'"),
        (["./a", "./b", "./c", "./d", "./e"], 2, "one to four paths"),
        (["--time", "slow", "./bus"], 2, "real or virtual"),
        (["--bitrate", "0", "./bus"], 2, "bits per second"),
        (["--speed", "x", "./bus"], 2, "--speed takes"),
        (["--what", "./bus"], 2, "unrecognized option"),
        (["/no/such/folder/bus"], 4, "No such file"),
        (["./" + "x" * 120], 4, "too long"),
    ],
)
def test_what_the_hub_refuses(tmp_path: Path, words: list[str], status: int, said: str) -> None:
    done = subprocess.run(
        [str(find_program("hodograph-hub")), *words],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == status
    assert said in done.stderr
    assert list(tmp_path.iterdir()) == []


def test_the_pace_of_real_time_where_it_is_asked_for() -> None:
    """--speed 1: virtual time is never ahead of real time."""
    with LocalHub(speed=1.0) as hub:
        bus = LocalBus(hub.address.channel)
        begun_s = time.monotonic()  # before the pace counts: this process may be late afterwards
        bus.clock.sleep(0.3)
        assert time.monotonic() - begun_s >= 0.29
        bus.shutdown()


def test_the_pace_of_real_time_with_many_events() -> None:
    """Events closer together than a process can sleep: 0.3 s of them take no more than five times what as many sleeps
    of this process take, the longer time of those before and after them. Each used to take a millisecond.
    """
    steps, step_s = 3000, 1e-4

    def host_takes_s() -> float:
        begun_s = time.monotonic()
        for _ in range(steps):
            time.sleep(step_s)
        return time.monotonic() - begun_s

    before_s = host_takes_s()
    with LocalHub(speed=1.0) as hub:
        bus = LocalBus(hub.address.channel)
        begun_s = time.monotonic()  # as above
        for _ in range(steps):
            bus.clock.sleep(step_s)
        paced_s = time.monotonic() - begun_s
        bus.shutdown()
    host_s = max(before_s, host_takes_s())
    print(f"{steps} steps of {step_s} s: {paced_s:.3f} s; this host's own: {host_s:.3f} s")
    assert 0.29 <= paced_s <= 5.0 * host_s


class _TestSignal(Exception):
    pass


def test_a_signal_that_interrupts_no_call_ends_the_wait(clock: VirtualClock) -> None:
    """As one does that comes just before the call that waits: the handler of Python is due, but the call goes on."""

    def handler(*_: object) -> None:
        raise _TestSignal

    def send() -> None:
        signal.pthread_kill(threading.get_ident(), signal.SIGUSR1)  # not to the thread that waits

    before = signal.signal(signal.SIGUSR1, handler)
    sender = threading.Timer(0.2, send)
    try:
        sender.start()
        with pytest.raises(_TestSignal):
            clock.wait(None)
    finally:
        sender.join()
        signal.signal(signal.SIGUSR1, before)
    clock.sleep(0.001)  # and time goes on
