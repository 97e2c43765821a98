#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""fuzz.py [--seconds S] [--seed N] [--jobs N] [NAME...]: runs harnesses (C) and targets (Python) for S seconds each.

Run by `make fuzz`. Starts processes; writes new inputs and findings to build/fuzz.

C harnesses are tests/fuzz/fuzz_NAME.c, with libFuzzer under the address and undefined-behaviour sanitizers; Python
targets are in tools/fuzzing/targets.py. Without NAME all of them run. Prints executions, coverage and findings of each;
the last line is `N passed, N failed`, a harness without a finding being one that passed.
docs/validation/testing.md has more.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from fuzzing import harnesses
from fuzzing.harnesses import EXTRA_S, Result

ROOT = Path(__file__).resolve().parent.parent
PYTHON = ("path", "machine", "drive", "scenario", "campaign", "recording", "image", "eds")
_PREFIX = "python-"


def run_target(target: str, build: Path, seconds: int, seed: int) -> Result:
    """Runs a target of the Python side in a process of its own, which ends itself when a case hangs."""
    folder = build / "fuzz/python"
    words = [
        *(sys.executable, str(ROOT / "tools/fuzzing/child.py"), target, "--folder", str(folder)),
        *("--seconds", str(seconds), "--seed", str(seed)),
    ]
    name = _PREFIX + target
    try:
        done = subprocess.run(
            words,
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=seconds + EXTRA_S,
            check=False,
        )
        reported = json.loads(done.stdout.splitlines()[-1])
    except (subprocess.TimeoutExpired, ValueError, IndexError):
        case = (folder / target / "case").read_text(encoding="utf-8").strip()
        return Result(
            name, 0, None, [f"{name}: hangs or ended in {case}; files in {folder / target}"]
        )
    findings = [f"{name} --seed {seed}: {finding}" for finding in reported["findings"]]
    return Result(name, reported["cases"], None, findings)


def show(result: Result) -> None:
    """One line of the table."""
    coverage = "" if result.coverage is None else f"{result.coverage} edges"
    print(
        f"{result.name:18} {result.executions:10} executions  {coverage:>12}  {len(result.findings)} findings",
        flush=True,
    )


def main() -> int:
    known = [*harnesses.names(ROOT), *(_PREFIX + target for target in PYTHON)]
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(known))
    parser.add_argument("--build", type=Path, default=Path("build"))
    parser.add_argument("--seconds", type=int, default=60, help="of each")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    unknown = sorted(set(options.names) - set(known))
    if unknown:
        parser.error(f"no harness {', '.join(unknown)}: there are {', '.join(known)}")
    build = options.build.resolve()

    def run(name: str) -> Result:
        if name.startswith(_PREFIX):
            target = name.removeprefix(_PREFIX)
            result = run_target(target, build, options.seconds, options.seed)
        else:
            result = harnesses.run(name, ROOT, build, options.seconds, options.seed)
        show(result)
        return result

    with ThreadPoolExecutor(options.jobs) as pool:
        results = list(pool.map(run, options.names or known))
    for result in results:
        for finding in result.findings:
            print(f"failed: {finding}")
    failed = sum(1 for result in results if result.findings)
    print(f"{len(results) - failed} passed, {failed} failed", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
