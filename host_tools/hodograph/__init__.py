# SPDX-License-Identifier: MIT
"""Hodograph: jerk-limited motion on Pythagorean-hodograph splines over CAN servo drives. Used by all programs that
import hodograph. Importing it does no I/O.

    import hodograph as hg

    path = hg.Path.through([[0, 0], [20, 0], [35, 10], [35, 30]])
    plan = path.plan(hg.Limits(feed_mm_s=100), machine=hg.Machine.example())
    run = plan.program().simulate()

The names in `__all__` are public (docs/reference/python-api.md); everything else is not. They are loaded when they are
first used, so that `import hodograph` is quick.
"""

from importlib import import_module

from .errors import (
    BusError,
    HodographError,
    InputError,
    LimitError,
    PlanError,
    RefusedError,
    RunError,
)

TYPE_CHECKING = False  # for type checkers; the module typing alone takes longer than all of this
if TYPE_CHECKING:
    from .api.bus import Controller, connect, local_bus
    from .api.job import Job, JobRun, Section, load_job
    from .api.machine import Machine, example_file
    from .api.path import (
        FeedZone,
        Limits,
        LimitUsage,
        Path,
        PathMotion,
        Plan,
        load_path,
        load_plan,
    )
    from .api.program import Program, Run, load_program

__version__ = "0.1.0"

__all__ = [
    "BusError",
    "Controller",
    "FeedZone",
    "HodographError",
    "InputError",
    "Job",
    "JobRun",
    "LimitError",
    "LimitUsage",
    "Limits",
    "Machine",
    "Path",
    "PathMotion",
    "Plan",
    "PlanError",
    "Program",
    "RefusedError",
    "Run",
    "RunError",
    "Section",
    "__version__",
    "connect",
    "example_file",
    "load_job",
    "load_path",
    "load_plan",
    "load_program",
    "local_bus",
]


_MODULES = {
    **dict.fromkeys(("Controller", "connect", "local_bus"), "bus"),
    **dict.fromkeys(("Job", "JobRun", "Section", "load_job"), "job"),
    **dict.fromkeys(("Machine", "example_file"), "machine"),
    **dict.fromkeys(("FeedZone", "LimitUsage", "Limits", "Path", "PathMotion", "Plan"), "path"),
    **dict.fromkeys(("load_path", "load_plan"), "path"),
    **dict.fromkeys(("Program", "Run", "load_program"), "program"),
}
"""Where public names are; only their modules are imported."""


def __getattr__(name: str) -> object:
    """A public name, when it is first used (PEP 562)."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found: object = getattr(import_module(f"{__name__}.api.{_MODULES[name]}"), name)
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    """The public names."""
    return sorted(__all__)
