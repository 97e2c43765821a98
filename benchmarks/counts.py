# SPDX-License-Identifier: MIT
"""Instructions of the controller's tick on microcontrollers, counted in the emulator.

    python benchmarks/counts.py [--json OUT] [--build BUILD]

Run by `make bench`. Needs the counting emulator (`make counter`). Starts the emulator, writes OUT. Prints the main
figures of docs/validation/counts.md:

- motion part of a tick, and whole interrupt, for each core and kernel: median over the examples and maximum over all
  programs, plain and with the override in use;
- constant feed: median and maximum of a tick of the PH kernel and of the usual NURBS interpolator, and the feed ripple
  of both;
- the cost of the check of a program;
- the cost of the proof of its stops.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from _figures import figures_parser, write_figures

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tools"))

from analysis import checking, tables, taylor  # noqa: E402
from analysis.campaign import FLOOR, Campaign  # noqa: E402


def main_figures(counted: dict[str, Any]) -> dict[str, Any]:
    """The main figures, from all counts."""
    out: dict[str, Any] = {"floor": FLOOR}
    for section in ("motion", "isr"):
        for pair, scenarios in counted[section].items():
            row = out.setdefault(pair, {})
            for kind in ("plain", "override"):
                median, most = tables.worst(scenarios, kind)
                row[f"{section}_{kind}_median"] = median
                row[f"{section}_{kind}_most"] = most
    return out


def beside(compared: dict[str, Any]) -> dict[str, Any]:
    """Ours and the other's, by core."""
    return {
        f"{core} {name}": {
            "median": row["whole"][1],
            "most": row["whole"][2],
            "feed_ripple": row["ripple"],
        }
        for core, both in compared.items()
        for name, row in both.items()
    }


def main() -> None:
    """See the head of the file."""
    parser = figures_parser(__doc__)
    parser.add_argument("--build", type=Path, default=ROOT / "build")
    options = parser.parse_args()
    figures = main_figures(Campaign(options.build).run())
    figures["constant_feed"] = beside(taylor.compare(options.build))
    figures["check"] = checking.costs(options.build)
    figures["stop_check"] = checking.stop_costs(options.build)
    print(json.dumps(figures, indent=2))
    write_figures(options.json, figures)


if __name__ == "__main__":
    main()
