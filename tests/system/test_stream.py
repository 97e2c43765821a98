# SPDX-License-Identifier: MIT
"""Jobs in chunks on a bus: the controller process, drives, and a client that sends chunks by block download. Run by
pytest; starts a controller and drives on a local bus.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from canopen.sdo.exceptions import SdoAbortedError
from other_node import latched, settled

from bench import Bench, MakeBench
from hodograph.bus.capture.recorder import Recorder
from hodograph.bus.sdo.controller import FAULT_STATE, HELD, READY, RUNNING
from hodograph.bus.sdo.objects import HOLD, QUICK_STOP, RESUME, START, STOP
from hodograph.native.program import POINT
from hodograph.native.stream import OfflineStream
from marks import long
from straight_job import chunks, whole

STREAM = 0x2060
STATE_SUB, JOB_SUB, WANTED, REFUSED, FREE, COMMITTED, SEQUENCE = 2, 3, 4, 5, 7, 8, 9
ARC, UNDERRUNS, RING, CLOSE = 11, 13, 14, 15
NONE, OPEN, UNDERRUN, ENDED, STOPPED = range(5)
JOB, COUNT = 5, 3
LENGTH_COUNTS = (8 + 16 * COUNT) * 1_000_000
NO_MEMORY, REFUSED_VALUE = 0x05040005, 0x06090030
GAP_S = 0.01  # between two blocks the bus is left to heartbeats


class Stream:
    """A machine that is ready at the origin, and what a host says to it."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.parts = chunks(COUNT, JOB)

    def read(self, sub: int) -> int:
        """A sub-index of the stream object."""
        return self.bench.controller.read(STREAM, sub)

    def send(self, data: bytes) -> None:
        """A chunk by block download. Raises SdoAbortedError."""
        node = self.bench.controller

        def action() -> None:
            with node.sdo.open(
                STREAM, 1, "wb", buffering=0, size=len(data), block_transfer=True
            ) as out:
                node.transfer_begun()
                while out.pos < len(data):
                    out.write(data[out.pos : out.pos + 7])
                    if out._seqno == 0:
                        self.bench.clock.sleep(GAP_S)

        node.patiently(STREAM, 1, action)

    def refused(self, data: bytes) -> int:
        """Sends a chunk that is refused; gives the reason."""
        with pytest.raises(SdoAbortedError) as raised:
            self.send(data)
        assert raised.value.code == REFUSED_VALUE
        return self.read(REFUSED)

    def until(self, happened: Callable[[], bool], limit_s: float = 20.0) -> None:
        """Lets time pass."""
        end_s = self.bench.clock.now_s() + limit_s
        while not happened():
            assert self.bench.clock.now_s() < end_s
            self.bench.clock.sleep(0.005)

    def feed(self, begin: int, ahead_ms: int = 900) -> None:
        """The chunks from `begin` on, each so long before the tail of its predecessor."""
        for part in self.parts[begin:]:
            self.until(lambda: self.read(COMMITTED) <= 500 + ahead_ms)
            self.send(part)

    def start(self) -> None:
        """From the origin."""
        self.bench.controller.start()

    def command(self, number: int) -> None:
        """Any command."""
        self.bench.controller.command(number)

    def expect_end(self, underruns: int) -> None:
        """The job has been executed to its end."""
        assert settled(self.bench) == (READY, 0, 0)
        self.until(lambda: self.read(STATE_SUB) == ENDED, 1.0)
        assert self.read(UNDERRUNS) == underruns
        assert self.bench.controller.targets(2) == [LENGTH_COUNTS, 0]


@pytest.fixture
def stream(make_bench: MakeBench) -> Iterator[Stream]:
    made = Stream(make_bench())
    with Recorder(made.bench.bus) as recorder:
        made.bench.controller.enable()
        yield made
        frames = recorder.so_far()
    x, y = (latched(frames, node) for node in made.bench.machine.nodes)
    assert not np.any(y)  # on the path, at every instant
    assert np.abs(np.diff(x)).max(initial=0) <= 24_001
    accelerations = np.abs(np.diff(x, 2))
    assert (
        accelerations.max(initial=0) <= 1500
    )  # counts per tick^2: 1.5 m/s^2, far below the limits


def moving_part(targets: np.ndarray) -> np.ndarray:
    """Targets from the first to the last that differs."""
    (changes,) = np.nonzero(np.diff(targets))
    return targets[changes[0] : changes[-1] + 2]


def test_setpoints_are_those_of_the_job_in_one_piece(stream: Stream) -> None:
    offline = OfflineStream("fixed")
    assert offline.give(whole(COUNT, JOB)) is None
    points = offline.run(100_000)
    assert points.dtype == POINT
    counts = (points["position_q40"][:, 0].astype(object) * 1_000_000 + (1 << 39)) >> 40
    with Recorder(stream.bench.bus) as recorder:
        assert stream.read(STATE_SUB) == NONE
        stream.send(stream.parts[0])
        assert stream.read(STATE_SUB) == OPEN
        assert stream.read(JOB_SUB) == JOB
        assert stream.read(FREE) < stream.read(RING)
        stream.start()
        stream.feed(1)
        stream.expect_end(0)
        frames = recorder.so_far()
    with pytest.raises(Exception, match="started before"):
        stream.command(START)
    x = latched(frames, stream.bench.machine.nodes[0])
    assert np.array_equal(moving_part(x), moving_part(counts.astype(np.int64)))


