# SPDX-License-Identifier: MIT
"""The programs of tests/data/bits, the runs that are made of them, and their golden hashes. Used by test_target_bits.py
and started by `make golden`; reads tests/data/bits, starts emulators and processes.

    python tests/support/target_bits.py      (make golden) writes golden.txt anew from the host's build

golden.txt: a row for each program and run: run, ticks, SHA-256 of the setpoints of the fixed kernel and of the float
kernel (i32 x and y of all ticks in counts of 1 nm, as everywhere), name of the program.
"""

from __future__ import annotations

import hashlib
import lzma
import struct
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BITS = ROOT / "tests" / "data" / "bits"
HOSTS = ("gcc-O0", "gcc-O2", "clang-O0", "clang-O2")
STORE_BYTES = 0x14000  # for programs: TABLE_AT of tests/target/table.h
KERNELS = {"fixed": 0, "float": 1, "double": 2}
HOLD, RESUME, STOP = 1000, 1001, 1002  # tests/target/commands.h

# What is asked before which tick, for each run. Short programs end before most of it.
RUNS: dict[str, tuple[tuple[int, int], ...]] = {
    "plain": (),
    "commands": (
        (3, 150),
        (20, HOLD),
        (60, 37),
        (90, RESUME),
        (140, 200),
        (260, 100),
        (300, HOLD),
        (302, RESUME),
        (330, 10),
        (400, 115),
        (900, STOP),
    ),
}

Runner = Callable[[Path, Sequence[str]], None]
"""Starts setpoints.elf with this file in its store and these words; raises when that fails."""


@dataclass(frozen=True)
class Row:
    """What one program must give in one run."""

    name: str
    run: str
    ticks: int
    sha256: dict[str, str]  # by kernel


@dataclass(frozen=True)
class Store:
    """Programs that fit the store together, and the runs they are made in."""

    images: tuple[bytes, ...]
    names: tuple[str, ...]
    runs: tuple[str, ...]


def programs() -> list[bytes]:
    """The images, the examples first."""
    data = lzma.decompress((BITS / "programs.xz").read_bytes())
    images = []
    while data:
        size = struct.unpack_from("<I", data, 8)[0]
        images.append(data[:size])
        data = data[size:]
    return images


def name_of(image: bytes) -> str:
    """From the header."""
    return image[80:112].rstrip(b"\0").decode()


def stores() -> list[Store]:
    """All programs in as few stores as hold them; the first two are run with commands too."""
    groups: list[list[bytes]] = [[]]
    for image in programs():
        if sum(map(len, groups[-1])) + len(image) > STORE_BYTES:
            groups.append([])
        groups[-1].append(image)
    runs = [tuple(RUNS)] * 2 + [("plain",)] * (len(groups) - 2)
    return [
        Store(tuple(group), tuple(map(name_of, group)), run)
        for group, run in zip(groups, runs, strict=True)
    ]


def golden() -> dict[tuple[str, str], Row]:
    """The rows by program and run."""
    rows = {}
    for line in (BITS / "golden.txt").read_text(encoding="utf-8").splitlines():
        if not line.startswith("#"):
            run, ticks, fixed, single, name = line.split(maxsplit=4)
            rows[name, run] = Row(name, run, int(ticks), {"fixed": fixed, "float": single})
    return rows


def setpoints(runner: Runner, store: Store, run: str, kernel: str) -> bytes:
    """What a machine gives for a store."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "store").write_bytes(b"".join(store.images))
        (folder / "commands").write_bytes(b"".join(struct.pack("<II", *c) for c in RUNS[run]))
        words = [str(KERNELS[kernel]), str(folder / "setpoints")]
        runner(folder / "store", [*words, str(folder / "commands")] if RUNS[run] else words)
        return (folder / "setpoints").read_bytes()


def by_program(data: bytes, store: Store, run: str) -> Iterator[tuple[Row, bytes]]:
    """Setpoints of a store cut at the golden numbers of ticks; too few or too many are an AssertionError."""
    rows = golden()
    for name in store.names:
        row = rows[name, run]
        yield row, data[: 8 * row.ticks]
        data = data[8 * row.ticks :]
    assert data == b"", f"{len(data)} bytes more than the golden run"


def host_runner(build: Path, host: str) -> Runner:
    """The image as a process of this machine."""

    def run(store: Path, words: Sequence[str]) -> None:
        subprocess.run([build / "target" / f"setpoints-{host}", store, *words], check=True)

    return run


def _row(runner: Runner, image: bytes, run: str) -> Row:
    store = Store((image,), (name_of(image),), (run,))
    hashes, ticks = {}, 0
    for kernel in ("fixed", "float"):
        data = setpoints(runner, store, run, kernel)
        ticks = len(data) // 8
        hashes[kernel] = hashlib.sha256(data).hexdigest()
    return Row(store.names[0], run, ticks, hashes)


def main(build: Path) -> None:
    """Writes golden.txt."""
    runner = host_runner(build, "gcc-O2")
    lines = [
        "# run, ticks, SHA-256 of the setpoints by the fixed and by the float kernel, program.",
        "# Written by `make golden`; tests/support/target_bits.py says what the runs are.",
    ]
    for store in stores():
        for run in store.runs:
            for image in store.images:
                row = _row(runner, image, run)
                hashes = f"{row.sha256['fixed']} {row.sha256['float']}"
                lines.append(f"{row.run} {row.ticks} {hashes} {row.name}")
    (BITS / "golden.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
