# SPDX-License-Identifier: MIT
"""`make wheels`: the wheels of both platforms, and the controller of the one for aarch64 under QEMU."""

from __future__ import annotations

import json
import sys
import zipfile
from pathlib import Path

import pytest

from subprocesses import run

ROOT = Path(__file__).resolve().parents[2]
ALPHA = ROOT / "examples/alpha.toml"
HANGS_S = 800.0
pytestmark = pytest.mark.long


@pytest.fixture(autouse=True)
def own_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A local bus of its own, and no options of a make that runs this."""
    monkeypatch.delenv("HODOGRAPH_BUS", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for name in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL"):
        monkeypatch.delenv(name, raising=False)


def output(*command: object) -> str:
    return run(*command, limit_s=HANGS_S).stdout


def unpacked(wheel: Path, folder: Path) -> Path:
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    for program in (folder / "hodograph/bin").iterdir():
        program.chmod(0o755)
    return folder / "hodograph"


def newest_glibc(file: Path) -> tuple[int, ...]:
    """The newest version of glibc that a program or module asks for."""
    names = output("objdump", "-T", file)
    versions = {
        word.strip("()").removeprefix("GLIBC_") for word in names.split() if "GLIBC_" in word
    }
    return max(tuple(map(int, version.split("."))) for version in versions)


def test_wheels_of_both_platforms(tmp_path: Path) -> None:
    """The controller of each gives the setpoints of `simulate`; the one for aarch64 runs under QEMU's user mode."""
    output(sys.executable, ROOT / "tools/packages.py", "aarch64")
    output("make", "--no-print-directory", "wheels", f"DIST={tmp_path}")
    expected = json.loads(output(sys.executable, "-m", "hodograph", "simulate", ALPHA, "--json"))
    for machine, emulator in (
        ("x86_64", ""),
        ("aarch64", "qemu-aarch64 -L /usr/aarch64-linux-gnu "),
    ):
        (wheel,) = tmp_path.glob(f"*manylinux2014_{machine}.whl")
        package = unpacked(wheel, tmp_path / machine)
        controller = f"{emulator}{package / 'bin/hodograph-controller'}"
        words = ["run", ALPHA, "--json", "--pace", "fast", "--controller", controller]
        ran = json.loads(output(sys.executable, "-m", "hodograph", *words))
        assert ran["setpoints_sha256"] == expected["setpoints_sha256"], machine
        if machine == "x86_64":
            for file in (*(package / "bin").iterdir(), package / "native/_native.abi3.so"):
                assert newest_glibc(file) <= (2, 17), file
