# SPDX-License-Identifier: MIT
"""What pyproject.toml cannot say: the package holds a native module and programs, which are compiled here.

Where `make` builds both (HODOGRAPH_BUILT_BY_MAKE=1), nothing is compiled: the module lies beside its sources then, and
the programs in build/bin.

Run by pip and by `make dist`. Starts compilers; writes what they make to the build folder of setuptools.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from pathlib import Path

from setuptools import setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build import build
from setuptools.command.build_ext import build_ext
from setuptools.errors import CompileError, FileError, PlatformError

ROOT = Path(__file__).resolve().parent
sys.path[:0] = [str(ROOT / "tools"), str(ROOT / "host_tools/hodograph/native")]

from build_native import extension  # noqa: E402

from dist.programs import build_programs, compiler, programs_for  # noqa: E402

PROGRAMS = tuple(programs_for(sys.platform))
BY_MAKE = os.environ.get("HODOGRAPH_BUILT_BY_MAKE") == "1"
NEEDED = (
    "hodograph/data/controller.eds",
    "hodograph/data/examples/*.toml",
    "hodograph/data/examples/machines/*.toml",
    "hodograph/data/examples/drives/*.toml",
    "hodograph/data/template/*.toml",
    "hodograph/monitor/page/index.html",
    "hodograph/monitor/page/page.js",
    "hodograph/monitor/page/style.css",
    "hodograph/native/_native.*[do]",  # .abi3.so, on Windows .pyd
    *(f"hodograph/bin/{name}" for name in PROGRAMS),
)


class CheckedBuild(build):
    """Begins with what the computer needs: without it, the message would come after the names of all files."""

    def run(self) -> None:
        """Builds; raises a PlatformError that says what is missing. Other systems than POSIX find their compilers."""
        missing = what_is_missing() if os.name == "posix" and not BY_MAKE else None
        if missing is not None:
            raise PlatformError(f"{missing}, or install the wheel of hodograph, which is compiled")
        super().run()


def what_is_missing() -> str | None:
    """What the computer lacks to compile the package, and what to do; None when it has all."""
    program = compiler()[0]
    if shutil.which(program) is None:
        return (
            f"no C compiler: {program} was not found; install one (Debian: apt install gcc libc6-dev python3-dev), "
            "or set CC"
        )
    header = Path(sysconfig.get_path("include"), "Python.h")
    if not header.is_file():
        return f"no C header of Python: {header} was not found; install it (Debian: apt install python3-dev)"
    return None


class BuildAll(build_ext):
    """The native module, and then, on Linux, the programs, which lie in the package's folder `bin`."""

    def run(self) -> None:
        """Compiles both; an installation for editing gets the programs in build/bin, where `make` puts them."""
        super().run()
        work = Path(self.build_temp) / "programs"
        inside = (
            ROOT / "build"
            if self.inplace or self.editable_mode
            else Path(self.build_lib, "hodograph")
        )
        try:
            build_programs(ROOT, work, inside / "bin")
        except subprocess.CalledProcessError as error:
            raise CompileError(f"{error.cmd[0]} ended with status {error.returncode}") from None

    def get_outputs(self) -> list[str]:
        """Files of the wheel."""
        programs = Path(self.build_lib) / "hodograph/bin"
        return [*super().get_outputs(), *(str(programs / name) for name in PROGRAMS)]


class NothingToBuild(build_ext):
    """`make` has built all of it."""

    def run(self) -> None:
        """Nothing."""

    def get_outputs(self) -> list[str]:
        """None of ours."""
        return []


class CompleteWheel(bdist_wheel):
    """A wheel with all its data, module and programs, or none."""

    def run(self) -> None:
        """Makes the wheel, and takes it back with a FileError when something is missing."""
        super().run()
        wheel = Path(self.distribution.dist_files[-1][2])
        with zipfile.ZipFile(wheel) as archive:
            names = [Path(name) for name in archive.namelist()]
        missing = [needed for needed in NEEDED if not any(name.match(needed) for name in names)]
        if missing:
            wheel.unlink()
            raise FileError(f"the wheel would lack {', '.join(missing)}")


def shared_files() -> list[tuple[str, list[str]]]:
    """Man page and shell completion, below PREFIX/share; tools/dist/make_release.py puts them into a release."""
    share = ROOT / "packaging/share"
    files = sorted(file for file in share.rglob("*") if file.is_file())
    return [
        (f"share/{file.parent.relative_to(share)}", [str(file.relative_to(ROOT))]) for file in files
    ]


def remove_stale_build() -> None:
    """setuptools packs what lies in build/lib, also from an older build: begin without."""
    shutil.rmtree(ROOT / "build/lib", ignore_errors=True)


remove_stale_build()
setup(
    ext_modules=[extension(ROOT)],
    data_files=shared_files(),
    cmdclass={
        "bdist_wheel": CompleteWheel,
        "build": CheckedBuild,
        "build_ext": NothingToBuild if BY_MAKE else BuildAll,
    },
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
