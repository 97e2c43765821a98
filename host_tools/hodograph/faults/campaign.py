# SPDX-License-Identifier: MIT
"""All scenarios with all seeds, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ..bus.address import BusAddress, check_raw, is_virtual
from ..errors import BusError
from .judge import Verdict, judge
from .run_case import run_case
from .scenario import Scenario, draw

Progress = Callable[[Verdict], None]


def run_campaign(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    bus: BusAddress,
    drives_bus: BusAddress,
    part: tuple[int, int] = (1, 1),
) -> Iterator[Verdict]:
    """Runs and judges every scenario with every seed; of `part` (k, n) every n-th case, from the k-th on.

    Raises BusError when the buses are not two virtual ones.
    """
    for address in (bus, drives_bus):
        check_raw(address)
        if not is_virtual(address):
            raise BusError(f"{address}: not a virtual CAN: faults are for simulated machines only")
    cases = [draw(scenario, seed) for scenario in scenarios for seed in seeds]
    for case in cases[part[0] - 1 :: part[1]]:
        yield judge(run_case(case, bus, drives_bus))
