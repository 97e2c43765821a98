#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_directions.py [ROOT]: checks which layer uses which. Prints FILE:LINE and the rule for each breach; exit status
1 then. Run by `make lint`. Reads the sources, writes nothing.

The two tables below are all rules. A C layer is a folder (or single header), by the longest prefix of the path. A
Python layer is a package or module directly under hodograph, or one within it that has its own row; a layer that may
use a package may use all of it. A file may use its own layer, and those in its row. A folder without a row is a breach,
so that a row for each new one is chosen on purpose. In addition: no circles between modules (a Python file, or a C
source with the header of its name), and no I/O or heap headers in C_FREESTANDING.

Own code, because import-linter knows Python only: the tables, circles and messages here are the same for C.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

C_RULES: dict[str, set[str]] = {
    "firmware/can": set(),
    "firmware/core": set(),
    "firmware/targets": {"firmware/core"},
    "firmware/canopen": {"firmware/can"},
    "firmware/port/port.h": {"firmware/can"},
    "firmware/port/common": {"firmware/port/port.h"},
    "firmware/port/semihost": set(),
    "firmware/port/cortex_m": set(),
    "firmware/port/*": {  # each board; not one another
        "firmware/can",
        "firmware/port/port.h",
        "firmware/port/common",
        "firmware/port/cortex_m",
        "firmware/port/semihost",
    },
    "firmware/app/machine": {
        "firmware/can",
        "firmware/core",
        "firmware/canopen",
        "generated",
    },
    "firmware/app/drives": {
        "firmware/can",
        "firmware/canopen",
        "firmware/app/machine",
        "firmware/port/port.h",
        "generated",
    },
    "firmware/app": {
        "firmware/can",
        "firmware/core",
        "firmware/canopen",
        "firmware/app/machine",
        "firmware/app/drives",
        "firmware/port/port.h",
        "generated",
    },
    "sim/plant": set(),
    "host_tools/numerics": set(),
    "sim/offline": {"firmware/core", "sim/plant"},
    "sim/node": {
        "firmware/can",
        "firmware/canopen",
        "firmware/port/linux/can_socket.h",  # a Linux program: socket and clock are those of the port
        "firmware/port/linux/clock.h",
        "firmware/port/linux/end_signals.h",
        "firmware/port/linux/long_options.h",
        "sim/plant",
        "sim/faults",
        "generated",
    },
    "sim/faults": {"firmware/can"},
    "sim/injector": {
        "firmware/can",
        "firmware/port/linux/can_socket.h",
        "firmware/port/linux/clock.h",
        "firmware/port/linux/end_signals.h",
        "firmware/port/linux/long_options.h",
        "sim/faults",
    },
    "sim/hub": {"firmware/port/linux/end_signals.h", "firmware/port/linux/local_bus.h"},
    "sim/gateway": {
        "firmware/can",
        "firmware/port/linux/can_socket.h",
        "firmware/port/linux/clock.h",
        "firmware/port/linux/long_options.h",
        "firmware/port/linux/schedule.h",  # the emulated board's ticks come as the Linux port's do
        "firmware/port/mps2/exchange.h",
    },
}

# Layers that may need neither operating system nor heap: only these system headers are allowed.
C_FREESTANDING = (
    *("firmware/can", "firmware/core", "firmware/canopen", "firmware/app", "sim/plant"),
    "host_tools/numerics",
)
C_PURE_HEADERS = {"assert.h", "float.h", "limits.h", "math.h", "stdbool.h", "stddef.h", "stdint.h"}
C_PURE_HEADERS |= {"string.h", "inttypes.h"}

