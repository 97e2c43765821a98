# SPDX-License-Identifier: MIT
"""`make wheels`: the wheels of both platforms; programs and Python module of the one for aarch64 under QEMU. Run by
pytest; starts `make`, which may write build/, QEMU and `hodograph`; writes to temporary folders.
"""

from __future__ import annotations

import json
import platform
import sys
import zipfile
from pathlib import Path

import pytest

from subprocesses import run

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

from dist.requirements import lock_text, runtime_requirements  # noqa: E402

ALPHA = ROOT / "examples/alpha.toml"
HANGS_S = 800.0
MAKE_WORDS = ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")
PYTHON_PACKAGES = "python3-minimal,libpython3-stdlib,libstdc++6"
pytestmark = pytest.mark.long


@pytest.fixture(autouse=True)
def own_environment(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A local bus of its own, and no options of a make that runs this."""
    monkeypatch.delenv("HODOGRAPH_BUS", raising=False)
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    for name in MAKE_WORDS:
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


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder with both."""
    folder = tmp_path_factory.mktemp("wheels")
    output(sys.executable, ROOT / "tools/packages.py", "aarch64")
    hidden = ("env", *(f"--unset={name}" for name in MAKE_WORDS))
    output(*hidden, "make", "--no-print-directory", "wheels", f"DIST={folder}")
    return folder


def python_of_arm64(folder: Path) -> Path:
    """Debian's Python for arm64 with its libraries, unpacked only: nothing of it runs to be installed."""
    release = platform.freedesktop_os_release()["VERSION_CODENAME"]
    unpack = ("mmdebstrap", "--variant=extract", "--architectures=arm64")
    output(*unpack, f"--include={PYTHON_PACKAGES}", release, folder)
    return folder / "usr/bin/python{}.{}".format(*sys.version_info)


def requirements_of_arm64(site: Path, lock: Path) -> None:
    """The locked requirements of the package, as wheels for aarch64."""
    lock.write_text(lock_text(runtime_requirements()), encoding="utf-8")
    python = "{}.{}".format(*sys.version_info)
    chosen = ["--implementation", "cp", "--python-version", python, "--only-binary=:all:"]
    for abi in (f"cp{python.replace('.', '')}", "abi3", "none"):
        chosen += ["--abi", abi]
    for name in ("manylinux2014", *(f"manylinux_2_{minor}" for minor in (17, 26, 27, 28))):
        chosen += ["--platform", f"{name}_aarch64"]
    pip = (sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile")
    output(*pip, *chosen, "--require-hashes", "-r", lock, "--target", site)


@pytest.mark.timeout(3600)
def test_the_python_module_for_aarch64(wheels: Path, tmp_path: Path) -> None:
    """`hodograph simulate` by Debian's Python for arm64 under QEMU's user mode: the same bits as here."""
    output(sys.executable, ROOT / "tools/packages.py", "clean-root")
    (wheel,) = wheels.glob("*manylinux2014_aarch64.whl")
    package = unpacked(wheel, tmp_path / "wheel").parent
    python = python_of_arm64(tmp_path / "root")
    requirements_of_arm64(tmp_path / "site", tmp_path / "lock.txt")
    words = ("qemu-aarch64", "-L", tmp_path / "root")
    words += ("-E", f"PYTHONPATH={package}:{tmp_path / 'site'}", python, "-m")
    simulate = ("hodograph", "simulate", ALPHA, "--json")
    there = json.loads(run(*words, *simulate, cwd=tmp_path, limit_s=HANGS_S).stdout)
    assert there == json.loads(output(sys.executable, "-m", *simulate))


def test_wheels_of_both_platforms(wheels: Path, tmp_path: Path) -> None:
    """The controller of each gives the setpoints of `simulate`; the one for aarch64 runs under QEMU's user mode."""
    expected = json.loads(output(sys.executable, "-m", "hodograph", "simulate", ALPHA, "--json"))
    for machine, emulator in (
        ("x86_64", ""),
        ("aarch64", "qemu-aarch64 -L /usr/aarch64-linux-gnu "),
    ):
        (wheel,) = wheels.glob(f"*manylinux2014_{machine}.whl")
        package = unpacked(wheel, tmp_path / machine)
        controller = f"{emulator}{package / 'bin/hodograph-controller'}"
        words = ["run", ALPHA, "--json", "--pace", "fast", "--controller", controller]
        ran = json.loads(output(sys.executable, "-m", "hodograph", *words))
        assert ran["setpoints_sha256"] == expected["setpoints_sha256"], machine
        if machine == "x86_64":
            for file in (*(package / "bin").iterdir(), package / "native/_native.abi3.so"):
                assert newest_glibc(file) <= (2, 17), file
