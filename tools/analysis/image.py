# SPDX-License-Identifier: MIT
"""A linked image as the binary utilities show it: symbols, memory, instructions by function. Used by analysis/,
tools/check_image, tools/longest_path and tools/size. Reads the image, and starts the binary utilities (nm, readelf,
size, objdump) when their output is first needed.
"""

from __future__ import annotations

import re
import struct
import subprocess
from bisect import bisect_right
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

_EM_RISCV = 243
"""Machine number of RISC-V in an ELF header."""
_FUNCTION = re.compile(r"^([0-9a-f]+) <([^>]+)>:$")
_LINE = re.compile(r"^\s*([0-9a-f]+):\t(\S+)(?:\t(.*))?$")
_DATA = {".word": 4, ".short": 2, ".byte": 1}


@dataclass(frozen=True)
class Instruction:
    """`operands` without the disassembler's comment, which is `note`."""

    address: int
    mnemonic: str
    operands: str
    note: str


@dataclass(frozen=True)
class Function:
    """What stands between two symbols of the code. Static ones can share a name."""

    name: str
    address: int
    instructions: list[Instruction] = field(default_factory=list, compare=False)


class Image:
    """An ELF file of 32 bits, little-endian."""

    def __init__(self, file: Path) -> None:
        self.file = file
        self._bytes = file.read_bytes()
        self.is_riscv = struct.unpack_from("<H", self._bytes, 18)[0] == _EM_RISCV
        self.cross = "riscv64-unknown-elf-" if self.is_riscv else "arm-none-eabi-"

    def _tool(self, tool: str, *options: str) -> str:
        command = [self.cross + tool, *options, str(self.file)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout

    @cached_property
    def symbols(self) -> dict[str, int]:
        """Address of each name; 0 for names that an object only refers to."""
        found = {}
        for line in self._tool("nm").splitlines():
            words = line.split()
            found[words[-1]] = int(words[0], 16) if len(words) == 3 else 0
        return {name: address for name, address in found.items() if not name.startswith("$")}

    @cached_property
    def has_fpu(self) -> bool:
        """Whether it was compiled for hardware that adds floats."""
        return "Tag_FP_arch" in self._tool("readelf", "-A")

    def word(self, address: int) -> int:
        """What the loader puts there. KeyError when it puts nothing."""
        for start, offset, size in self._segments():
            if start <= address < start + size:
                return int(struct.unpack_from("<I", self._bytes, offset + address - start)[0])
        raise KeyError(hex(address))

    def _segments(self) -> Iterator[tuple[int, int, int]]:
        """(address where it runs, offset in the file, size in the file)"""
        begin = struct.unpack_from("<I", self._bytes, 28)[0]
        size, count = struct.unpack_from("<HH", self._bytes, 42)
        for i in range(count):
            header = struct.unpack_from("<8I", self._bytes, begin + i * size)
            if header[0] == 1:
                yield header[2], header[1], header[4]

    def sections(self) -> dict[str, int]:
        """Size of each section that takes memory."""
        sizes = {}
        for line in self._tool("size", "-A").splitlines()[2:]:
            words = line.split()
            if len(words) == 3 and not words[0].startswith((".debug", ".comment")):
                sizes[words[0]] = int(words[1])
        return sizes

    @cached_property
    def functions(self) -> list[Function]:
        """All code, in the order of addresses."""
        return self._disassembled[0]

    @cached_property
    def literals(self) -> dict[int, int]:
        """Words of data within the code."""
        return self._disassembled[1]

    @cached_property
    def _disassembled(self) -> tuple[list[Function], dict[int, int]]:
        functions: list[Function] = []
        literals = {}
        for line in self._tool("objdump", "-d", "--no-show-raw-insn").splitlines():
            head = _FUNCTION.match(line)
            if head:
                functions.append(Function(head[2], int(head[1], 16)))
                continue
            found = _LINE.match(line)
            if found is None:
                continue
            address, mnemonic = int(found[1], 16), found[2]
            if mnemonic in _DATA:
                literals[address] = int((found[3] or "0").split()[0], 0)
                continue
            operands, note = _without_note(found[3] or "", "#" if self.is_riscv else "@;")
            functions[-1].instructions.append(Instruction(address, mnemonic, operands, note))
        return [f for f in functions if f.instructions], literals

    @cached_property
    def _starts(self) -> list[int]:
        return [f.address for f in self.functions]

    def function_at(self, address: int) -> Function:
        """The function in which an address lies; KeyError when none begins before it."""
        index = bisect_right(self._starts, address) - 1
        if index < 0:
            raise KeyError(hex(address))
        return self.functions[index]


def _without_note(text: str, marks: str) -> tuple[str, str]:
    for mark in marks:
        # "#4" is a number to Arm; to RISC-V, whose numbers have no mark, "#" begins a note
        at = text.find(mark + " ")
        if at >= 0:
            return text[:at].strip(), text[at + 1 :].strip()
    return text.strip(), ""
