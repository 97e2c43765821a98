# SPDX-License-Identifier: MIT
"""What a Python test file depends on, and which test files a change can therefore reach. Used by tools/run_tests and
testing/. Reads files of the tree; keeps stamps in the cache folder.

A test file's inputs are
- the file, the conftest.py files above it, and all modules of this tree that these import, at any depth and anywhere in
  a function too. A module that imports by a computed name (import_module) may import every module of its package;
- files and folders of the tree that were read while its tests ran, or that a module it imports has read in any test of
  the run (testing/recording.py): modules keep what they have read once;
- where a process was started, all that such a process can be made of;
- the Python packages and the settings of pytest.

After the tests of a file have passed, the content of all these is kept as a stamp. As long as one of the stamps of a
file agrees with the tree, the tests of this file would do again what they did then.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from testing.cache import Stamps, content, digest, newest, tree

SOURCE_FOLDERS = ("host_tools", "tools", "tests/support", "tests/system")
SETTINGS = ("pyproject.toml", "requirements.lock")
_NATIVE_USER = "host_tools/hodograph/native/library.py"
_NATIVE = "host_tools/hodograph/native/_native.abi3.so"
# All that a process started by a test can be made of; folders count as a whole.
OF_PROCESSES = (
    "host_tools",
    "tools",
    "firmware",
    "sim",
    "examples",
    "packaging",
    "build/bin",
    _NATIVE,
)
# What the programs below build/ are made of that only `make test` brings up to date: images, sanitized programs.
OF_IMAGES = ("firmware", "sim", "tests/target", "Makefile")
_UP_TO_DATE = ("build/bin/", "build/library/")  # what `make check` builds
_KEPT_TRACES = 6  # states of the tree for which the tests of a file are known to have passed


@cache
def _imports(path: Path) -> tuple[tuple[int, str, tuple[str, ...]], ...]:
    """Imports of a file: level, module, names; a computed one is (0, "*", ())."""
    try:
        parsed = ast.parse(path.read_text(encoding="utf-8"))
    except (OSError, SyntaxError, ValueError):
        return ()
    found: list[tuple[int, str, tuple[str, ...]]] = []
    for node in ast.walk(parsed):
        if isinstance(node, ast.Import):
            found += [(0, alias.name, ()) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            names = tuple(alias.name for alias in node.names)
            found.append((node.level, node.module or "", names))
        elif isinstance(node, ast.Call) and _name_of(node.func) in ("import_module", "__import__"):
            found.append((0, "*", ()))
    return tuple(found)


def _name_of(function: ast.expr) -> str:
    if isinstance(function, ast.Attribute):
        return function.attr
    return function.id if isinstance(function, ast.Name) else ""


@dataclass
class Imports:
    """Finds the modules of a tree that a file imports."""

    root: Path
    _closures: dict[Path, frozenset[Path]] = field(default_factory=dict)
    _known: dict[Path, tuple[Path, ...]] = field(default_factory=dict)

    def closure(self, path: Path) -> frozenset[Path]:
        """The file and every file of the tree that is imported from it, at any depth."""
        if path not in self._closures:
            seen: set[Path] = set()
            todo = [path]
            while todo:
                file = todo.pop()
                if file not in seen:
                    seen.add(file)
                    todo += self._direct(file)
            self._closures[path] = frozenset(seen)
        return self._closures[path]

    def _direct(self, file: Path) -> tuple[Path, ...]:
        if file not in self._known:
            self._known[file] = tuple(self._find(file))
        return self._known[file]

    def _find(self, file: Path) -> Iterator[Path]:
        folders = [file.parent, *(self.root / name for name in SOURCE_FOLDERS)]
        for level, module, names in _imports(file):
            if module == "*":
                yield from sorted(file.parent.rglob("*.py"))
            elif level:
                yield from self._of(file.parents[level - 1], module, names)
            else:
                for base in folders:
                    if _is_here(base, module.partition(".")[0]):
                        yield from self._of(base, module, names)

    @staticmethod
    def _of(base: Path, module: str, names: tuple[str, ...]) -> Iterator[Path]:
        """Files of base/module and of the names in it that are modules, with the packages on the way."""
        here = base
        parts = module.split(".") if module else []
        for part in parts:
            here = here / part
            yield from _module_files(here)
        for name in names:
            yield from _module_files(here / name)
        if not parts:
            yield from _module_files(here)


def _is_here(base: Path, name: str) -> bool:
    return (base / name).is_dir() or (base / f"{name}.py").is_file()


def _module_files(path: Path) -> Iterator[Path]:
    for file in (path.with_name(path.name + ".py"), path / "__init__.py"):
        if file.is_file():
            yield file


@dataclass
class Recorded:
    """What testing/recording.py wrote down of one run, all groups together; paths are relative to the tree."""

    reads: dict[str, set[str]] = field(default_factory=dict)  # by test file
    module_reads: dict[str, set[str]] = field(default_factory=dict)  # by module
    processes: set[str] = field(default_factory=set)  # test files that start some
    seconds: dict[str, dict[str, float]] = field(default_factory=dict)  # test file, test
    cpu_s: dict[str, float] = field(default_factory=dict)  # test file, its processes included
    groups: dict[str, dict[str, int]] = field(default_factory=dict)  # test file, group: tests
    failed: set[str] = field(default_factory=set)  # test files
    marks: dict[str, set[str]] = field(
        default_factory=dict
    )  # test file: groups of tests left to them

    def add(self, other: Recorded) -> None:
        """Takes in what another group recorded."""
        for mine, theirs in ((self.reads, other.reads), (self.module_reads, other.module_reads)):
            for name, reads in theirs.items():
                mine.setdefault(name, set()).update(reads)
        for file, seconds in other.seconds.items():
            self.seconds.setdefault(file, {}).update(seconds)
        for file, cpu_s in other.cpu_s.items():
            self.cpu_s[file] = self.cpu_s.get(file, 0.0) + cpu_s
        for file, groups in other.groups.items():
            self.groups.setdefault(file, {}).update(groups)
        for file, marks in other.marks.items():
            self.marks.setdefault(file, set()).update(marks)
        self.processes |= other.processes
        self.failed |= other.failed

    def expected_s(self, file: str) -> float:
        """How long the tests of a file take on an idle processor; those that wait for processes, as long as now."""
        if file in self.processes:
            return sum(self.seconds[file].values())
        return self.cpu_s[file]

    def passed(self) -> set[str]:
        """Test files of which every test that was chosen has ended, and none has failed."""
        return {
            file
            for file, groups in self.groups.items()
            if file not in self.failed and len(self.seconds.get(file, {})) == sum(groups.values())
        }


@dataclass
class Contents:
    """Hashes of inputs, each made once; see `Reach` for how inputs are written."""

    root: Path
    _known: dict[str, str] = field(default_factory=dict)

    def of(self, name: str) -> str:
        """Hash of an input: a path in the tree; `tree:PATH` for all below it; `python` for the interpreter."""
        if name not in self._known:
            self._known[name] = self._make(name)
        return self._known[name]

    def is_newer(self, name: str, since_s: float) -> bool:
        """Whether an input was written since; a folder's list of names is always taken as it is."""
        path = self.root / name.removeprefix("tree:")
        if name.startswith("tree:") and path.is_dir():
            return newest(path) > since_s
        try:
            return path.is_file() and path.stat().st_mtime > since_s
        except OSError:
            return True

    def _make(self, name: str) -> str:
        if name == "python":
            return digest([sys.version])
        if name.startswith("tree:"):
            path = self.root / name.removeprefix("tree:")
            return tree(path) if path.is_dir() else content(path)
        return content(self.root / name)


