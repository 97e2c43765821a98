# SPDX-License-Identifier: MIT
"""The C harnesses of tests/fuzz, each run by libFuzzer for so many seconds. Used by tools/fuzz. Starts processes;
writes new inputs, logs and findings to build/fuzz.
"""

from __future__ import annotations

import re
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

_OF_LIBFUZZER = (
    "-print_final_stats=1",
    "-timeout=60",  # seconds for one input: the sanitized controller takes up to 1 s, beside others 10 s
    "-rss_limit_mb=3000",
    "-max_len=2048",
    "-len_control=20",
)
_RUNS_LONG = ("controller", "program")
"""Their time is in runs, not in reading: comparisons of values are not traced, which doubles their speed."""
EXTRA_S = 180
"""A run that takes so much longer than requested hangs."""
_EXECUTIONS = re.compile(r"stat::number_of_executed_units:\s*(\d+)")
_COVERAGE = re.compile(r"\bcov: (\d+)")
_WHAT = re.compile(r"broken: .*|runtime error: .*|ERROR: .*|:FAIL: .*")


@dataclass(frozen=True)
class Result:
    """How a harness, or a target of the Python side, fared."""

    name: str
    executions: int
    coverage: int | None
    """Edges of the control flow that inputs have reached; None: not counted (Python)."""
    findings: list[str] = field(default_factory=list)


def names(root: Path) -> list[str]:
    """All harnesses."""
    return sorted(f.stem.removeprefix("fuzz_") for f in (root / "tests/fuzz").glob("fuzz_*.c"))


def run(name: str, root: Path, build: Path, seconds: int, seed: int) -> Result:
    """Runs one; new inputs go to build/fuzz/corpus, what ends it to build/fuzz/found."""
    corpus, found = build / "fuzz/corpus" / name, build / "fuzz/found"
    for folder in (corpus, found):
        folder.mkdir(parents=True, exist_ok=True)
    before = set(found.glob(f"{name}-*"))
    words = [
        str(build / "fuzz/bin" / f"fuzz_{name}"),
        f"-max_total_time={seconds}",
        f"-seed={seed}",
        f"-use_value_profile={0 if name in _RUNS_LONG else 1}",
        f"-artifact_prefix={found}/{name}-",
        *_OF_LIBFUZZER,
        str(corpus),
        str(root / "tests/data/fuzz" / name),
    ]
    log = build / "fuzz" / f"{name}.log"
    try:
        with log.open("wb") as out:
            status = subprocess.run(
                words,
                cwd=root,
                stdin=subprocess.DEVNULL,
                stdout=out,
                stderr=subprocess.STDOUT,
                timeout=seconds + EXTRA_S,
                check=False,
            ).returncode
    except subprocess.TimeoutExpired:
        return _result(name, log, [f"{name}: not at its end after {seconds + EXTRA_S} s; {log}"])
    files = sorted(set(found.glob(f"{name}-*")) - before)
    if status == 0 and not files:
        return _result(name, log, [])
    said = _WHAT.search(log.read_text(encoding="utf-8", errors="replace"))
    where = ", ".join(str(file.relative_to(root)) for file in files) or str(log)
    return _result(name, log, [f"{name}: {said[0] if said else f'status {status}'} ({where})"])


def _result(name: str, log: Path, findings: list[str]) -> Result:
    text = log.read_text(encoding="utf-8", errors="replace")
    executions = _EXECUTIONS.search(text)
    coverage = _COVERAGE.findall(text)
    if executions is None and not findings:
        findings = [f"{name}: ended without a count; {log}"]
    return Result(
        name,
        int(executions[1]) if executions else 0,
        int(coverage[-1]) if coverage else 0,
        findings,
    )
