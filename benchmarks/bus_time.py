# SPDX-License-Identifier: MIT
"""Bus time of two, three and six real drives on classic CAN and on CAN FD, by the model: load, tick, least period.

    .venv/bin/python benchmarks/bus_time.py --json OUT

Run by `make bench`. Prints to stdout, writes OUT.

The table of docs/reference/bus-time.md section 2.1. It takes no bus: CAN FD is modelled only, no code sends it.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from _figures import figures_parser, write_figures

from hodograph.bustime import PdoChoice, bus_time
from hodograph.bustime.fit import PERIODS_US

BITRATE = 1_000_000
DATA_RATES = (0, 2_000_000, 4_000_000, 5_000_000, 8_000_000)
"""0: classic CAN."""
DRIVES = (2, 3, 6)
CHOICES = {
    "setpoints": PdoChoice(volts=False),
    "with torque": PdoChoice(torque=True, volts=False),
}


def measure(count: int, data_bitrate: int, choice: PdoChoice) -> dict[str, Any]:
    """One row: at 1 ms, and the least period that fits; None: none of the four."""
    drives = dict.fromkeys(range(2, 2 + count), choice)
    every = {
        period: replace(bus_time(drives, period, BITRATE), data_bitrate=data_bitrate)
        for period in PERIODS_US
    }
    fitting = [period for period, found in every.items() if found.fits]
    return {
        "load_percent": every[1000].load_percent,
        "tick_us": every[1000].tick_us,
        "least_period_us": fitting[0] if fitting else None,
        "load_there_percent": every[fitting[0]].load_percent if fitting else None,
    }


def name_of(data_bitrate: int) -> str:
    """Nominal and data bit rate, Mbit/s."""
    return f"FD 1/{data_bitrate // BITRATE}" if data_bitrate else "classic 1"


def main() -> None:
    """Measure, print and write."""
    out: Path = figures_parser(__doc__, required=True).parse_args().json
    figures: dict[str, Any] = {}
    print("| real drives | bus, Mbit/s | at 1 ms | least period | torque: at 1 ms | least period |")
    print("| --- | --- | --- | --- | --- | --- |")
    for count in DRIVES:
        for rate in DATA_RATES:
            rows = {what: measure(count, rate, choice) for what, choice in CHOICES.items()}
            figures.setdefault(f"{count} drives", {})[name_of(rate)] = rows
            plain, torque = rows["setpoints"], rows["with torque"]
            cells = (_at_1_ms(plain), _least(plain), _at_1_ms(torque), _least(torque))
            print(f"| {count} | {name_of(rate)} | {' | '.join(cells)} |")
    write_figures(out, figures)


def _at_1_ms(row: dict[str, Any]) -> str:
    return f"{row['load_percent']:.1f} %, {row['tick_us']:.0f} us"


def _least(row: dict[str, Any]) -> str:
    if row["least_period_us"] is None:
        return "none"
    return f"{row['least_period_us'] // 1000} ms, {row['load_there_percent']:.1f} %"


if __name__ == "__main__":
    main()
