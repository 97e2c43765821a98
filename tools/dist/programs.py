# SPDX-License-Identifier: MIT
"""Builds the C programs that the Python package starts, with nothing but a C compiler. Used by dist/install; setup.py
calls it. Starts the compiler; writes to the folders that it is given.

`make c` builds the same programs from the same folders for work on the tree; this is for `pip install`, where there may
be no make.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import sysconfig
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

PROGRAMS = {
    "hodograph-controller": "firmware/app/main.c",
    "hodograph-drive": "sim/node/main.c",
    "hodograph-hub": "sim/hub/main.c",
    "hodograph-injector": "sim/injector/main.c",
}
"""Name and main file of each."""


def programs_for(platform: str) -> dict[str, str]:
    """Programs that a platform, as sys.platform names it, can have: they need Linux. The native module does not."""
    return PROGRAMS if platform == "linux" else {}


FOLDERS = (
    "firmware/app",
    "firmware/app/*",
    "firmware/can",
    "firmware/canopen",
    "firmware/core",
    "firmware/port/common",
    "firmware/port/linux",
    "sim/*",
)
"""Where the rest of their sources lies; the linker takes what a program needs."""

OBJECT_DICTIONARIES = {
    "controller": "firmware/app/controller.eds",
    "drive": "sim/node/drive.eds",
    "module": "sim/node/module.eds",
}

CFLAGS = ("-std=c99", "-O2", "-ffp-contract=off", "-fPIC")
LIBRARIES = ("-lm", "-lpthread")


def compiler() -> list[str]:
    """$CC, or the compiler that this Python was built with, or cc."""
    return shlex.split(os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc")


def archiver() -> list[str]:
    """$AR, or ar."""
    return shlex.split(os.environ.get("AR") or "ar")


def library_sources(root: Path) -> list[Path]:
    """All sources but the main files, in an order that is the same everywhere."""
    files = {file for folder in FOLDERS for file in root.glob(f"{folder}/*.c")}
    return sorted(file for file in files if file.name != "main.c")


def generate_object_dictionaries(root: Path, work: Path) -> list[Path]:
    """C sources of the object dictionaries, made from their EDS files in `work`."""
    work.mkdir(parents=True, exist_ok=True)
    paths = [str(root / "tools"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    for name, file in OBJECT_DICTIONARIES.items():
        command = [sys.executable, "-m", "eds.to_c", str(root / file), name, str(work)]
        subprocess.run(command, check=True, env=environment)
    return [work / f"od_{name}.c" for name in OBJECT_DICTIONARIES]


def build_programs(root: Path, work: Path, out: Path) -> list[Path]:
    """Compiles and links all programs of this platform into `out`; elsewhere nothing.

    Raises CalledProcessError, with the compiler's own message before.
    """
    programs = programs_for(sys.platform)
    if not programs:
        return []
    out.mkdir(parents=True, exist_ok=True)
    generated = generate_object_dictionaries(root, work / "generated")
    include = [f"-I{root / folder}" for folder in ("firmware", "sim")]
    include += [f"-I{work / 'generated'}", f"-ffile-prefix-map={root}=."]

    def compiled(source: Path) -> Path:
        inside = source.relative_to(work if source.is_relative_to(work) else root)
        target = work / "objects" / inside.with_suffix(".o")
        target.parent.mkdir(parents=True, exist_ok=True)
        subprocess.run(
            [*compiler(), *CFLAGS, *include, "-c", "-o", str(target), str(source)], check=True
        )
        return target

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        parts = list(pool.map(compiled, [*library_sources(root), *generated]))
        mains = list(pool.map(compiled, [root / main for main in programs.values()]))
    archive = work / "libhodograph.a"
    archive.unlink(missing_ok=True)
    subprocess.run([*archiver(), "rcsD", str(archive), *map(str, parts)], check=True)
    made = []
    for name, main in zip(programs, mains, strict=True):
        target = out / name
        subprocess.run(
            [*compiler(), "-s", "-o", str(target), str(main), str(archive), *LIBRARIES], check=True
        )
        made.append(target)
    return made
