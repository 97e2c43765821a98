# SPDX-License-Identifier: MIT
"""The areas whose tests are tried with planted mistakes: their sources, and the tests that should find the mistakes.
Used by tools/mutants and mutation/python_tests. Lists the files of folders; no other I/O.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Area:
    """Sources as glob patterns from the root; `tests` are paths for pytest, none where the C unit tests are meant.
    Python tests find mistakes in C sources too, if these are in the native module.
    """

    name: str
    sources: tuple[str, ...]
    tests: tuple[str, ...] = ()

    @property
    def in_c(self) -> bool:
        """Whether the sources are C."""
        return self.sources[0].endswith(".c")

    def files(self, root: Path) -> list[str]:
        """The sources, relative to the root, in order; programs' main files have no unit tests."""
        found = {
            path.relative_to(root).as_posix()
            for pattern in self.sources
            for path in root.glob(pattern)
            if path.name not in ("main.c", "__init__.py", "__main__.py")
        }
        return sorted(found)


def _python(name: str, *tests: str) -> Area:
    return Area(name, (f"host_tools/hodograph/{name}/**/*.py",), tests or (f"tests/host/{name}",))


AREAS = (
    Area("core", ("firmware/core/*.c",)),
    Area("canopen", ("firmware/canopen/*.c",)),
    Area("app", ("firmware/app/**/*.c",)),
    Area("plant", ("sim/plant/*.c",)),
    Area("numerics", ("host_tools/numerics/*.c",), ("tests/host/spline", "tests/host/feed")),
    # Not files of a minute.
    Area(
        "offline",
        ("sim/offline/*.c",),
        (
            "tests/host/feed/test_optimal.py",
            "tests/host/feed/test_optimal_random.py",
            "tests/host/program/test_stop_planning.py",
            "tests/host/program/test_stop_rows.py",
            "tests/host/program/test_stops.py",
            "tests/host/simulate",
        ),
    ),
    Area("node", ("sim/node/*.c",)),
    Area("injector", ("sim/injector/*.c", "sim/faults/*.c")),
    Area("hub", ("sim/hub/*.c",)),
    _python("spline"),
    _python("feed"),
    _python("program"),
    # Not what has a process of its own, and not files of minutes.
    _python(
        "stream",
        "tests/host/stream/test_bus_chunks.py",
        "tests/host/stream/test_chunks.py",
        "tests/host/stream/test_outputs.py",
        "tests/host/stream/test_paths.py",
        "tests/host/stream/test_reading.py",
        "tests/host/stream/test_rests.py",
        "tests/host/stream/test_resuming.py",
        "tests/host/stream/test_sending.py",
        "tests/host/stream/test_store.py",
    ),
    _python("verify", "tests/host/verify", "tests/host/cli/test_cli_verify.py"),
    # What needs no bus: the rest is driven by tests/system.
    Area(
        "bus",
        (
            "host_tools/hodograph/bus/capture/*.py",
            "host_tools/hodograph/bus/analysis.py",
            "host_tools/hodograph/bus/status_text.py",
            "host_tools/hodograph/bus/goto.py",
        ),
        ("tests/host/bus",),
    ),
    _python("bustime"),
    _python("config", "tests/host/config", "tests/host/cli/test_cli_inputs.py"),
    _python("tune"),
    _python("identify"),
    # Not test_campaign_cluster.py: it starts clusters, and takes a minute.
    _python(
        "campaign",
        "tests/host/campaign/test_campaign_command.py",
        "tests/host/campaign/test_campaign_design.py",
        "tests/host/campaign/test_campaign_faults.py",
        "tests/host/campaign/test_campaign_files.py",
        "tests/host/campaign/test_variation.py",
    ),
    _python("simulate"),
    _python("native", "tests/host/simulate", "tests/host/program"),
)


def area_named(name: str) -> Area:
    """The area of that name; KeyError where there is none."""
    return {area.name: area for area in AREAS}[name]
