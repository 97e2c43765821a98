#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""run_benchmarks.py: runs each benchmarks/*.py, prints its figures and gathers them in build/bench.json. At the end it
prints each goal of benchmarks/goals.toml with its measured figure, and the load of the computer before and after.

Run by `make bench`. Starts processes; writes below BUILD.

Each script takes `--json OUT` and writes one JSON object: name of a figure to its value (a number, text,
or an object). A script with the line `# bench: bus` near its top runs under tools/with-vcan. Exit status
1 when one of them fails.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

from bench_goals import goal_lines, judged

ROOT = Path(__file__).resolve().parent.parent


def run(script: Path, out: Path) -> dict[str, Any] | None:
    """The figures of one script; None when it failed."""
    needs_bus = "# bench: bus" in script.read_text(encoding="utf-8")[:2000].splitlines()
    before = [str(ROOT / "tools/with-vcan"), "--own"] if needs_bus else []
    out.unlink(missing_ok=True)
    command = [*before, sys.executable, str(script), "--json", str(out)]
    done = subprocess.run(command, cwd=ROOT, stdin=subprocess.DEVNULL, check=False)
    if done.returncode != 0 or not out.exists():
        print(f"bench: {script.name} failed (exit status {done.returncode})", file=sys.stderr)
        return None
    figures: dict[str, Any] = json.loads(out.read_text(encoding="utf-8"))
    return figures


def table(figures: dict[str, Any], prefix: str = "") -> list[tuple[str, str]]:
    """Rows of (name, value); nested objects give dotted names."""
    rows: list[tuple[str, str]] = []
    for name, value in figures.items():
        if isinstance(value, dict):
            rows += table(value, f"{prefix}{name}.")
        else:
            rows.append((prefix + name, f"{value:.6g}" if isinstance(value, float) else str(value)))
    return rows


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("names", nargs="*", help="only these (benchmarks/NAME.py)")
    options = parser.parse_args()
    build = options.build.resolve()
    (build / "bench").mkdir(parents=True, exist_ok=True)
    scripts = sorted((ROOT / "benchmarks").glob("*.py"))
    results: dict[str, Any] = {}
    failed, load_before = False, os.getloadavg()[1]
    for script in scripts:
        if script.stem.startswith("_") or (options.names and script.stem not in options.names):
            continue
        print(f"== {script.stem}", flush=True)
        figures = run(script, build / "bench" / f"{script.stem}.json")
        failed = failed or figures is None
        if figures is not None:
            results[script.stem] = figures
    rows = table(results)
    width = max((len(name) for name, _ in rows), default=0)
    print()
    for name, value in rows:
        print(f"{name:<{width}}  {value}")
    (build / "bench.json").write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    goals = [
        goal
        for goal in judged(ROOT / "benchmarks" / "goals.toml", results)
        if goal.kept is not None or not options.names
    ]
    print("", *goal_lines(goals), sep="\n")
    print(
        f"\nload of {os.cpu_count()} cores: {load_before:.1f} before, {os.getloadavg()[1]:.1f} at the end"
    )
    print(f"written: {build / 'bench.json'}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