def test_chunks_corrupt_out_of_order_and_again(stream: Stream) -> None:
    parts = stream.parts
    assert stream.refused(parts[1]) == -82
    stream.send(parts[0])
    stream.start()
    spoilt = bytearray(parts[1])
    spoilt[1000] ^= 1
    assert stream.refused(bytes(spoilt)) == -81
    assert stream.refused(parts[2]) == -83
    assert stream.read(WANTED) == 1
    stream.send(parts[1])
    assert stream.refused(parts[1]) == -83
    assert stream.refused(chunks(1, JOB + 1)[0]) == -82
    assert stream.read(REFUSED) == -82
    with pytest.raises(SdoAbortedError) as raised:
        stream.send(bytes(stream.read(RING) + 8))
    assert raised.value.code == NO_MEMORY
    stream.feed(2)
    stream.expect_end(0)


@pytest.mark.long
def test_late_chunks_cost_time_only(stream: Stream) -> None:
    stream.send(stream.parts[0])
    stream.start()
    for late, part in enumerate(stream.parts[1:]):
        stream.until(lambda: stream.read(STATE_SUB) == UNDERRUN)
        assert stream.bench.controller.state() == RUNNING
        assert stream.read(COMMITTED) == 0
        assert stream.read(UNDERRUNS) == late + 1
        stream.bench.clock.sleep(0.1 * late)
        stream.send(part)
    stream.expect_end(COUNT - 1)


def test_hold_and_resume_while_chunks_come(stream: Stream) -> None:
    stream.send(stream.parts[0])
    stream.start()
    for part in stream.parts[1:]:
        stream.until(lambda: stream.read(COMMITTED) < 700)
        stream.command(HOLD)
        stream.send(part)
        stream.bench.controller.wait_for((HELD,), 5.0)
        held = stream.read(ARC)
        stream.bench.clock.sleep(0.2)
        assert stream.read(ARC) == held
        stream.command(RESUME)
    stream.expect_end(0)


@pytest.mark.parametrize(
    ("after_s", "chunks_sent"), [long(0.4, 1), long(1.1, 2), (1.7, 1), (1.7, 2), long(2.6, 1)]
)
def test_a_stop_is_final(stream: Stream, after_s: float, chunks_sent: int) -> None:
    """Whether or not the next chunk is there already; what comes later is refused."""
    for part in stream.parts[:chunks_sent]:
        stream.send(part)
    stream.start()
    stream.bench.clock.sleep(after_s)
    stream.command(STOP)
    assert stream.refused(stream.parts[chunks_sent]) == -89
    assert settled(stream.bench) == (READY, 0, 0)
    stream.until(lambda: stream.read(STATE_SUB) == STOPPED, 1.0)
    rests_mm = stream.read(ARC) / 2**40
    assert abs(rests_mm - stream.bench.controller.targets(1)[0] / 1e6) < 1e-6
    assert stream.refused(stream.parts[stream.read(WANTED)]) == -89
    stream.bench.controller.write(STREAM, CLOSE, 1)
    assert stream.read(STATE_SUB) == NONE
    assert stream.read(JOB_SUB) == 0


@pytest.mark.long
def test_a_quick_stop_ends_the_job(stream: Stream) -> None:
    for part in stream.parts[:2]:
        stream.send(part)
    stream.start()
    stream.bench.clock.sleep(1.0)
    stream.command(QUICK_STOP)
    stream.until(lambda: stream.read(STATE_SUB) == STOPPED)


def test_a_host_that_is_gone(stream: Stream) -> None:
    """In the middle of a block: the transfer is ended by its time-out, the motion rests, and another client goes on."""
    node = stream.bench.controller
    stream.send(stream.parts[0])
    stream.start()
    data = stream.parts[1]

    def cut() -> None:
        out = node.sdo.open(STREAM, 1, "wb", buffering=0, size=len(data), block_transfer=True)
        for at in range(0, 700, 7):
            out.write(data[at : at + 7])
        out._initialized = False  # says no more

    node.patiently(STREAM, 1, cut)
    stream.bench.clock.sleep(4.0)
    assert stream.read(STATE_SUB) == UNDERRUN
    assert stream.read(WANTED) == 1
    stream.feed(1)
    stream.expect_end(1)
    assert stream.bench.controller.state() != FAULT_STATE


def test_commands_of_others_during_a_download(stream: Stream) -> None:
    """While blocks of a chunk come a hold passes, and another client's request is refused."""
    node = stream.bench.controller
    stream.send(stream.parts[0])
    stream.start()
    stream.bench.clock.sleep(0.5)
    data = stream.parts[1]

    def held() -> None:
        out = node.sdo.open(STREAM, 1, "wb", buffering=0, size=len(data), block_transfer=True)
        node.transfer_begun()
        while out.pos < len(data):
            out.write(data[out.pos : out.pos + 7])
            if out.pos == 70:
                node.sdo.network.send_message(0x601, bytes([0x2F, 1, 0x20, 0, HOLD, 0, 0, 0]))
        out.close()

    node.patiently(STREAM, 1, held)
    node.wait_for((HELD,), 5.0)
    stream.command(RESUME)
    stream.feed(2)
    stream.expect_end(0)