PYTHON_RULES: dict[str, set[str]] = {
    "errors": set(),
    "fixed_point": set(),
    "names": {"errors"},
    "events": set(),
    "whole_files": set(),
    "data": set(),
    "native.library": {"errors"},
    "native.override_headroom": {"native.library"},
    "native.ph_chain": {"native.library"},
    "native.quadratic_program": {"native.library"},
    "spline": {"errors", "native.ph_chain", "fixed_point"},
    "feed": {
        *("errors", "names", "spline", "fixed_point"),
        *("native.override_headroom", "native.quadratic_program"),
    },
    "config": {"errors", "names", "events", "feed", "spline", "fixed_point"},
    "toolpath": {"errors", "names", "events", "spline", "native"},
    "native": {"errors", "names", "events", "config", "native.library", "fixed_point"},
    "program": {"errors", "names", "events", "spline", "feed", "native", "fixed_point"},
    "simulate": {"errors", "names", "events", "config", "native", "program", "fixed_point"},
    "verify": {"errors", "names", "config", "feed", "native", "program", "fixed_point"},
    "bustime": {"errors", "data", "config"},
    "dbc": {"errors", "data", "config", "bustime"},
    "bus.address": {"errors"},
    "bus.signals": set(),
    "bus.diagnostics": set(),
    "bus.clock": {"errors"},
    "bus.local_bus": {"bus.clock"},
    "bus.capture": {"errors", "events", "config", "bustime", "bus.address", "bus.clock"},
    "bus.sdo": {
        "errors",
        "names",
        "data",
        "config",
        "program",
        "bus.address",
        "bus.clock",
        "bus.signals",
        "bus.local_bus",
        "bus.diagnostics",
        "fixed_point",
    },
    "bus": {
        "events",
        "bus.address",
        "bus.clock",
        "bus.diagnostics",
        "bus.capture",
        "bus.sdo",
        "bus.signals",
        "errors",
        "names",
        "data",
        "config",
        "spline",
        "feed",
        "native",
        "program",
        "simulate",
        "pipeline",
        "bustime",
        "fixed_point",
        "machine_limits",
    },
    "path_outputs": {"errors", "events", "config", "spline", "fixed_point"},
    "job_outputs": {"errors", "events", "config", "toolpath", "fixed_point"},
    "machine_limits": {"errors", "fixed_point", "config", "feed", "native", "program"},
    "pipeline": {
        *("errors", "names", "events", "config", "spline", "feed", "program", "native"),
        *("fixed_point", "path_outputs", "machine_limits"),
    },
    "equal_sections": {"feed", "program", "native", "pipeline", "toolpath", "fixed_point"},
    "job": {
        *("errors", "config", "feed", "toolpath"),
        *("job_outputs", "equal_sections", "section_pipeline"),
    },
    "section_pipeline": {
        *("errors", "fixed_point", "events", "feed", "spline", "program", "toolpath"),
        *("machine_limits", "pipeline", "equal_sections"),
    },
    "job_simulation": {"errors", "job", "simulate"},
    "job_view": {"job", "toolpath"},
    "job_run": {
        *("errors", "events", "config", "native", "program", "bus", "toolpath"),
        *("job", "job_outputs", "job_simulation"),
    },
    "stream": {
        *("errors", "config", "spline", "feed", "program", "native", "pipeline", "bus", "bus.sdo"),
        *("toolpath", "job", "job_outputs", "job_run", "names", "events", "path_outputs"),
        "fixed_point",
        "machine_limits",
        "whole_files",
    },
    "paper": {
        "errors",
        "data",
        "config",
        "spline",
        "feed",
        "program",
        "simulate",
        "pipeline",
    },
    "report": {
        "errors",
        "job_view",
        "data",
        "config",
        "spline",
        "feed",
        "program",
        "simulate",
        "pipeline",
        "bus",
        "bustime",
        "paper",
        "tune",
        "toolpath",
        "job",
        "machine_limits",
        "job_simulation",
    },
    "tune": {"errors", "config", "native", "simulate", "pipeline"},
    "identify": {"errors", "config", "native", "bus"},
    "monitor": {
        "errors",
        "events",
        "data",
        "config",
        "native",
        "bus",
        "bustime",
        "stream",
        "__init__",
        "fixed_point",
    },
    "faults.scenario": {"errors", "config"},
    "faults": {
        "errors",
        "data",
        "config",
        "native",
        "simulate",
        "pipeline",
        "bus",
        "faults.scenario",
        "fixed_point",
    },
    "campaign": {
        "errors",
        "names",
        "config",
        "feed",
        "native",
        "simulate",
        "pipeline",
        "faults.scenario",
        "report",
        "__init__",
    },
    "api": {
        "errors",
        "names",
        "data",
        "config",
        "bustime",
        "program",
        "spline",
        "feed",
        "native",
        "simulate",
        "pipeline",
        "bus",
        "toolpath",
        "job",
        "job_run",
        "machine_limits",
        "section_pipeline",
        "job_simulation",
    },
    "commission": {"errors", "config", "bus"},
    "latency": {"errors", "config", "bus"},
    "schemas": {"errors", "names", "spline", "feed", "config", "campaign", "faults.scenario"},
    "cli": {"*"},
    "__main__": {"cli"},
    "__init__": {"errors", "api"},
}

