# SPDX-License-Identifier: MIT
"""The same bits: what every target and every compiler makes of 203 programs, against the golden hashes.

The emulators run the images of `make firmware`, this machine those of `make target-hosts`. Run by pytest; starts
emulators and processes, and writes to temporary folders.
"""

from __future__ import annotations

import hashlib
import sys
from pathlib import Path

import numpy as np
import pytest

import target_bits
from target_bits import RUNS, Store

ROOT = Path(__file__).resolve().parents[2]
BUILD = ROOT / "build"
sys.path.insert(0, str(ROOT / "tools"))

from analysis import emulator  # noqa: E402

STORES = target_bits.stores()
CASES = [(store, run) for store in STORES for run in store.runs]
# Counts of 1 nm: each of two roundings adds half a count to what the kernels differ by.
MOST_COUNTS = {"fixed": 1, "float": 9}


def target_runner(name: str, stem: str = "setpoints") -> target_bits.Runner:
    target = emulator.TARGETS[name]
    image = BUILD / "firmware" / name / f"{stem}.elf"
    return lambda store, words: emulator.run(target, image, words, store)


def wrong(runner: target_bits.Runner, kernel: str) -> list[str]:
    """Programs whose setpoints are not the golden ones."""
    return [
        f"{row.name}, {run}"
        for store, run in CASES
        for row, data in target_bits.by_program(
            target_bits.setpoints(runner, store, run, kernel), store, run
        )
        if hashlib.sha256(data).hexdigest() != row.sha256[kernel]
    ]


@pytest.mark.parametrize("kernel", ["fixed", "float"])
@pytest.mark.parametrize("host", target_bits.HOSTS)
def test_hosts(host: str, kernel: str) -> None:
    assert wrong(target_bits.host_runner(BUILD, host), kernel) == []


@pytest.mark.parametrize(
    ("name", "kernel"),
    [(target.name, kernel) for target in emulator.TARGETS.values() for kernel in target.kernels],
)
def test_targets(name: str, kernel: str) -> None:
    assert wrong(target_runner(name), kernel) == []


@pytest.mark.parametrize("name", ["an385", "microbit", "rv32"])
def test_float_without_an_fpu(name: str) -> None:
    """IEEE single by a library gives the same bits: images that only this test uses."""
    assert wrong(target_runner(name, "setpoints_float"), "float") == []


def counts(store: Store, run: str, kernel: str) -> np.ndarray:
    data = target_bits.setpoints(target_bits.host_runner(BUILD, "gcc-O2"), store, run, kernel)
    return np.frombuffer(data, "<i4").astype(np.int64)


@pytest.mark.parametrize("kernel", list(MOST_COUNTS))
def test_near_the_double_kernel(kernel: str) -> None:
    """At every tick: the fixed kernel within its rounding, the float kernel within 10 nm.

    A stop may be on the border between two numbers of ticks, and kernels then choose different ones. Rests of one of
    the 139 random programs differ so, by less than 30 nm.
    """
    plain, stopped = 0, []
    for store, run in CASES:
        most = int(np.abs(counts(store, run, kernel) - counts(store, run, "double")).max())
        if run == "commands":
            stopped.append(most)
        else:
            plain = max(plain, most)
    assert plain <= MOST_COUNTS[kernel]
    assert kernel == "fixed" or plain > 0
    beyond = [most for most in stopped if most > MOST_COUNTS[kernel]]
    assert len(beyond) <= 1
    assert max(beyond, default=0) < 30


def test_what_is_run() -> None:
    """The alpha, the heart, the star and 200 random programs, some of them with overrides and holds."""
    names = [name for store in STORES for name in store.names]
    assert names[:3] == ["alpha", "heart", "star"]
    assert len(set(names)) == len(names) == 203
    rows = target_bits.golden()
    assert len(rows) == sum(len(store.names) for store, _ in CASES)
    assert len([name for name, run in rows if run == "commands"]) > 100
    assert max(tick for tick, _ in RUNS["commands"]) < rows["alpha", "commands"].ticks
