# SPDX-License-Identifier: MIT
"""The effect of an instruction on the stack pointer, and the instructions that may follow; Thumb and RISC-V, as written
by objdump. Used by analysis/longest, analysis/stack and tools/check_image. No I/O but that of `analysis/image`.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass

from analysis.image import Function, Image, Instruction

_CONDITIONS = "eq|ne|cs|hs|cc|lo|mi|pl|vs|vc|hi|ls|ge|lt|gt|le"
_ADDRESS = re.compile(r"(?:^|[\s,])([0-9a-f]+) <")
_NUMBER = re.compile(r"#?(-?(?:0x[0-9a-f]+|\d+))$")
_MILLICODE = re.compile(r"<__riscv_(save|restore)_(\d+)>")
_SP_MATH = re.compile(r"(add|sub)w?s?$")


class StackError(Exception):
    """An instruction that this module cannot interpret, so that no bound can be given."""


@dataclass(frozen=True)
class Effect:
    """`grows`: bytes of stack taken, or given back. `falls`: the next instruction may follow."""

    grows: int = 0
    falls: bool = True
    branch: int | None = None  # goes there
    call: int | None = None  # calls that
    indirect: bool = False  # calls through a register
    jump: bool = False  # goes somewhere within the function, by a table


Rule = Callable[[Image, Function, int], Effect]


def effect(image: Image, function: Function, index: int) -> Effect:
    """Of instruction number `index`."""
    rule: Rule = _riscv if image.is_riscv else _thumb
    return rule(image, function, index)


def _target(instruction: Instruction) -> int | None:
    found = _ADDRESS.search(instruction.operands) or _ADDRESS.search(instruction.note)
    return int(found[1], 16) if found else None


def _unknown(function: Function, instruction: Instruction) -> StackError:
    text = f"{instruction.mnemonic} {instruction.operands}"
    return StackError(f"{function.name}: {instruction.address:#x}: cannot judge '{text}'")


# ---- Thumb ---------------------------------------------------------------------------------------


def _thumb(image: Image, function: Function, index: int) -> Effect:
    instruction = function.instructions[index]
    name = re.sub(r"\.[nw]$", "", instruction.mnemonic)
    operands = instruction.operands
    if name in ("b", "bl", "blx", "bx", "cbz", "cbnz") or re.fullmatch(rf"b({_CONDITIONS})", name):
        return _thumb_branch(image, function, index, name)
    conditional = re.fullmatch(rf"(bx|pop|ldr|ldmia|mov)({_CONDITIONS})", name)
    if conditional and "pc" in operands + ("pc" if conditional[1] == "bx" else ""):
        return Effect()  # leaves, or goes on as if it were not there
    if name in ("tbb", "tbh") or re.match(r"pc, ", operands):
        returns = "[sp], #" in operands or operands == "pc, lr"
        return Effect(falls=False, jump=not returns)
    if name == "udf":
        return Effect(falls=False)
    if "pc}" in operands and name in ("pop", "ldmia"):
        return Effect(falls=False)
    return Effect(_thumb_grows(image, function, index, name))


def _thumb_branch(image: Image, function: Function, index: int, name: str) -> Effect:
    instruction = function.instructions[index]
    if name in ("bx", "blx") and not instruction.operands[0].isdigit():
        returns = name == "bx" and _holds_return_address(function, index)
        return Effect(falls=name == "blx", indirect=not returns)
    target = _target(instruction)
    if name in ("bl", "blx"):
        if target is not None and _inside(function, target):
            return Effect(branch=target, falls=False)  # ARMv6-M: a jump too far for `b`
        table = target is not None and image.function_at(target).name.startswith("__gnu_thumb1")
        return Effect(jump=True, falls=False) if table else Effect(call=target)
    return Effect(branch=target, falls=name != "b")


def _inside(function: Function, address: int) -> bool:
    """Whether it is after the first instruction of the function, to which no call goes."""
    own = function.instructions
    return own[0].address < address <= own[-1].address


def _holds_return_address(function: Function, index: int) -> bool:
    """Of `bx`: ARMv6-M pops the saved lr to a low register where arguments are still to be given back."""
    register = function.instructions[index].operands
    before = function.instructions[max(index - 2, 0) : index]
    popped = [(f.mnemonic, f.operands.partition(",")[0]) for f in before]
    return register == "lr" or popped == [("pop", f"{{{register}}}"), ("add", "sp")]


def _thumb_grows(image: Image, function: Function, index: int, name: str) -> int:
    instruction = function.instructions[index]
    operands = instruction.operands
    if name in ("push", "vpush"):
        return _list_bytes(operands)
    if name in ("pop", "vpop"):
        return -_list_bytes(operands)
    if operands.startswith("sp!, {"):
        return _list_bytes(operands) * (-1 if "ldm" in name else 1)
    written_back = re.search(r"\[sp, #(-?\d+)\]!$|\[sp\], #(-?\d+)$", operands)
    if written_back:
        return -int(written_back[1] or written_back[2])
    if not re.match(r"sp(,|$)", operands) or name.startswith(("stm", "ldm", "cmp")):
        return 0
    if _SP_MATH.match(name):
        last = operands.split(",")[-1].strip()
        number = _NUMBER.match(last)
        amount = int(number[1], 0) if number else _constant(image, function, index, last)
        return amount if name.startswith("sub") else -amount
    raise _unknown(function, instruction)


def _list_bytes(operands: str) -> int:
    total = 0
    for item in operands[operands.index("{") + 1 : operands.index("}")].split(","):
        first, _, last = item.strip().partition("-")
        count = int(last[1:]) - int(first[1:]) + 1 if last else 1
        total += count * (8 if first[0] == "d" else 4)
    return total


def _constant(image: Image, function: Function, index: int, register: str) -> int:
    """What a register holds that was loaded with a constant shortly before."""
    instruction = function.instructions[index]
    shift = 0
    for before in reversed(function.instructions[max(index - 8, 0) : index]):
        if not before.operands.startswith(f"{register}, "):
            continue
        number = _NUMBER.search(before.operands.split(", ")[-1])
        if before.mnemonic == "lsls" and before.operands.startswith(f"{register}, {register}, #"):
            shift += int(before.operands.rpartition("#")[2])
            continue
        if before.mnemonic.startswith("mov") and number:
            return int(number[1], 0) << shift
        target = re.match(r"\(([0-9a-f]+) <", before.note)
        if before.mnemonic.startswith("ldr") and target and int(target[1], 16) in image.literals:
            value = image.literals[int(target[1], 16)]
            return value - (1 << 32) if value >> 31 else value
        break
    raise _unknown(function, instruction)


# ---- RISC-V --------------------------------------------------------------------------------------


def _riscv(image: Image, function: Function, index: int) -> Effect:
    instruction = function.instructions[index]
    name, operands = instruction.mnemonic, instruction.operands
    if name in ("ret", "mret", "unimp"):
        return Effect(falls=False)
    found = _MILLICODE.search(f"{operands} {instruction.note}")
    if found and name in ("j", "jr"):
        return Effect(falls=False)  # gives all back and returns
    if found and name in ("jal", "jalr"):
        return Effect(16 if found[2] == "0" else 64)  # the larger ones take 64 and give some back
    if name in ("j", "jr"):
        target = _target(instruction)
        if target is None and name == "j":
            raise _unknown(function, instruction)
        pointed = target is None  # at a function, or from a table at another place of this one
        return Effect(falls=False, branch=target, indirect=pointed, jump=pointed)
    if name in ("jal", "jalr"):
        target = _target(instruction)
        return Effect(call=target, indirect=target is None)
    if name.startswith("b"):
        return Effect(branch=_target(instruction))
    if not operands.startswith("sp,"):
        return Effect()
    if name in ("add", "addi", "mv"):
        return Effect(-_riscv_amount(image, function, index))
    if name == "auipc" and function.name == "startup_reset":
        return Effect()  # where the stack begins
    raise _unknown(function, instruction)


def _riscv_amount(image: Image, function: Function, index: int) -> int:
    instruction = function.instructions[index]
    words = instruction.operands.split(",")
    if function.name == "startup_reset":
        return 0  # where the stack begins
    if len(words) != 3 or words[1] != "sp":
        raise _unknown(function, instruction)
    number = _NUMBER.match(words[2])
    return int(number[1], 0) if number else _riscv_constant(function, index, words[2])


def _riscv_constant(function: Function, index: int, register: str) -> int:
    total = 0
    for before in reversed(function.instructions[max(index - 8, 0) : index]):
        words = before.operands.split(",")
        if words[0] != register:
            continue
        if before.mnemonic == "addi" and words[1] == register:
            total += int(words[2], 0)
        elif before.mnemonic == "li":
            return total + int(words[1], 0)
        elif before.mnemonic == "lui":
            value = int(words[1], 0) << 12
            return total + (value - (1 << 32) if value >> 31 else value)
        else:
            break
    raise _unknown(function, function.instructions[index])
