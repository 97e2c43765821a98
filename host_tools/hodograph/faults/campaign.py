# SPDX-License-Identifier: MIT
"""All scenarios with all seeds, one after the other."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from ..bus.address import check_raw, is_virtual
from ..errors import BusError
from .judge import Verdict, judge
from .run_case import Buses, run_case
from .scenario import Scenario, draw

Progress = Callable[[Verdict], None]


def run_campaign(
    scenarios: Sequence[Scenario],
    seeds: Sequence[int],
    buses: Buses | None,
    part: tuple[int, int] = (1, 1),
) -> Iterator[Verdict]:
    """Runs and judges every scenario with every seed; of `part` (k, n) every n-th case, from the k-th on.

    Without buses each case has its own. Raises BusError when those given are not virtual ones.
    """
    for address in buses or ():
        check_raw(address)
        if not is_virtual(address):
            raise BusError(f"{address}: not a virtual CAN: faults are for simulated machines only")
    cases = [draw(scenario, seed) for scenario in scenarios for seed in seeds]
    for case in cases[part[0] - 1 :: part[1]]:
        yield judge(run_case(case, buses))
