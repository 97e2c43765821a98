# SPDX-License-Identifier: MIT
"""Runs an area's Python tests with a mistake in a copy of the tree: in a module of Python, or in a C source of the
native module. Used by tools/mutants. Starts processes; writes to BUILD/mutation only.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

from mutation.areas import Area
from mutation.native_module import NativeModule
from mutation.outcome import INVALID, KILLED, SURVIVED
from mutation.sites import Mutant

_TIMED = re.compile(r"^([\d.]+)s (?:call|setup|teardown) +([^\s:]+)::", re.MULTILINE)
_FAILED = re.compile(r"^(?:FAILED|ERROR) (\S+)", re.MULTILINE)
_PATIENCE = 3  # times what the tests take without a mistake


class PythonTests:
    """A copy of the tree under BUILD/mutation, in which one module at a time has a mistake."""

    def __init__(self, root: Path, build: Path, area: Area) -> None:
        self.area = area
        self.tree = build / "mutation" / "tree"
        _copy(root, self.tree)
        self.native = NativeModule(root, build, self.tree)
        began = time.monotonic()
        status, said = self._pytest([*area.tests, "--durations=0", "-vv"], 1200.0)
        if status != 0:
            failed = _FAILED.findall(said) or [f"pytest ended with {status}"]
            raise SystemExit(f"{area.name}: fails without any mistake: {failed[0]}")
        self.limit_s = 20.0 + _PATIENCE * (time.monotonic() - began)
        self.files = _quickest_first(said)

    def try_out(self, mutant: Mutant, source: str) -> tuple[str, str]:
        """The outcome of the mutant, and the test that found it."""
        in_c, changed = mutant.path.endswith(".c"), mutant.applied(source)
        no_mistake = (self.native.plant if in_c else self._plant)(mutant.path, changed)
        if no_mistake is not None:
            return no_mistake, ""
        try:
            by = self._run()
        finally:
            if in_c:
                self.native.restore()
            else:
                self._write(mutant.path, source)
        return (KILLED, by) if by else (SURVIVED, "")

    def _plant(self, path: str, changed: str) -> str | None:
        """Writes the changed module; INVALID where Python cannot compile it."""
        try:
            compile(changed, path, "exec")
        except SyntaxError:
            return INVALID
        self._write(path, changed)
        return None

    def _write(self, path: str, text: str) -> None:
        file = self.tree / path
        file.write_text(text, encoding="utf-8")
        # Compiled modules are distinguished by second and size only: two mutants may have both in common.
        for compiled in (file.parent / "__pycache__").glob(f"{file.stem}.*.pyc"):
            compiled.unlink()

    def _run(self) -> str:
        """The first test that fails; empty when all pass."""
        status, said = self._pytest([*self.files, "-q"], self.limit_s)
        if status == 0:
            return ""
        found = _FAILED.search(said)
        return found[1] if found else f"pytest ended with {status}"

    def _pytest(self, words: list[str], limit_s: float) -> tuple[int, str]:
        """Exit status and output; -9 where it had to be killed."""
        command = [sys.executable, "-m", "pytest", "-x", "--no-header", "--tb=no"]
        command += ["-p", "no:cacheprovider", "-p", "mutation.few_examples", "--hypothesis-seed=0"]
        command += ["-m", "not bus and not serial and not long", *words]
        environment = os.environ | {
            "PYTHONPATH": f"{self.tree / 'host_tools'}:{self.tree / 'tools'}"
        }
        with subprocess.Popen(
            command,
            cwd=self.tree,
            env=environment,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        ) as job:
            try:
                said, _ = job.communicate(timeout=limit_s)
            except subprocess.TimeoutExpired:
                os.killpg(job.pid, 9)
                said, _ = job.communicate()
            return job.returncode, said


def _quickest_first(said: str) -> list[str]:
    """The test files in a report with durations, in the order of their running times."""
    seconds: dict[str, float] = {}
    for took, file in _TIMED.findall(said):
        seconds[file] = seconds.get(file, 0.0) + float(took)
    return sorted(seconds, key=lambda file: seconds[file])


def _copy(root: Path, tree: Path) -> None:
    """The files that git knows or would take, the compiled module, and links to .venv and build."""
    if tree.exists():
        shutil.rmtree(tree)
    listed = subprocess.run(
        ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"],
        cwd=root,
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    native = root.glob("host_tools/hodograph/native/*.so")
    names = [*listed.stdout.split("\0"), *(str(path.relative_to(root)) for path in native)]
    for name in names:
        if name and ((root / name).is_symlink() or (root / name).is_file()):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(root / name, tree / name, follow_symlinks=False)
    for name in (".venv", "build"):
        (tree / name).symlink_to(root / name)
