# SPDX-License-Identifier: MIT
"""Whether a machine's tick fits its period, and what would."""

from __future__ import annotations

from collections.abc import Sequence

from ..config import Machine
from ..errors import InputError
from .model import BusTime
from .traffic import messages

PERIODS_US = (1000, 2000, 4000, 8000)
BITRATES = (125_000, 250_000, 500_000, 800_000, 1_000_000)
"""Of CiA 301, as far as a tick could ever fit."""
MAX_DRIVES = 6


def bus_time(
    nodes: Sequence[int],
    period_us: int,
    bitrate: int,
    *,
    controller: int = 1,
    only_first_pdos: bool = False,
) -> BusTime:
    """The bus time of these drives."""
    found = messages(nodes, period_us, controller=controller, only_first_pdos=only_first_pdos)
    return BusTime(found, bitrate, period_us)


def machine_bus_time(machine: Machine) -> BusTime:
    """The bus time of a machine file."""
    return bus_time(machine.nodes, machine.period_us, machine.bitrate, controller=machine.node)


def max_drives(period_us: int, bitrate: int, *, only_first_pdos: bool = False) -> int:
    """The greatest number of drives (0 … 6), nodes 2 and up, whose tick fits."""
    for count in range(MAX_DRIVES, 0, -1):
        nodes = range(2, 2 + count)
        if bus_time(nodes, period_us, bitrate, only_first_pdos=only_first_pdos).fits:
            return count
    return 0


def require_fit(machine: Machine) -> None:
    """Raises InputError, which says what would fit, when the machine's tick does not fit its period."""
    found = machine_bus_time(machine)
    if found.fits:
        return
    raise InputError(
        f"{machine.file}: [bus] {len(machine.axes)} drives need up to {found.tick_us:.0f} us a tick "
        f"({found.load_percent:.0f} % load) at {machine.bitrate} bit/s, but period_us is {machine.period_us}: "
        + _advice(machine)
    )


def _advice(machine: Machine) -> str:
    nodes = machine.nodes

    def fits(period_us: int, bitrate: int) -> bool:
        return bus_time(nodes, period_us, bitrate, controller=machine.node).fits

    periods = [p for p in PERIODS_US if p > machine.period_us and fits(p, machine.bitrate)]
    bitrates = [b for b in BITRATES if b > machine.bitrate and fits(machine.period_us, b)]
    drives = max_drives(machine.period_us, machine.bitrate)
    advice = [f"period_us = {periods[0]}"] if periods else []
    advice += [f"bitrate = {bitrates[0]}"] if bitrates else []
    if drives:
        advice.append(f"at most {drives} drive{'s' if drives > 1 else ''}")
    if not advice:
        return f"use both a longer period and a higher bitrate, such as {_both(machine)}"
    return "use " + " or ".join(advice)


def _both(machine: Machine) -> str:
    nodes = machine.nodes
    for bitrate in BITRATES:
        for period_us in PERIODS_US:
            if bus_time(nodes, period_us, bitrate, controller=machine.node).fits:
                return f"period_us = {period_us} with bitrate = {bitrate}"
    return "fewer drives at 8000 us and 1000000 bit/s"