# What the native module may take from the C side.
NATIVE_MAY_INCLUDE = ("core/", "numerics/", "plant/", "offline/")

_INCLUDE = re.compile(r'^\s*#\s*include\s+(?:"(?P<own>[^"]+)"|<(?P<system>[^>]+)>)')
_C_ROOTS = ("firmware", "sim", "host_tools/numerics")
_INCLUDE_ROOTS = ("firmware", "sim", "host_tools")


@dataclass(frozen=True, order=True)
class Breach:
    """One line that breaks a rule; `path` relative to the root."""

    path: str
    line: int
    rule: str

    def __str__(self) -> str:
        return f"{self.path}:{self.line}: {self.rule}"


@dataclass(frozen=True)
class Use:
    """File `source` uses file `target` in `line`."""

    source: str
    line: int
    target: str


def c_layer(path: str) -> str | None:
    """The layer of a C file; None when no row covers it."""
    for prefix in sorted(C_RULES, key=len, reverse=True):
        if path == prefix or path.startswith(prefix + "/"):
            return prefix
    parts = path.split("/")
    return "firmware/port/*" if parts[:2] == ["firmware", "port"] and len(parts) > 3 else None


def check_c(root: Path) -> Iterator[Breach]:
    """Breaches of C_RULES and circles of modules."""
    uses = []
    for path in _files(root, _C_ROOTS, (".c", ".h")):
        layer = c_layer(path)
        if layer is None:
            yield Breach(path, 1, "this folder has no row in tools/check_directions.py")
            continue
        for number, own, system in _includes(root / path):
            if system is not None:
                yield from _system_breach(path, number, layer, system)
                continue
            target = _resolve(root, path, own)
            if target is None:
                yield Breach(path, number, f'"{own}" is neither ours nor generated')
                continue
            uses.append(Use(path, number, target))
            if not _c_allowed(path, layer, target):
                yield Breach(
                    path, number, f"{layer} may not use {target} (may: {_row(C_RULES[layer])})"
                )
    yield from _circles(uses, _c_module)


def _system_breach(path: str, line: int, layer: str, header: str) -> Iterator[Breach]:
    if layer in C_FREESTANDING and header not in C_PURE_HEADERS:
        yield Breach(path, line, f"{layer} does without <{header}>: no operating system, no heap")


def _c_allowed(path: str, layer: str, target: str) -> bool:
    if target.startswith("generated/"):
        return "generated" in C_RULES[layer]
    if layer == "firmware/port/*" and target.startswith("firmware/port/"):
        same_board = path.split("/")[2] == target.split("/")[2]
        return same_board or c_layer(target) in C_RULES[layer]
    other = c_layer(target)
    return other == layer or other in C_RULES[layer] or target in C_RULES[layer]


def _includes(file: Path) -> Iterator[tuple[int, str, str | None]]:
    for number, text in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
        found = _INCLUDE.match(text)
        if found:
            yield number, found["own"] or "", found["system"]


def _resolve(root: Path, path: str, own: str) -> str | None:
    """The file an include means, relative to the root; generated ones as generated/NAME."""
    if re.fullmatch(r"od_\w+\.h", own):
        return f"generated/{own}"
    for base in (*_INCLUDE_ROOTS, str(Path(path).parent)):
        if (root / base / own).is_file():
            return (Path(base) / own).as_posix()
    return None


