# SPDX-License-Identifier: MIT
"""Commands that write or print results: report, paper."""

from __future__ import annotations

from argparse import Namespace

from ..pipeline import load_pipeline
from .output import print_json
from .path_commands import print_notes, simulate_chain


def report(options: Namespace) -> None:
    """hodograph report."""
    from ..report import write_report

    chains = [load_pipeline(file, options.machine) for file in options.files]
    cases = []
    for chain in chains:
        print_notes(chain, chain.plan)
        cases.append((chain, simulate_chain(chain, options.kernel), None))
    print(write_report(cases, options.output))


def paper(options: Namespace) -> None:
    """hodograph paper."""
    from ..paper import compare, comparison_text

    comparison = compare()
    if options.json:
        print_json(comparison)
    else:
        print(comparison_text(comparison))


COMMANDS = {"report": report, "paper": paper}
