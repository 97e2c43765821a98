# SPDX-License-Identifier: MIT
"""Random frames while a program runs: setpoints and encoders stay those of the simulation. Run by pytest; starts a
controller and drives on a local bus.
"""

from __future__ import annotations

import random
import struct
import threading
from functools import cache
from pathlib import Path

import can
import pytest
from canopen_bench import NOTHING

from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.bus.local_bus import LocalBus
from hodograph.bus.run import run_program, run_session
from hodograph.pipeline import Pipeline, load_pipeline
from hodograph.simulate import Motion, simulate

HANGS_S = 600.0  # of real time: none of these takes a second
BURST = 3
"""Random frames at most at one instant: a period has room for a few more than the machine's own."""
LEAST_PAUSE_S = 0.0015
"""Between two bursts: together they would keep a setpoint back beyond the next SYNC, which is a step to the drive."""
MEAN_PAUSE_S = 0.002
OUR_NODES = (2, 3)


def random_frame(chance: random.Random) -> can.Message:
    """What a careless device may send: to the SDO servers of the drives, EMCY and heartbeats of unknown nodes,
    foreign PDOs, frames of wrong length, remote and extended ones. Nothing that is a valid command to the machine."""
    kind = chance.randrange(7)
    data = chance.randbytes(chance.randrange(9))
    if kind == 0:  # an SDO request to a drive, reads of anything, or nonsense
        node = chance.choice(OUR_NODES)
        command = chance.choice([0x40, 0xA0, 0xA4, 0x60, 0x70, 0xA1, 0xA2, 0xE0, 0x80])
        data = struct.pack("<BHB4s", command, chance.randrange(0x1000, 0x7000), 0, data[:4])
        return can.Message(arbitration_id=0x600 + node, data=data, is_extended_id=False)
    if kind == 1:  # too short for a request
        node = chance.choice((1, *OUR_NODES))
        return can.Message(arbitration_id=0x600 + node, data=data[:7], is_extended_id=False)
    if kind == 2:  # nodes that nobody knows
        base = chance.choice([0x080, 0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x580, 0x700])
        identifier = base + chance.randrange(20, 120)
        return can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
    if kind == 3:  # answers to questions that the controller did not ask
        identifier = 0x580 + chance.choice(OUR_NODES)
        data = struct.pack("<BHB4x", 0x43, chance.randrange(0x2000, 0x6000), 0)
        return can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
    if kind == 4:  # NMT to others, or no NMT command at all
        data = chance.choice([bytes([1, 99]), bytes([77, 2]), bytes([2]), bytes([2, 2, 0]), b""])
        return can.Message(arbitration_id=0, data=data, is_extended_id=False)
    identifier = chance.choice([0x000, 0x080, 0x182, 0x202, 0x203, 0x602, 0x601, 0x702])
    if kind == 5:
        return can.Message(
            arbitration_id=identifier, is_remote_frame=True, dlc=8, is_extended_id=False
        )
    return can.Message(arbitration_id=identifier, data=data, is_extended_id=True)


class Noise:
    """Sends random frames from a thread, which takes part in virtual time by itself."""

    def __init__(self, hub: LocalHub, clock: VirtualClock, seed: int) -> None:
        self.sent = 0
        self._channel = hub.address.channel
        self._clock = clock
        self._chance = random.Random(seed)
        self._ended = False
        self._joined = threading.Event()
        self._thread = threading.Thread(target=self._work, daemon=True)

    def _work(self) -> None:
        with LocalBus(self._channel, can_filters=NOTHING) as bus:
            self._joined.set()
            while not self._ended:
                for _ in range(self._chance.randint(1, BURST)):
                    bus.send(random_frame(self._chance))
                    self.sent += 1
                pause_s = min(self._chance.expovariate(1 / MEAN_PAUSE_S), 5 * MEAN_PAUSE_S)
                bus.clock.sleep(max(pause_s, LEAST_PAUSE_S))

    def __enter__(self) -> Noise:
        self._thread.start()
        assert self._joined.wait(HANGS_S)  # time stands still for it meanwhile
        return self

    def __exit__(self, *_: object) -> None:
        self._ended = True
        self._clock.sleep(5 * MEAN_PAUSE_S)
        self._thread.join()


@cache
def alpha(root: Path) -> tuple[Pipeline, Motion]:
    """The program, and what it does undisturbed."""
    pipeline = load_pipeline(root / "examples/alpha.toml")
    drives = [axis.drive for axis in pipeline.machine.path_axes if axis.drive is not None]
    return pipeline, simulate(pipeline.image, drives, counts_per_mm=pipeline.machine.counts_per_mm)


@pytest.mark.parametrize("seed", range(6))
def test_random_frames_change_nothing(
    hub: LocalHub, clock: VirtualClock, root: Path, seed: int
) -> None:
    pipeline, expected = alpha(root)
    machine = pipeline.machine
    with run_session(machine, hub.address, "real-time", 10.0, print) as at:
        at.controller.configure(machine, "fixed")
        at.controller.enable()
        with Noise(hub, clock, seed) as noise:
            motion = run_program(at, machine, pipeline.image, "fixed").motion
            at.controller.read(0x2002)
        assert noise.sent > 1500
    assert motion.setpoints_sha256 == expected.setpoints_sha256
    assert motion.encoders_sha256 == expected.encoders_sha256
