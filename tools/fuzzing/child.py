#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""child.py TARGET --folder DIR [--seconds S] [--seed N] [--case K]: cases of one target, until the time is over.

Started by tools/fuzz.py, once for each target. Writes to DIR.

Says one line of JSON at its end: cases, findings. A case that takes longer than HANG_S ends the process with the traces
of its threads; the folder then has its files and its number.
"""

from __future__ import annotations

import argparse
import faulthandler
import json
import sys
import time
import traceback
from itertools import count
from pathlib import Path
from random import Random

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from fuzzing.targets import TARGETS, Finding

HANG_S = 120
"""Longest time of a case."""
MOST_FINDINGS = 20
"""A run ends after this number of findings."""


def run_case(target: str, seed: int, case: int, folder: Path) -> str | None:
    """What is wrong with the case; None: nothing."""
    try:
        TARGETS[target].run(Random(f"{target} {seed} {case}"), folder)
    except Finding as finding:
        return str(finding)
    except Exception:
        return traceback.format_exc()
    return None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("target", choices=TARGETS)
    parser.add_argument("--folder", type=Path, required=True)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--case", type=int, help="only this one")
    options = parser.parse_args()
    folder = options.folder / options.target
    folder.mkdir(parents=True, exist_ok=True)
    findings: list[str] = []
    end_s = time.monotonic() + options.seconds
    done = 0
    for case in count() if options.case is None else (options.case,):
        if time.monotonic() > end_s or len(findings) == MOST_FINDINGS:
            break
        (folder / "case").write_text(f"{options.target} --seed {options.seed} --case {case}\n")
        faulthandler.dump_traceback_later(HANG_S, exit=True)
        wrong = run_case(options.target, options.seed, case, folder)
        faulthandler.cancel_dump_traceback_later()
        done += 1
        if wrong is not None:
            findings.append(f"case {case}: {wrong}")
            print(f"{options.target} --seed {options.seed} --case {case}: {wrong}", file=sys.stderr)
    print(json.dumps({"cases": done, "findings": findings}))
    return 1 if findings else 0


if __name__ == "__main__":
    sys.exit(main())
