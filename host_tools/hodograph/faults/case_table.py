# SPDX-License-Identifier: MIT
"""Verdicts as a table: one row for each scenario, with the worst of its seeds. Used by cli/faults_command. No I/O."""

from __future__ import annotations

from collections.abc import Sequence

from .judge import Verdict

HEADER = (
    "scenario",
    "cases",
    "injected",
    "detected",
    "codes",
    "fault ticks",
    "fault ms",
    "rest ticks",
    "rest ms",
    "reset ms",
    "violations",
)


def rows(verdicts: Sequence[Verdict]) -> list[tuple[str, ...]]:
    """By scenario in the order of the campaign, then the sum."""
    names = list(dict.fromkeys(verdict.scenario for verdict in verdicts))
    table = [_row(name, [v for v in verdicts if v.scenario == name]) for name in names]
    return [*table, _row("all", list(verdicts))]


def _row(name: str, verdicts: Sequence[Verdict]) -> tuple[str, ...]:
    codes = sorted({code for verdict in verdicts for code in verdict.codes})
    return (
        name,
        str(len(verdicts)),
        str(sum(verdict.injected for verdict in verdicts)),
        str(sum(verdict.detected for verdict in verdicts)),
        " ".join(f"{code:04X}" for code in codes) if name != "all" else "",
        _worst([verdict.latency_ticks for verdict in verdicts]),
        _worst([verdict.latency_ms for verdict in verdicts]),
        _worst([verdict.rest_ticks for verdict in verdicts]),
        _worst([verdict.rest_ms for verdict in verdicts]),
        _worst([verdict.recovery_ms for verdict in verdicts]),
        str(sum(len(verdict.violations) for verdict in verdicts)),
    )


def _worst(values: Sequence[float | None]) -> str:
    known = [value for value in values if value is not None]
    return f"{max(known):.0f}" if known else "-"


def text(verdicts: Sequence[Verdict]) -> str:
    """The table with its header, columns aligned; then one line for each violation."""
    table = [HEADER, *rows(verdicts)]
    widths = [max(len(row[i]) for row in table) for i in range(len(HEADER))]
    lines = [
        "  ".join(
            cell.ljust(width) if i in (0, 4) else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in table
    ]
    lines += [
        f"violation: {verdict.scenario} seed {verdict.seed} {_drawn(verdict)}: {violation}"
        for verdict in verdicts
        for violation in verdict.violations
    ]
    return "\n".join(lines)


def _drawn(verdict: Verdict) -> str:
    values = ", ".join(f"{k}={v}" for k, v in verdict.drawn.items() if k != "seed")
    return f"({values})"
