# SPDX-License-Identifier: MIT
"""hodograph latency: how late ticks are on this computer. Started by cli/main. Starts a controller or uses one on a
bus, receives frames, and prints to stdout.
"""

from __future__ import annotations

import platform
from argparse import Namespace
from collections.abc import Iterator

from ..bus.address import check_raw, parse_address
from ..config import load_machine
from ..data import EXAMPLES
from ..errors import BusError
from ..latency import Latency, is_realtime_kernel, measure, measure_own
from .output import duration_text, print_json

_BAR = 40


def latency(options: Namespace) -> None:
    """hodograph latency."""
    machine = load_machine(options.machine or EXAMPLES / "machines" / "paper_alpha.toml")
    if options.bus is None:
        found = measure_own(machine, options.seconds)
    else:
        address = parse_address(options.bus)
        if not address.is_raw:
            raise BusError(f"{address}: latency takes SocketCAN or a local bus, which stamp frames")
        check_raw(address)
        found = measure(address, machine.period_us, options.seconds)
    if options.json:
        print_json(found.json())
        return
    for line in _lines(found):
        print(line)


def _lines(found: Latency) -> Iterator[str]:
    count = found.lateness_us.size
    load = found.load
    kind = "with" if is_realtime_kernel() else "without"
    span = duration_text((count + found.missed) * found.period_us / 1e6)
    yield f"{count} ticks of {found.period_us} us ({span}) on {found.bus}, {found.missed} missed"
    yield f"kernel {platform.release()}, {kind} PREEMPT_RT, {load.cpus} processors"
    yield (
        f"processor load: {load.busy_percent:.0f} % of the processors (this measurement included), "
        f"load average {load.load_average_begin:.2f} to {load.load_average_end:.2f}"
    )
    yield (
        f"lateness: median {found.share_us(50):.0f} us, 99 % {found.share_us(99):.0f} us, "
        f"99.9 % {found.share_us(99.9):.0f} us, greatest {found.lateness_us.max():.0f} us"
    )
    yield f"{'from us':>8} {'to us':>8} {'ticks':>9}"
    for begin, end, ticks in found.histogram():
        bar = "#" * round(_BAR * ticks / count) or ("." if ticks else "")
        yield f"{begin:8} {'' if end is None else end:>8} {ticks:9} {bar}".rstrip()


COMMANDS = {"latency": latency}