@dataclass(frozen=True)
class Known:
    """What is known of a test file from when it passed."""

    is_current: bool  # it passed with all inputs as they are now
    is_edited: bool  # the file itself is another than in each of those states
    starts_processes: bool = False
    needs_images: bool = False  # of those that only `make test` builds
    seconds: float = 0.0
    inputs: int = 0
    groups: tuple[str, ...] = ()


@dataclass
class Reach:
    """The traces of test files: for each the inputs, by name and hash, of some states in which its tests passed."""

    root: Path
    stamps: Stamps
    contents: Contents = field(init=False)
    imports: Imports = field(init=False)

    def __post_init__(self) -> None:
        self.contents = Contents(self.root)
        self.imports = Imports(self.root)

    def known(self, file: str) -> Known | None:
        """Of a test file; None where no state is known in which it passed."""
        traces = self._traces(file)
        if not traces:
            return None
        newest = traces[-1]
        return Known(
            is_current=any(self._agrees(trace["inputs"]) for trace in traces),
            is_edited=all(trace["inputs"].get(file) != self.contents.of(file) for trace in traces),
            starts_processes=bool(newest["processes"]),
            needs_images=any(map(_is_image, newest["inputs"])),
            seconds=float(newest["seconds"]),
            inputs=len(newest["inputs"]),
            groups=tuple(newest["groups"]),
        )

    def keep(self, recorded: Recorded, since_s: float) -> None:
        """Writes traces for the test files that have passed, but for those with inputs edited since (time.time())."""
        for file in recorded.passed():
            names = self.inputs(file, recorded)
            if any(self.contents.is_newer(name, since_s) for name in names):
                continue
            trace = {
                "inputs": {name: self.contents.of(name) for name in sorted(names)},
                "processes": file in recorded.processes,
                "seconds": round(recorded.expected_s(file), 2),
                "groups": sorted(recorded.groups[file]),
            }
            others = [t for t in self._traces(file) if t["inputs"] != trace["inputs"]]
            kept = [*others, trace][-_KEPT_TRACES:]
            self.stamps.write(digest(["test file", file]), {"traces": kept})

    def inputs(self, file: str, recorded: Recorded) -> set[str]:
        """Names of all that the tests of a file depend on."""
        path = self.root / file
        modules = set(self.imports.closure(path))
        for folder in path.parents:
            if (folder / "conftest.py").is_file():
                modules |= self.imports.closure(folder / "conftest.py")
            if folder == self.root:
                break
        names = {str(module.relative_to(self.root)) for module in modules}
        for module in list(names):
            names |= recorded.module_reads.get(module, set())
        names |= recorded.reads.get(file, set())
        if _NATIVE_USER in names:
            names.add(_NATIVE)
        if file in recorded.processes:
            names |= {f"tree:{name}" for name in OF_PROCESSES}
        if any(map(_is_image, names)):
            names |= {f"tree:{name}" for name in OF_IMAGES}
        return names | {"python", *SETTINGS}

    def _agrees(self, inputs: Mapping[str, str]) -> bool:
        return all(self.contents.of(name) == hash_ for name, hash_ in inputs.items())

    def _traces(self, file: str) -> list[dict[str, Any]]:
        fact = self.stamps.read(digest(["test file", file]))
        return list(fact["traces"]) if fact else []


def _is_image(name: str) -> bool:
    return name.startswith("build/") and not name.startswith(_UP_TO_DATE)


def test_files(root: Path) -> list[str]:
    """Every Python test file there is, relative to the tree."""
    return sorted(str(path.relative_to(root)) for path in root.glob("tests/**/test_*.py"))


def within(seconds: Mapping[str, float], order: Iterable[str], budget_s: float) -> list[str]:
    """Of the files in this order those that fit into the budget together."""
    chosen, spent = [], 0.0
    for file in order:
        if spent + seconds[file] <= budget_s:
            chosen.append(file)
            spent += seconds[file]
    return chosen
