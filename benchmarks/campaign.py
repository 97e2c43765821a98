# SPDX-License-Identifier: MIT
"""Measures the speed of `hodograph campaign` (many simulated runs with varied parameters): 10^4 runs of examples/alpha
on two cores, and on a cluster of two workers over loopback.

Run by `make bench`. Starts processes; writes temporary files and the file of --json.

Times are of the whole command: from the import of Python modules to the written report. Processor time counts all its
processes.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from _figures import figures_parser, write_figures

CAMPAIGN = Path(__file__).resolve().parents[1] / "examples" / "campaigns" / "ten_thousand.toml"
WORKERS = 2
START_S = 60
"""Longest time until the workers have started."""


def measured(folder: Path, *options: str) -> dict[str, float]:
    """Wall and processor time of the command, into an empty folder."""
    before, begun = os.times(), time.monotonic()
    command = [sys.executable, "-m", "hodograph", "campaign", str(CAMPAIGN), "-o", str(folder)]
    subprocess.run([*command, *options], check=True, stdout=subprocess.DEVNULL)
    after = os.times()
    used = after.children_user + after.children_system
    return {
        "wall_s": time.monotonic() - begun,
        "processor_s": used - before.children_user - before.children_system,
    }


@contextmanager
def cluster(folder: Path) -> Iterator[str]:
    """A scheduler and WORKERS workers; gives its address."""
    file = folder / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    common = ["--scheduler-file", str(file), "--host", "127.0.0.1", "--no-dashboard"]
    worker = [*dask, "worker", *common, "--nthreads", "1", "--local-directory", str(folder)]
    commands = [[*dask, "scheduler", *common, "--port", "0"], *[[*worker, "--no-nanny"]] * WORKERS]
    quiet: Any = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    children = [subprocess.Popen(command, **quiet) for command in commands]
    try:
        limit = time.monotonic() + START_S
        while not file.exists() and time.monotonic() < limit:
            time.sleep(0.05)
        yield json.loads(file.read_text())["address"]
    finally:
        for child in children:
            child.kill()
            child.wait()


def main() -> None:
    """Measure and write."""
    out: Path = figures_parser(__doc__, required=True).parse_args().json
    with tempfile.TemporaryDirectory(prefix="hodograph-campaign-") as name:
        folder = Path(name)
        figures: dict[str, Any] = {"here": measured(folder / "here", "--workers", str(WORKERS))}
        with cluster(folder) as address:
            far = measured(folder / "far", "--scheduler", address)
        figures["cluster"] = {"wall_s": far["wall_s"]}
        here, there = ((folder / f / "runs.csv").read_bytes() for f in ("here", "far"))
        figures["runs"] = here.count(b"\n") - 1
        figures["same_table"] = here == there
    write_figures(out, figures)


if __name__ == "__main__":
    main()
