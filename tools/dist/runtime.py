#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""runtime.py: a virtual environment with what the package needs of Python, and nothing else: `make runtime`.

    runtime.py FOLDER

Run by `make runtime`. Used by dist/debian. Starts pip, which gets the packages; writes to FOLDER.

It has the locked versions, checked by the locked hashes. Packages copy it, and the list of components is made of it.
Its Python is /usr/bin/python3, so that it works on another computer with the same version of Python.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from dist.requirements import lock_text, runtime_requirements

PYTHON = f"python{sys.version_info.major}.{sys.version_info.minor}"
SITE = f"lib/{PYTHON}/site-packages"
SETTINGS = f"""\
home = /usr/bin
include-system-site-packages = false
version = {sys.version_info.major}.{sys.version_info.minor}
"""


def pip_install(site: Path, *words: object) -> None:
    """Into a folder, nothing but what the words name; raises CalledProcessError."""
    command = [sys.executable, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    command += ["--no-compile", "--no-deps", "--upgrade", "--target", str(site)]
    subprocess.run([*command, *map(str, words)], check=True, stdout=subprocess.DEVNULL)


def make_runtime(folder: Path) -> None:
    """Makes the folder anew."""
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "bin").mkdir(parents=True)
    (folder / "bin/python3").symlink_to("/usr/bin/python3")
    (folder / "pyvenv.cfg").write_text(SETTINGS, encoding="utf-8")
    lock = folder / "requirements.txt"
    lock.write_text(lock_text(runtime_requirements()), encoding="utf-8")
    pip_install(folder / SITE, "--require-hashes", "-r", lock)
    shutil.rmtree(folder / SITE / "bin", ignore_errors=True)
    lock.unlink()


def main() -> int:
    """Exit status."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path)
    make_runtime(parser.parse_args().folder)
    return 0


if __name__ == "__main__":
    sys.exit(main())
