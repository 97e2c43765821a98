# SPDX-License-Identifier: MIT
"""hodograph faults: runs fault scenarios and prints their verdicts. Started by cli/main. Starts processes, and prints
to stdout and stderr.
"""

from __future__ import annotations

from argparse import Namespace

from ..bus.address import parse_address
from ..data import EXAMPLES
from ..errors import InputError, RunError
from ..faults.case_runner import Buses, run_campaign
from ..faults.case_table import text
from ..faults.scenario import find_scenarios
from .output import note, print_json, progress

SCENARIOS = EXAMPLES / "faults"


def faults(options: Namespace) -> None:
    """Runs scenarios, prints the table; raises RunError when there is a violation."""
    scenarios = find_scenarios(options.folder or SCENARIOS, options.scenarios)
    if options.seed is None and options.seeds < 1:
        raise InputError("--seeds: must be at least 1, or nothing is tried")
    first = 0 if options.seed is None else options.seed
    seeds = range(first, first + (options.seeds if options.seed is None else 1))
    buses = None if options.buses is None else _two(options.buses)
    part, parts = options.part
    total = len(range(part - 1, len(scenarios) * len(seeds), parts))
    verdicts = []
    with progress("faults", "case", total) as bar:
        for verdict in run_campaign(scenarios, seeds, buses, options.part):
            verdicts.append(verdict)
            if options.verbose:
                note(f"{verdict.summary()}")
            bar(len(verdicts))
    violations = sum(len(verdict.violations) for verdict in verdicts)
    if options.json:
        print_json({"cases": [verdict.summary() for verdict in verdicts], "violations": violations})
    else:
        print(text(verdicts))
    if violations:
        raise RunError(f"{violations} violations in {len(verdicts)} cases")


def _two(buses: list[str]) -> Buses:
    controller, drives = map(parse_address, buses)
    return controller, drives


COMMANDS = {"faults": faults}
