# SPDX-License-Identifier: MIT
"""Compiles one C source with a mistake in it and runs the unit tests that link it. Used by tools/mutants. Starts
processes; writes to BUILD/mutation/c only.

Compiling is quick, linking each test anew is not: so every test is linked once, under BUILD/mutation/c, against shared
objects, and a first one, libmutant.so, is made anew for each mutant. It holds the source with the mistake; its symbols
replace those of the same name in the objects after it. Nothing under BUILD/asan changes. `make unit` must have built
the tests there, under the sanitizers.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import time
from collections.abc import Sequence
from functools import cache
from pathlib import Path

from mutation.outcome import INVALID, KILLED, SAME, SURVIVED
from mutation.sites import Mutant

_LEAST_LIMIT_S = 5.0
_PATIENCE = 5  # times what the test takes without a mistake
_BOARDS = ("port", "mps2", "stm32g4")  # they define the same functions: linked as archives
_MUTANT = "libmutant.so"


class CTests:
    """The unit tests, linked so that one source can be replaced, with the running time of each."""

    def __init__(self, root: Path, build: Path) -> None:
        self.root = root
        self.objects = build / "asan/obj"
        self.built = build / "asan"
        self.work = build / "mutation" / "c"
        self.work.mkdir(parents=True, exist_ok=True)
        self.flags = shlex.split((self.objects / "flags").read_text())
        self.tests = sorted(path.stem for path in (root / "tests/unit").glob("test_*.c"))
        missing = [name for name in self.tests if not (self.built / "tests" / name).exists()]
        if missing:
            raise SystemExit(f"not built: {', '.join(missing)}: `make unit` builds them")
        self.plain: dict[str, str | None] = {}
        self._link_tests()
        self.seconds = {name: self._seconds(name) for name in self.tests}

    def try_out(self, mutant: Mutant, source: str) -> tuple[str, str]:
        """The outcome of the mutant, and the test that found it."""
        changed = mutant.applied(source)
        code = self._assembly(changed)
        if code is None:
            return INVALID, ""
        if source not in self.plain:
            self.plain[source] = self._assembly(source)
        if code == self.plain[source]:
            return SAME, ""
        file = self.work / "changed.c"
        file.write_text(changed, encoding="utf-8")
        # A variable that is no longer set has a value that no test takes for a good one.
        self._make_shared(_MUTANT, ["-ftrivial-auto-var-init=pattern", str(file)])
        for name in self._tests_of(mutant.path):
            program = self._including(name, mutant.path, changed) or name
            if not self._passes(program, _LEAST_LIMIT_S + _PATIENCE * self.seconds[name]):
                return KILLED, name
        return SURVIVED, ""

    def _including(self, name: str, path: str, changed: str) -> str | None:
        """Where a test includes the source itself: the name of its program made with the mistake."""
        test = self.root / "tests/unit" / f"{name}.c"
        included = path.split("/", 1)[1]
        if f'#include "{included}"' not in test.read_text(encoding="utf-8"):
            return None
        overlay = self.work / "include" / included
        overlay.parent.mkdir(parents=True, exist_ok=True)
        overlay.write_text(changed, encoding="utf-8")
        compiled = self.work / "including.o"
        words = [
            f"-I{overlay.parents[included.count('/')]}",
            "-Itests/unit",
            "-isystem",
            "build/unity",
        ]
        # The folder of the overlay must come before those of the flags.
        self._compile(["-c", "-o", str(compiled), str(test)], first=words)
        self._link_test(compiled, "including")
        overlay.unlink()
        return "including"

    def _tests_of(self, path: str) -> list[str]:
        """The tests in whose program the source is, those named like it first, then the quickest."""
        own = _symbols(self.objects / Path(path).with_suffix(".o"))
        words = set(Path(path).stem.split("_"))
        linked = [name for name in self.tests if own & _symbols(self.built / "tests" / name)]
        return sorted(
            linked, key=lambda name: (-len(words & set(name.split("_"))), self.seconds[name])
        )

    def _link_tests(self) -> None:
        libraries = []
        for archive in sorted(self.built.glob("libhodograph_*.a")):
            name = archive.stem.removeprefix("libhodograph_")
            if name not in _BOARDS:
                libraries.append(f"{archive.stem}.so")
                whole = ["-Wl,--whole-archive", str(archive), "-Wl,--no-whole-archive"]
                self._make_shared(libraries[-1], whole)
        self._make_shared(_MUTANT, [])
        self.libraries = [str(self.work / name) for name in (_MUTANT, *libraries)]
        for name in self.tests:
            self._link_test(self.objects / f"tests/unit/{name}.o", name)

    def _link_test(self, compiled: Path, name: str) -> None:
        objects = sorted((self.objects / "tests/unit").glob("*.o"))
        support = [str(path) for path in objects if not path.name.startswith("test_")]
        boards = [str(self.built / f"libhodograph_{name}.a") for name in _BOARDS]
        words = ["-o", str(self.work / name), str(compiled), str(self.objects / "unity.o")]
        words += [*support, "-Wl,--no-as-needed", *self.libraries, *boards]
        words += ["-Wl,-rpath," + str(self.work), "-rdynamic", "-Wl,--allow-shlib-undefined"]
        # A test may replace functions of a module. Its own come first.
        words += ["-Wl,-z,muldefs"]
        self._compile([*words, "-Wl,-z,lazy", "-lm", "-lpthread"])

    def _make_shared(self, name: str, words: list[str]) -> None:
        soname = f"-Wl,-soname,{name},-z,lazy"
        self._compile(["-shared", soname, "-o", str(self.work / name), *words])

    def _compile(self, words: list[str], first: Sequence[str] = ()) -> None:
        compiler, *flags = (flag for flag in self.flags if not flag.startswith("-W"))
        done = subprocess.run(
            [compiler, *first, *flags, "-w", *words],
            cwd=self.root,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"{' '.join(words)}: {done.stderr}")

    def _assembly(self, source: str) -> str | None:
        """What the compiler makes of it, optimised, without assertions; None where it refuses."""
        flags = [flag for flag in self.flags if not flag.startswith(("-W", "-g", "-fsan", "-O"))]
        done = subprocess.run(
            [*flags, "-w", "-O2", "-DNDEBUG", "-S", "-o", "-", "-x", "c", "-"],
            cwd=self.root,
            input=source,
            capture_output=True,
            text=True,
            check=False,
        )
        return done.stdout if done.returncode == 0 else None

    def _seconds(self, name: str) -> float:
        began = time.monotonic()
        if not self._passes(name, 300.0):
            raise SystemExit(f"{name} fails without any mistake")
        return time.monotonic() - began

    def _passes(self, name: str, limit_s: float) -> bool:
        with subprocess.Popen(
            [self.work / name],
            cwd=self.root,
            env=os.environ | {"ASAN_OPTIONS": "detect_odr_violation=0"},
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        ) as job:
            try:
                return job.wait(limit_s) == 0
            except subprocess.TimeoutExpired:
                os.killpg(job.pid, 9)
                return False


@cache
def _symbols(program: Path) -> frozenset[str]:
    """The functions and data that an object or a program defines for others."""
    done = subprocess.run(
        ["nm", "--defined-only", "--extern-only", str(program)],
        capture_output=True,
        text=True,
        check=True,
    )
    return frozenset(line.split()[-1] for line in done.stdout.splitlines() if line)
