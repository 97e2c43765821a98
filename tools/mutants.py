#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""mutants.py [--count N] [--seed N] [--again] [--list] AREA...: checks whether tests find planted mistakes.

Run by `make mutants`. Starts compilers and tests; writes to BUILD/mutation only.

Plants one mistake at a time (a comparison turned round, a constant one off, a statement left out) in the
sources of an area and runs the area's tests: C sources with the unit tests that link them, under the
sanitizers; Python modules, and C sources of the native module, in a copy of the
tree with Python tests. A mistake that no test notices has survived: it is printed with its place.
Mistakes are a random sample that depends on the seed alone. What is known from an earlier run
(BUILD/mutation/AREA.jsonl) is not tried again for as long as the source stays as it is; --again tries
those that survived once more. Exit status 0 whatever survives: a survivor is for a reader to judge.
docs/validation/mutation.md has more.
"""

from __future__ import annotations

import argparse
import random
import sys
from collections import Counter
from pathlib import Path

from mutation import c_sites, python_sites
from mutation.areas import AREAS, Area, area_named
from mutation.c_tests import CTests
from mutation.outcome import INVALID, KILLED, SAME, SURVIVED, Ledger, Outcome
from mutation.python_tests import PythonTests
from mutation.sites import Mutant

ROOT = Path(__file__).resolve().parent.parent


def sampled(area: Area, seed: int, root: Path = ROOT) -> list[Mutant]:
    """Every mutant of the area in an order that depends on the seed alone; at most one for a line comes first."""
    find = c_sites.find if area.in_c else python_sites.find
    mutants = [
        mutant
        for path in area.files(root)
        for mutant in find(path, (root / path).read_text(encoding="utf-8"))
    ]
    random.Random(f"{seed} {area.name}").shuffle(mutants)
    seen: set[tuple[str, int]] = set()
    first: list[Mutant] = []
    later: list[Mutant] = []
    for mutant in mutants:
        place = (mutant.path, mutant.line)
        (later if place in seen else first).append(mutant)
        seen.add(place)
    return first + later


def run_area(area: Area, options: argparse.Namespace, c_tests: CTests | None) -> Counter[str]:
    """Tries the area's sample out, prints each survivor; how many had which outcome."""
    build = (ROOT / options.build).resolve()
    ledger = Ledger(build / "mutation" / f"{area.name}.jsonl")
    tests = c_tests or PythonTests(ROOT, build, area)
    results: Counter[str] = Counter()
    for mutant in sampled(area, options.seed):
        if results[KILLED] + results[SURVIVED] >= options.count:
            break
        source = (ROOT / mutant.path).read_text(encoding="utf-8")
        known = ledger.known.get(mutant.key(source))
        if known is None or (options.again and known.result == SURVIVED):
            result, by = tests.try_out(mutant, source)
            known = Outcome(
                mutant.key(source),
                mutant.path,
                mutant.line,
                mutant.kind,
                mutant.shown(source),
                result,
                by,
            )
            ledger.add(known)
        results[known.result] += 1
        if known.result == SURVIVED:
            print(f"{mutant.path}:{mutant.line}: {mutant.kind} survived\n{known.diff}", flush=True)
    return results


def summary(name: str, results: Counter[str]) -> str:
    """One line of the table at the end."""
    tried = results[KILLED] + results[SURVIVED]
    share = f"{100 * results[KILLED] / tried:.0f} %" if tried else "-"
    return (
        f"{name:10} {tried:4} mutants {results[KILLED]:4} killed {results[SURVIVED]:4} survived {share:>6}"
        f"   (not counted: {results[SAME]} the same code, {results[INVALID]} not compilable)"
    )


def main() -> int:
    """Entry point."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("areas", nargs="*", metavar="AREA", help="default: all")
    parser.add_argument("--count", type=int, default=20, help="mistakes for each area (20)")
    parser.add_argument("--seed", type=int, default=1, help="another sample (1)")
    parser.add_argument("--again", action="store_true", help="try earlier survivors once more")
    parser.add_argument("--list", action="store_true", help="print the areas, run nothing")
    parser.add_argument("--build", default="build", help="where everything is built (build)")
    options = parser.parse_args()
    names = [area.name for area in AREAS]
    unknown = [name for name in options.areas if name not in names]
    if unknown:
        parser.error(f"no area {', '.join(unknown)}; there are {', '.join(names)}")
    areas = [area_named(name) for name in options.areas or names]
    if options.list:
        print("\n".join(f"{area.name:10} {' '.join(area.sources)}" for area in areas))
        return 0
    c_tests = None
    lines = []
    for area in areas:
        if not area.tests and c_tests is None:
            c_tests = CTests(ROOT, (ROOT / options.build).resolve())
        lines.append(summary(area.name, run_area(area, options, None if area.tests else c_tests)))
        print(lines[-1], flush=True)
    print("\n".join(["", *lines]) if len(lines) > 1 else "")
    return 0


if __name__ == "__main__":
    sys.exit(main())
