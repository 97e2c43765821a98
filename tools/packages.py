#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""packages.py SET...: installs the Debian packages of the sets that this computer lacks. Run by the Makefile. Used by
vcan/main. Starts apt-get.

A set is `build` (compile, .venv, bus), `bus`, `test`, `lint`, `fuzz`, `firmware`, `flash`, `aarch64`, `deb`,
`clean-root`, `container` or `compare`. Missing Debian packages are installed when this runs as root or with
passwordless sudo; otherwise the command to type is printed and the exit status is 1. Standard library only: it runs
before anything is installed.
"""

from __future__ import annotations

import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple


class Need(NamedTuple):
    """One thing the machine must have: how to see that it is there, and the Debian package that brings it."""

    what: str
    is_there: Callable[[], bool]
    package: str


def _program(name: str) -> Need:
    return Need(name, lambda: _which(name) is not None, _PACKAGE_OF.get(name, name))


def _which(name: str) -> str | None:
    # Debian keeps administrators' programs out of an ordinary user's PATH.
    return shutil.which(name, path=os.environ.get("PATH", "") + ":/usr/sbin:/sbin")


def _file(path: str, package: str) -> Need:
    return Need(path, lambda: Path(path).exists(), package)


def _has_python_header() -> bool:
    return Path(sysconfig.get_paths()["include"], "Python.h").exists()


def _has_libfuzzer() -> bool:
    """Whether clang has its runtime, which Debian packages apart."""
    clang = _which("clang")
    if clang is None:
        return False
    said = subprocess.run(
        [clang, "-print-runtime-dir"], capture_output=True, text=True, check=False
    )
    return any(Path(said.stdout.strip()).glob("libclang_rt.fuzzer*.a"))


def _has_venv() -> bool:
    return all(importlib.util.find_spec(name) is not None for name in ("venv", "ensurepip"))


def _cargo_package() -> str:
    """The package that has cargo. What bookworm calls so is of 2022 and reads the index of all crates by git."""
    try:
        is_bookworm = platform.freedesktop_os_release().get("VERSION_CODENAME") == "bookworm"
    except OSError:  # no /etc/os-release
        is_bookworm = False
    return "cargo-web" if is_bookworm else "cargo"


_PACKAGE_OF = {
    "linux.uml": "user-mode-linux",
    "ip": "iproute2",
    "insmod": "kmod",
    "taskset": "util-linux",
    "unshare": "util-linux",
    "linuxcnc": "linuxcnc-uspace",
    "ar": "binutils",
    "node": "nodejs",
    "candump": "can-utils",
    "cansend": "can-utils",
    "arm-none-eabi-gcc": "gcc-arm-none-eabi",
    "riscv64-unknown-elf-gcc": "gcc-riscv64-unknown-elf",
    "qemu-system-riscv32": "qemu-system-misc",
    "qemu-aarch64": "qemu-user",
    "dpkg-buildpackage": "dpkg-dev",
    "dh": "debhelper",
    "cargo": _cargo_package(),
}

BUS = (
    *(_program("gcc"), _file("/usr/include/stdlib.h", "libc6-dev")),
    _program("linux.uml"),
    _program("ip"),
    _program("insmod"),
    _program("taskset"),
)
BUILD = (
    _program("ar"),
    _file("/usr/include/linux/can.h", "linux-libc-dev"),
    Need("Python.h", _has_python_header, "python3-dev"),
    Need("the Python modules venv and ensurepip", _has_venv, "python3-venv"),
    *BUS,
)
TEST = (
    *(_program("chromium"), _program("candump"), _program("cansend"), _program("cargo")),
    *(_program("zsh"), _program("fish"), _program("mandoc")),
    *(_program("cmake"), _program("g++"), _program("pkg-config")),
)
LINT = (_program("clang"), _program("cppcheck"), _program("shellcheck"), _program("node"))
FUZZ = (_program("clang"), Need("libFuzzer", _has_libfuzzer, "libclang-rt-dev"))
FIRMWARE = (
    _program("arm-none-eabi-gcc"),
    _file("/usr/lib/picolibc/arm-none-eabi/picolibc.specs", "picolibc-arm-none-eabi"),
    _program("riscv64-unknown-elf-gcc"),
    _file("/usr/lib/picolibc/riscv64-unknown-elf/picolibc.specs", "picolibc-riscv64-unknown-elf"),
    _program("qemu-system-arm"),
    _program("qemu-system-riscv32"),
)
FLASH = (_program("openocd"),)
AARCH64_ROOT = "/usr/aarch64-linux-gnu"
AARCH64 = (
    _program("qemu-aarch64"),
    _file(f"{AARCH64_ROOT}/lib/ld-linux-aarch64.so.1", "libc6-arm64-cross"),
)
DEB = (_program("dpkg-buildpackage"), _program("dh"))
# To try packages: what they are checked with, a clean root, and containers.
CLEAN_ROOT = (_program("lintian"), _program("mmdebstrap"))
CONTAINER = (_program("buildah"), *CLEAN_ROOT)
COMPARE = (_program("linuxcnc"), _program("unshare"))
SETS = {
    "build": BUILD,
    "bus": BUS,
    "test": TEST,
    "lint": LINT,
    "fuzz": FUZZ,
    "firmware": FIRMWARE,
    "flash": FLASH,
    "aarch64": AARCH64,
    "deb": DEB,
    "clean-root": CLEAN_ROOT,
    "container": CONTAINER,
    "compare": COMPARE,
}


def _missing(needs: Sequence[Need]) -> list[Need]:
    return [need for need in needs if not need.is_there()]


def _becoming_root() -> list[str] | None:
    """The words to put before a command so that root runs it; None when there is no way without a password."""
    if os.geteuid() == 0:
        return []
    sudo = shutil.which("sudo")
    if (
        sudo
        and subprocess.run([sudo, "-n", "true"], capture_output=True, check=False).returncode == 0
    ):
        return [sudo, "-n", "env"]
    return None


def _install(packages: list[str], root: list[str]) -> bool:
    """Installs; fetches the package lists once when they are missing or too old."""
    apt = [
        *root,
        *(["env"] if not root else []),
        "DEBIAN_FRONTEND=noninteractive",
        "apt-get",
        "-qq",
    ]
    install = [
        *apt,
        "-o",
        "DPkg::Lock::Timeout=300",
        "install",
        "-y",
        "--no-install-recommends",
        *packages,
    ]
    print(f"installing Debian packages: {' '.join(packages)}", file=sys.stderr)
    lists = Path("/var/lib/apt/lists")
    if any(lists.glob("*_Packages*")) and _quietly(install):
        return True
    return _quietly([*apt, "update"]) and _quietly(install, say=True)


def _quietly(command: list[str], *, say: bool = False) -> bool:
    done = subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False
    )
    if done.returncode != 0 and say:
        print(done.stdout[-2000:] + done.stderr[-2000:], file=sys.stderr)
    return done.returncode == 0


def _complain(text: str) -> int:
    print(f"packages: {text}", file=sys.stderr)
    return 1


def ensure(names: Sequence[str]) -> int:
    """0 when all of the sets is there, already or now; else 1, after one clear message."""
    if sys.version_info < (3, 11):  # noqa: UP036  (this is where an older one is found out)
        return _complain(f"Python 3.11 or newer is needed; {sys.executable} is older")
    missing = _missing([need for name in names for need in SETS[name]])
    if not missing:
        return 0
    things = ", ".join(need.what for need in missing)
    packages = sorted({need.package for need in missing})
    words = " ".join(packages)
    if shutil.which("apt-get") is None:
        return _complain(f"missing: {things}; no apt-get here: install what Debian has as {words}")
    root = _becoming_root()
    if root is None:
        return _complain(
            f"missing: {things}; this is not root and has no passwordless sudo, so please type:\n"
            f"  sudo apt-get update && sudo apt-get install -y --no-install-recommends {words}"
        )
    if not _install(packages, root):
        return _complain(f"could not install {words}; apt-get's words are above")
    left = ", ".join(need.what for need in _missing(missing))
    if left:
        return _complain(f"installed {words}, yet missing for {sys.executable}: {left}")
    return 0


if __name__ == "__main__":
    if len(sys.argv) < 2 or any(name not in SETS for name in sys.argv[1:]):
        print(f"usage: packages.py {{{'|'.join(SETS)}}}...", file=sys.stderr)
        sys.exit(2)
    sys.exit(ensure(sys.argv[1:]))
