# SPDX-License-Identifier: MIT
"""The bounds of the model against a bus that arbitrates frame by frame, with all senders at their worst case. Run by
pytest; starts and writes nothing.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from hodograph.bustime import BusTime, PdoChoice, bus_time, max_drives
from hodograph.bustime.model import COMPUTE_US, DRIVE_REACTION_US
from hodograph.bustime.response import Task, response_time
from hodograph.bustime.traffic import SDO, Message, sync_bits

RATE = 1_000_000
Release = tuple[int, int, int, str]  # when, identifier, bits, name


LEAST, USUAL = PdoChoice(volts=False, inputs=False), PdoChoice()
MOST = PdoChoice(torque=True, velocity=True)


def machine(count: int, period_us: int, choice: PdoChoice = USUAL, rate: int = RATE) -> BusTime:
    return bus_time(dict.fromkeys(range(2, 2 + count), choice), period_us, rate)


def arbitrated(releases: list[Release]) -> dict[tuple[str, int], int]:
    """When each frame, known by name and release, has left a bus where the lowest identifier goes first."""
    queue = sorted(releases)
    waiting: list[tuple[int, int, int, str]] = []
    ended, now, at = {}, 0, 0
    while at < len(queue) or waiting:
        if not waiting:
            now = max(now, queue[at][0])
        while at < len(queue) and queue[at][0] <= now:
            when, identifier, bits, name = queue[at]
            heapq.heappush(waiting, (identifier, when, bits, name))
            at += 1
        _, when, bits, name = heapq.heappop(waiting)
        now += bits
        ended[name, when] = now
    return ended


@settings(max_examples=200, deadline=None)
@given(st.data(), st.integers(2, 6))
def test_response_time_is_a_bound(data: st.DataObject, count: int) -> None:
    draw = data.draw
    tasks = [
        Task(draw(st.integers(50, 135)), draw(st.integers(401, 2000)), draw(st.integers(0, 400)))
        for _ in range(count)
    ]
    assume(sum(task.length / task.period for task in tasks) < 0.9)
    bounds = [
        response_time(task, tasks[:i], max((t.length for t in tasks[i + 1 :]), default=0), 1)
        for i, task in enumerate(tasks)
    ]
    releases, nominal = [], {}
    for i, task in enumerate(tasks):
        offset = draw(st.integers(0, task.period - 1))
        for k in range(6000 // task.period):
            due = offset + k * task.period
            when = due + draw(st.sampled_from([0, task.jitter]))
            if (str(i), when) not in nominal:
                releases.append((when, i, task.length, str(i)))
                nominal[str(i), when] = due
    for (name, when), ended in arbitrated(releases).items():
        bound = bounds[int(name)]
        assert bound is None or ended - nominal[name, when] <= bound


def test_response_time_of_the_paper() -> None:
    """Davis et al. 2007, section 3.3: C is missed in its second instance only, which the older analysis overlooks."""
    a, b, c = Task(1000, 2500, 0), Task(1000, 3500, 0), Task(1000, 3500, 0)
    assert response_time(a, [], 1000, 1) == 2000
    assert response_time(b, [a], 1000, 1) == 3000
    assert response_time(c, [a, b], 0, 1) == 3500


def test_a_full_bus_has_no_bound() -> None:
    assert response_time(Task(100, 200, 0), [Task(100, 200, 0)], 0, 1) is None


def unkind_releases(model: BusTime, draw: Any, ticks: int) -> Iterator[Release]:
    reaction = model.reaction_us
    for message in model.messages:
        if message.kind in ("heartbeats", "inputs"):
            when = draw(st.integers(0, ticks * model.period_us))
            yield when, message.identifier, message.worst_bits, message.kind
    for _ in range(draw(st.integers(0, 3 * ticks))):
        when = draw(st.integers(0, ticks * model.period_us))
        yield when, SDO.identifier + when % 127, SDO.worst_bits, "sdo"
    assert reaction == DRIVE_REACTION_US


def run_ticks(model: BusTime, draw: Any, ticks: int) -> dict[str, int]:
    """Greatest time from a SYNC's request to the end of each message, on a bus of 1 Mbit/s (1 bit = 1 us).

    Setpoints are computed meanwhile, and drives answer within their reaction time; so releases depend on
    the bus, and the SYNC of each tick is found first.
    """
    others = list(unkind_releases(model, draw, ticks))
    worst: dict[str, int] = {}
    releases: list[Release] = list(others)
    for tick in range(ticks):
        requested = tick * model.period_us + 500
        releases.append((requested, 0x80, sync_bits()[1], "SYNC"))
        sync_end = arbitrated(releases)["SYNC", requested]
        worst["SYNC"] = max(worst.get("SYNC", 0), sync_end - requested)
        for message in model.messages:
            if message.kind in ("SYNC", "heartbeats", "inputs"):
                continue
            if message.kind in ("setpoints", "offsets"):
                when = max(sync_end, requested + draw(st.integers(0, model.compute_us)))
            else:
                when = sync_end + draw(st.integers(0, model.reaction_us))
            name = f"{message.kind} {message.identifier}"
            releases.append((when, message.identifier, message.worst_bits, name))
    ends = arbitrated(releases)
    by_name: dict[str, list[int]] = {}
    for (name, _), ended in sorted(ends.items(), key=lambda item: item[0][1]):
        by_name.setdefault(name, []).append(ended)
    for name, times in by_name.items():
        if name not in ("sdo", "heartbeats", "inputs", "SYNC"):
            worst[name] = max(t - (500 + k * model.period_us) for k, t in enumerate(times))
    return worst


@settings(max_examples=60, deadline=None)
@given(
    st.data(),
    st.sampled_from(
        [(1, 1000), (2, 1000), (3, 1000), (6, 2000)],
    ),
    st.sampled_from([LEAST, USUAL, MOST]),
)
def test_no_tick_is_slower_than_the_model(
    data: st.DataObject, size: tuple[int, int], choice: PdoChoice
) -> None:
    drives, period_us = size
    compute_us = data.draw(st.sampled_from([COMPUTE_US, 150]))
    model = replace(machine(drives, period_us, choice), compute_us=compute_us)
    assume(model.fits)
    worst = run_ticks(model, data.draw, 3)
    for message, bound in zip(model.messages, model.responses_us, strict=True):
        name = "SYNC" if message.kind == "SYNC" else f"{message.kind} {message.identifier}"
        if name in worst:
            assert bound is not None
            assert worst[name] <= bound, name


def test_the_bound_of_the_tick_is_reached() -> None:
    """An SDO frame begins just before SYNC, and all drives answer at once: the last setpoint is latest."""
    model = machine(3, 1000)
    sync_end = SDO.worst_bits + sync_bits()[1]
    frames = [(0, SDO.identifier, SDO.worst_bits, "sdo"), (0, 0x80, sync_bits()[1], "SYNC")]
    frames[0] = (-1, *frames[0][1:])
    for message in model.messages:
        if message.kind in ("setpoints", "positions"):
            frames.append((sync_end, message.identifier, message.worst_bits, "pdo"))
            frames[-1] = (*frames[-1][:3], str(message.identifier))
    last = max(arbitrated(frames).values())
    assert abs(last - model.tick_us) <= 1


def test_a_tick_that_computes_no_longer_than_sync_lasts_costs_nothing() -> None:
    model = machine(3, 1000)
    assert replace(model, compute_us=0).tick_us == model.tick_us
    assert replace(model, compute_us=sync_bits()[1] + 100).tick_us == model.tick_us + 100


def test_jitter_of_sync() -> None:
    least, greatest = sync_bits()
    assert machine(2, 1000).sync_jitter_us == SDO.worst_bits + greatest - least
    assert machine(2, 8000, rate=RATE // 8).sync_jitter_us == 8 * (135 + greatest - least)


def test_load_by_hand() -> None:
    model = BusTime((Message("SYNC", 0x80, 1, 1000), Message("x", 0x555, 8, 2000)), RATE, 1000)
    sync = sync_bits()[1]
    assert model.load_percent == pytest.approx(100 * (sync / 1000 + 131 / 2000), rel=0.02)
    assert model.plain_load_percent == pytest.approx(100 * (55 / 1000 + 111 / 2000))
    assert model.load_of("x")[0] == pytest.approx(5.55)


@pytest.mark.parametrize("choice", [LEAST, USUAL])
def test_as_many_drives_as_were_promised(choice: PdoChoice) -> None:
    """Up to 3 drives at 1 ms and 6 at 2 ms on 1 Mbit/s."""
    assert max_drives(1000, RATE, choice) == 3
    assert max_drives(2000, RATE, choice) == 6


def test_inputs_count_at_worst_only() -> None:
    model, without = machine(2, 1000), machine(2, 1000, PdoChoice(inputs=False))
    assert model.plain_load_percent == without.plain_load_percent
    assert model.load_of("inputs")[0] == 0
    assert model.load_of("inputs")[1] == pytest.approx(2 * 95 / 100, rel=0.05)  # bits a 10 ms
    assert model.load_percent == pytest.approx(without.load_percent + model.load_of("inputs")[1])


@pytest.mark.parametrize("bitrate", [125_000, 250_000, 500_000, 800_000, RATE])
def test_more_time_never_takes_fewer_drives(bitrate: int) -> None:
    counts = [max_drives(period_us, bitrate) for period_us in (1000, 2000, 4000, 8000)]
    assert counts == sorted(counts)
    assert bitrate == RATE or counts[0] <= max_drives(1000, RATE)


def test_can_fd_shortens_the_tick_as_far_as_identifiers_allow() -> None:
    classic = machine(6, 1000, LEAST)
    ticks = [replace(classic, data_bitrate=rate * RATE).tick_us for rate in (1, 2, 4, 5, 8)]
    assert ticks == sorted(ticks, reverse=True)
    assert classic.tick_us > ticks[1] > 1000 > ticks[2], "six drives at 1 ms take 4 Mbit/s"
    # By hand at 1 and 5 Mbit/s: a frame of 8 bytes in the way, then six positions and six setpoints.
    eight, six = 34 + 113 / 5, 34 + 93 / 5
    assert ticks[3] == pytest.approx(COMPUTE_US + eight + 12 * six)
    loads = [replace(classic, data_bitrate=rate * RATE).load_percent for rate in (2, 8)]
    assert classic.load_percent > loads[0] > loads[1]
