# SPDX-License-Identifier: MIT
"""Decides whether the frames of a machine fit its period, and which period, bit rate or number of drives would fit.
Used by cli/, api/bus and bus/analysis. Reads the EDS of the drives; no other I/O.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ..config import Machine
from ..config.axis_table import MAX_AXES
from ..config.outputs import Outputs
from ..errors import InputError
from .model import BusTime
from .pdos import PdoChoice
from .traffic import machine_drives, messages

PERIODS_US = (1000, 2000, 4000, 8000)
BITRATES = (125_000, 250_000, 500_000, 800_000, 1_000_000)
"""Bit rates of CiA 301 at which a tick can fit."""


def bus_time(
    drives: Mapping[int, PdoChoice],
    period_us: int,
    bitrate: int,
    *,
    controller: int = 1,
    outputs: Outputs | None = None,
) -> BusTime:
    """The bus time of these drives, by node, and of an I/O module."""
    found = messages(drives, period_us, controller=controller, outputs=outputs)
    return BusTime(found, bitrate, period_us)


def machine_bus_time(machine: Machine) -> BusTime:
    """The bus time of a machine file."""
    return _with(machine, machine_drives(machine))


def _with(
    machine: Machine,
    drives: Mapping[int, PdoChoice],
    *,
    period_us: int | None = None,
    bitrate: int | None = None,
) -> BusTime:
    return bus_time(
        drives,
        period_us or machine.period_us,
        bitrate or machine.bitrate,
        controller=machine.node,
        outputs=machine.outputs,
    )


def max_drives(period_us: int, bitrate: int, choice: PdoChoice | None = None) -> int:
    """The greatest number of drives (0 … 6), nodes 2 and up, whose tick fits."""
    for count in range(MAX_AXES, 0, -1):
        drives = dict.fromkeys(range(2, 2 + count), choice or PdoChoice())
        if bus_time(drives, period_us, bitrate).fits:
            return count
    return 0


def require_fit(machine: Machine) -> None:
    """Raises InputError: the frames of a tick do not fit the period; the message names values that fit."""
    found = machine_bus_time(machine)
    if found.fits:
        return
    count = len(machine.axes)
    raise InputError(
        f"{machine.file}: [bus] {count} drive{'s need' if count > 1 else ' needs'} up to {found.tick_us:.0f} us "
        f"a tick ({found.load_percent:.0f} % load) at {machine.bitrate} bit/s, but period_us is "
        f"{machine.period_us}: {_advice(machine)}"
    )


def _advice(machine: Machine) -> str:
    drives = machine_drives(machine)
    periods = [
        p for p in PERIODS_US if p > machine.period_us and _with(machine, drives, period_us=p).fits
    ]
    bitrates = [
        b for b in BITRATES if b > machine.bitrate and _with(machine, drives, bitrate=b).fits
    ]
    advice = [f"period_us = {periods[0]}"] if periods else []
    advice += [f"bitrate = {bitrates[0]}"] if bitrates else []
    fewer = _fewer(machine)
    if fewer:
        advice.append(f"at most {fewer} drive{'s' if fewer > 1 else ''}")
    advice += _less(machine, drives)
    if not advice:
        return f"use both a longer period and a higher bitrate, such as {_both(machine)}"
    return "use " + " or ".join(advice)


def _fewer(machine: Machine) -> int:
    """The number of drives, from the first, that fit; 0: not even one."""
    for count in range(len(machine.axes) - 1, 0, -1):
        if _with(machine, machine_drives(machine, count)).fits:
            return count
    return 0


def _less(machine: Machine, drives: Mapping[int, PdoChoice]) -> list[str]:
    """The first PDO content whose removal is enough, as a remedy."""
    remedies = (
        ("[axis.feedforward] velocity = 0", {"velocity": False}),
        ("no [axis.feedforward]", {"velocity": False, "torque": False}),
        ("[[axis]] without drive = (only simulated drives send volts)", {"volts": False}),
    )
    for text, without in remedies:
        fewer = {node: replace(choice, **without) for node, choice in drives.items()}
        if fewer != drives and _with(machine, fewer).fits:
            return [text]
    return []


def _both(machine: Machine) -> str:
    drives = machine_drives(machine)
    for bitrate in BITRATES:
        for period_us in PERIODS_US:
            if _with(machine, drives, period_us=period_us, bitrate=bitrate).fits:
                return f"period_us = {period_us} with bitrate = {bitrate}"
    return "fewer drives at 8000 us and 1000000 bit/s"
