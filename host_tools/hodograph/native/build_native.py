# SPDX-License-Identifier: MIT
"""Builds `_native`, the compiled module of this package, from the C core and the simulator (cffi, API mode).
Run by `make build`; setup.py uses it too. Starts the compiler and writes the module.

    python build_native.py [--build DIR]

Links DIR/host/libhodograph_{sim,core,numerics}.a (DIR: `build` at the root of the tree), which `make c` makes,
and puts `_native.abi3.so` into the folder of this file. The Makefile calls it. For `pip install`, setup.py takes
`extension`, which compiles the sources itself.

Writes to DIR and next to this file.
"""

import argparse
import shutil
import sys
from pathlib import Path
from typing import Any

from cffi import FFI

PACKAGE = Path(__file__).resolve().parent
ROOT = PACKAGE.parents[2]
HEADERS = (
    "core/program_check.h",
    "core/stop_check.h",
    "core/brake_check.h",
    "core/coefficients.h",
    "core/interpolator.h",
    "core/chunk.h",
    "core/path_outputs.h",
    "core/feed_override.h",
    "numerics/ph_chain.h",
    "numerics/quadratic_program.h",
    "numerics/override_headroom.h",
    "plant/drive.h",
    "offline/contour.h",
    "offline/offline.h",
    "offline/smoothing.h",
    "offline/stop_search.h",
    "offline/stream.h",
    "offline/stop_trial.h",
    "offline/axis_run.h",
)
LIBRARIES = ("sim", "core", "numerics")
SOURCES = ("firmware/core", "sim/plant", "sim/offline", "host_tools/numerics")
"""Folders whose sources these libraries are made of."""
INCLUDES = ("firmware", "sim", "host_tools")
CFLAGS = ("-std=c99", "-O2", "-ffp-contract=off")


def declarations() -> str:
    """The C declarations that the module offers to Python."""
    return (PACKAGE / "declarations.h").read_text(encoding="utf-8")


def _ffi(**options: Any) -> FFI:
    """The declarations of the module and how it is compiled; `options` go to set_source."""
    ffi = FFI()
    ffi.cdef(declarations())
    includes = "".join(f'#include "{header}"\n' for header in HEADERS)
    ffi.set_source(
        "hodograph.native._native",
        "#include <stdbool.h>\n" + includes,
        extra_compile_args=list(CFLAGS),
        libraries=["m"],
        py_limited_api=True,
        **options,
    )
    return ffi


def extension(root: Path) -> Any:
    """The module as an extension for setuptools, from all sources below `root`, the current folder."""
    sources = sorted(
        str(file.relative_to(root)) for folder in SOURCES for file in (root / folder).glob("*.c")
    )
    ffi = _ffi(sources=sources, include_dirs=list(INCLUDES), extra_link_args=["-s"])
    own: Any = ffi.distutils_extension(tmpdir="build/native")
    own.py_limited_api = True
    own.define_macros.append(("Py_LIMITED_API", "0x030b0000"))
    return own


def build(build_dir: Path) -> Path:
    """Compile and link the module; returns its path. Raises FileNotFoundError without the archives."""
    archives = [build_dir / "host" / f"libhodograph_{name}.a" for name in LIBRARIES]
    for archive in archives:
        if not archive.is_file():
            raise FileNotFoundError(f"{archive} is missing: run `make c` first")
    ffi = _ffi(
        include_dirs=[str(ROOT / folder) for folder in INCLUDES],
        extra_objects=[str(archive) for archive in archives],
    )
    work = build_dir / "native"
    work.mkdir(parents=True, exist_ok=True)
    made = Path(ffi.compile(tmpdir=str(work)))
    target = PACKAGE / made.name
    fresh = target.with_suffix(".new")
    shutil.copyfile(made, fresh)
    fresh.replace(target)
    return target


def main() -> int:
    """Entry point; returns the exit status."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build")
    try:
        build(parser.parse_args().build.resolve())
    except FileNotFoundError as error:
        print(f"build_native: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
