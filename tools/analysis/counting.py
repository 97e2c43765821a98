# SPDX-License-Identifier: MIT
"""Counts the instructions of the tick in an emulated run: an array of calls by parts. Used by analysis/,
tools/count_tick and tools/count_til. Starts the emulator with count_plugin.c; writes temporary files.
"""

from __future__ import annotations

import struct
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from analysis import emulator, parts

Counts = npt.NDArray[np.uint32]
Command = tuple[
    int, int
]  # before this tick; per cent of override, or what tests/target/commands.h has
_WORDS = 128  # of a record of the plugin


def stored(commands: Iterable[Command]) -> bytes:
    """Commands as setpoints.elf reads them."""
    return b"".join(struct.pack("<II", *command) for command in commands)


def read(out: Path, columns: int) -> Counts:
    """What count_plugin.c has written."""
    return np.fromfile(out, "<u4").reshape(-1, _WORDS)[:, :columns]


@dataclass
class Counter:
    """Counts on one target; a map of its image is made once."""

    build: Path
    target: emulator.Target
    image: str = "setpoints"
    entry: str = "tick"
    interrupts: tuple[str, ...] = ()  # handlers that may come in between: not counted
    functions: bool = False  # count by functions as they are linked, not by parts
    _map: parts.Map | None = field(default=None, init=False)

    @property
    def elf(self) -> Path:
        return self.build / "firmware" / self.target.name / f"{self.image}.elf"

    @property
    def map(self) -> parts.Map:
        """For count_plugin.c."""
        if self._map is None:
            counted = parts.Counted(self.entry, self.interrupts)
            make = parts.function_map if self.functions else parts.part_map
            self._map = make(self.target.cross, self.elf, counted)
        return self._map

    @property
    def names(self) -> Sequence[str]:
        """Names of the columns of what is counted."""
        return self.map.names

    def count(
        self,
        kernel: str,
        programs: bytes,
        commands: Sequence[Command] = (),
        options: Sequence[str] = (),
        times: Path | None = None,
        setpoints: Path | None = None,
    ) -> Counts:
        """Instructions of each tick of one or more images one after the other, (ticks, len(names)).

        `times` gets what the image's own clock says, `setpoints` its setpoints.
        """
        with tempfile.TemporaryDirectory() as name:
            given = Path(name) / "commands"
            given.write_bytes(stored(commands))
            words = [str(emulator.KERNELS[kernel]), str(setpoints or Path(name) / "setpoints")]
            words += [str(given) if commands else "-"]
            words += [str(times)] if times else []
            return self.count_words(words, programs, options)

    def count_words(
        self, words: Sequence[str], store: bytes, options: Sequence[str] = ()
    ) -> Counts:
        """The same of any image: with these words, and this in its store."""
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "map").write_text(self.map.text)
            (folder / "store").write_bytes(store)
            plugin = self.plugin_words(folder / "map", folder / "out")
            options = ["-plugin", plugin, *options]
            emulator.run(self.target, self.elf, words, folder / "store", options)
            return read(folder / "out", len(self.names))

    def plugin_words(self, given: Path, out: Path) -> str:
        """For QEMU's -plugin: the map lies in `given`, records go to `out`."""
        return f"{self.build.resolve() / 'target/count_plugin.so'},map={given},out={out}"
