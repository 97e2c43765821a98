# SPDX-License-Identifier: MIT
"""Links the native module of a copied tree with a mistake in one of its C sources. Used by mutation/python_tests.
Starts the compiler; writes to a work folder, and the module in the copy.

The object of the changed source comes before the archives of `make build`, so the linker does not take the sound one.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
from pathlib import Path

from mutation.outcome import INVALID, SAME

_MODULE = "host_tools/hodograph/native/_native.abi3.so"
_ARCHIVES = ("sim", "core", "numerics")


class NativeModule:
    """The native module of the copy `tree` of the tree `root`, whose build folder is `build`."""

    def __init__(self, root: Path, build: Path, tree: Path) -> None:
        self.root, self.build = root, build
        self.target = tree / _MODULE
        self.work = build / "mutation" / "native"
        self.work.mkdir(parents=True, exist_ok=True)
        compiler, *flags = shlex.split((build / "host/obj/flags").read_text())
        folders = [f"-I{root / flag[2:]}" for flag in flags if flag[:2] == "-I"]
        others = [flag for flag in flags if flag[:2] not in ("-I", "-W") and flag != "-g"]
        self.compile = [compiler, *others, *folders]

    def plant(self, path: str, changed: str) -> str | None:
        """Links the module with the changed source. Where the change is no mistake, its outcome: INVALID or SAME."""
        made = self._object("changed", path, changed)
        if made is None:
            return INVALID
        plain = self._object("plain", path, (self.root / path).read_text(encoding="utf-8"))
        if plain is not None and made.read_bytes() == plain.read_bytes():
            return SAME
        words = ["-shared", "-o", str(self.work / "module.so")]
        words += [str(self.build / "native/hodograph/native/_native.o"), str(made)]
        words += [str(self.build / f"host/libhodograph_{name}.a") for name in _ARCHIVES]
        subprocess.run([*self.compile, *words, "-lm"], cwd=self.root, check=True)
        (self.work / "module.so").replace(self.target)
        return None

    def restore(self) -> None:
        """The sound module."""
        shutil.copy2(self.root / _MODULE, self.target)

    def _object(self, folder: str, path: str, text: str) -> Path | None:
        """The object of a source, compiled under the name that it has in the tree."""
        source = self.work / folder / path
        source.parent.mkdir(parents=True, exist_ok=True)
        source.write_text(text, encoding="utf-8")
        made = source.with_suffix(".o")
        command = [*self.compile, "-c", "-o", str(made), path]
        done = subprocess.run(command, cwd=self.work / folder, capture_output=True, check=False)
        return made if done.returncode == 0 else None