def check_python(root: Path) -> Iterator[Breach]:
    """Breaches of PYTHON_RULES, circles of imports, and what the native module takes from C."""
    base = root / "host_tools"
    uses = []
    for path in _files(root, ("host_tools/hodograph",), (".py",)):
        layer = _python_layer(path)
        if layer not in PYTHON_RULES:
            yield Breach(path, 1, f"{layer} has no row in tools/check_directions.py")
            continue
        for line, module, deferred in _imports(root / path, base):
            other = _python_layer(f"host_tools/{module.replace('.', '/')}")
            allowed = PYTHON_RULES[layer]
            known = {layer, "__init__", "*"} | allowed
            if other not in known and other.split(".")[0] not in allowed and "*" not in allowed:
                yield Breach(path, line, f"{layer} may not use {other} (may: {_row(allowed)})")
            target = _module_file(base, module)
            if target is not None and not deferred:
                uses.append(Use(path, line, target.relative_to(root).as_posix()))
    yield from _circles(uses)
    yield from _native_includes(root)


def _python_layer(path: str) -> str:
    parts = path.removesuffix(".py").split("/")
    within = ".".join(parts[2:4])
    if within in PYTHON_RULES:
        return within
    return parts[2] if len(parts) > 2 else "__init__"


def _imports(file: Path, base: Path) -> Iterator[tuple[int, str, bool]]:
    """(line, full name of a module of ours, whether imported only when a function runs or for types)."""
    package = list(file.relative_to(base).parent.parts)
    tree = ast.parse(file.read_text(encoding="utf-8"), str(file))
    at_load = {id(node) for node in tree.body}
    for node in ast.walk(tree):
        deferred = id(node) not in at_load
        if isinstance(node, ast.Import):
            for name in node.names:
                if name.name.split(".")[0] == "hodograph":
                    yield node.lineno, name.name, deferred
        elif isinstance(node, ast.ImportFrom):
            start = package[: len(package) - node.level + 1] if node.level else []
            module = ".".join([*start, *([node.module] if node.module else [])])
            if module.split(".")[0] == "hodograph":
                for name in node.names:
                    full = f"{module}.{name.name}"
                    yield node.lineno, full if _module_file(base, full) else module, deferred


def _module_file(base: Path, module: str) -> Path | None:
    path = base.joinpath(*module.split("."))
    for candidate in (path.with_suffix(".py"), path / "__init__.py"):
        if candidate.is_file():
            return candidate
    return None


def _native_includes(root: Path) -> Iterator[Breach]:
    for path in _files(root, ("host_tools/hodograph/native",), (".py", ".h")):
        for number, text in enumerate((root / path).read_text(encoding="utf-8").splitlines(), 1):
            for header in re.findall(r'"(\w+/[\w/]+\.h)"', text):
                if not header.startswith(NATIVE_MAY_INCLUDE):
                    yield Breach(
                        path,
                        number,
                        f'the native module may not use "{header}" (may: core, numerics, plant, offline)',
                    )


def _c_module(path: str) -> str:
    """A source and the header of its name are one module."""
    return path.removesuffix(".c").removesuffix(".h")


def _circles(uses: Iterable[Use], module: Callable[[str], str] = str) -> Iterator[Breach]:
    """One breach for each circle of modules, at the line that closes it; `module`: that of a file."""
    graph: dict[str, list[Use]] = {}
    for use in uses:
        if module(use.source) != module(use.target):
            graph.setdefault(module(use.source), []).append(use)
    done: set[str] = set()

    def walk(trail: list[str]) -> Iterator[Breach]:
        for use in graph.get(trail[-1], []):
            target = module(use.target)
            if target in trail:
                circle = [*trail[trail.index(target) :], target]
                yield Breach(use.source, use.line, "circle: " + " -> ".join(circle))
            elif target not in done:
                yield from walk([*trail, target])
        done.add(trail[-1])

    for name in sorted(graph):
        if name not in done:
            yield from walk([name])


def _files(root: Path, folders: Iterable[str], endings: tuple[str, ...]) -> Iterator[str]:
    for folder in folders:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in endings and path.is_file():
                yield path.relative_to(root).as_posix()


def _row(names: set[str]) -> str:
    return ", ".join(sorted(names)) or "nothing of ours"


def main(arguments: list[str]) -> int:
    """Exit status."""
    root = Path(arguments[0]) if arguments else Path(__file__).resolve().parent.parent
    breaches = sorted({*check_c(root), *check_python(root)})
    for breach in breaches:
        print(breach)
    return 1 if breaches else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
