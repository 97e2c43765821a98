# SPDX-License-Identifier: MIT
"""The emulated boards: which machine a target's image runs on, and how it is started with one program. Used by all
tools that count instructions or bound their number. Starts QEMU and waits for its end.

tests/target/setpoints.c is the image; its words are KERNEL FILE (and more, see there).
"""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KERNELS = {"fixed": 0, "float": 1}
_LIMIT_S = 300
"""Longest run of an emulator."""


@dataclass(frozen=True)
class Target:
    """One row for each of firmware/targets/*.ld."""

    name: str
    core: str
    machine: str
    store: int  # where the program lies
    clock_mhz: int  # of SysTick; of minstret, in QEMU, a nanosecond
    kernels: tuple[str, ...]

    @property
    def is_arm(self) -> bool:
        return self.core != "RV32"

    @property
    def cross(self) -> str:
        """Prefix of the binary utilities."""
        return "arm-none-eabi-" if self.is_arm else "riscv64-unknown-elf-"

    @property
    def qemu(self) -> list[str]:
        """The emulator's words that do not depend on the run."""
        program = "qemu-system-arm" if self.is_arm else "qemu-system-riscv32"
        bios = [] if self.is_arm else ["-bios", "none"]
        return [program, *bios, "-M", self.machine, *_QUIET]


_QUIET = ("-nographic", "-monitor", "none", "-serial", "none")

TARGETS = {
    t.name: t
    for t in (
        Target("an386", "M4F", "mps2-an386", 0x21000000, 25, ("float", "fixed")),
        Target("an385", "M3", "mps2-an385", 0x21000000, 25, ("fixed",)),
        Target("microbit", "M0", "microbit", 0x20000, 16, ("fixed",)),
        Target("an500", "M7", "mps2-an500", 0x60000000, 25, ("float", "fixed")),
        Target("an505", "M33", "mps2-an505", 0x80000000, 20, ("float", "fixed")),
        Target("rv32", "RV32", "virt", 0x82000000, 1000, ("fixed",)),
    )
}


def run(
    target: Target,
    image: Path,
    words: Sequence[str],
    program: Path,
    options: Sequence[str] = (),
) -> None:
    """Runs an image with a program in its store to the end; RuntimeError when it or QEMU is not content."""
    arguments = ",".join(["enable=on,target=native", *(f"arg={word}" for word in words)])
    command = [*target.qemu, "-kernel", str(image), "-semihosting-config", arguments, *options]
    command += ["-device", f"loader,file={program},addr={target.store:#x},force-raw=on"]
    done = subprocess.run(
        command,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=_LIMIT_S,
        check=False,
    )
    if done.returncode != 0:
        raise RuntimeError(
            f"{image}: exit status {done.returncode} {done.stderr.strip()[-500:]}: {' '.join(command)}"
        )
