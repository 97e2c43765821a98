# SPDX-License-Identifier: MIT
"""What pyproject.toml can't say: the wheel holds a compiled module, and is refused when a file is missing.

`make build` makes the module (hodograph/native/build_native.py) before; a build of the wheel only packs it.
"""

import zipfile
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.errors import FileError

NEEDED = (
    "hodograph/data/controller.eds",
    "hodograph/data/examples/*.toml",
    "hodograph/data/examples/machines/*.toml",
    "hodograph/data/examples/drives/*.toml",
    "hodograph/monitor/page/index.html",
    "hodograph/monitor/page/page.js",
    "hodograph/monitor/page/style.css",
    "hodograph/native/_native.abi3.so",
)


class PlatformDistribution(Distribution):
    """Has a compiled module, made elsewhere: the wheel is for one platform."""

    def has_ext_modules(self) -> bool:
        """Always."""
        return True


class CompleteWheel(bdist_wheel):
    """A wheel with all its data and the module, or none."""

    def run(self) -> None:
        """Makes the wheel, and takes it back with a FileError when something is missing."""
        super().run()
        wheel = Path(self.distribution.dist_files[-1][2])
        with zipfile.ZipFile(wheel) as archive:
            names = [Path(name) for name in archive.namelist()]
        missing = [needed for needed in NEEDED if not any(name.match(needed) for name in names)]
        if missing:
            wheel.unlink()
            raise FileError(
                f"the wheel would lack {', '.join(missing)}: build it within the whole tree, "
                "after `make build`"
            )


setup(
    distclass=PlatformDistribution,
    cmdclass={"bdist_wheel": CompleteWheel},
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
