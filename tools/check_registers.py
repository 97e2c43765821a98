#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""check_registers.py [BUILD]: the constants of firmware/port/stm32g4/reg_*.h against crate stm32-metapac.

Run by tests/tools/test_check_registers.py and by hand. Reads the headers and the linker script; cargo fetches the crate
once.

Compared are addresses, offsets, fields, values of fields, numbers of interrupts and of alternate functions, and the
memories of the linker script. A constant that the crate does not have must be in NOT_THERE, with its source.
Prints each difference; exit status 1 then, or when the crate cannot be had.

The headers are compared with the crate, not generated from it: a build of the firmware then needs neither cargo nor a
network, and a reader finds each constant where the port uses it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from register_facts import Facts, FactsError, fetch

ROOT = Path(__file__).resolve().parent.parent
PORT = Path("firmware/port/stm32g4")
SCRIPT = Path("firmware/targets/nucleo_g474re.ld")

# Prefix of our names, the peripheral that stands for it.
PERIPHERALS = {
    "FDCANRAM": "FDCANRAM1",
    "FDCAN": "FDCAN1",
    "FLASH": "FLASH",
    "RCC": "RCC",
    "PWR": "PWR",
    "IWDG": "IWDG",
    "GPIO": "GPIOA",
    "TIM": "TIM2",
    "LPUART": "LPUART1",
}
USED = ("FDCAN1", "GPIOA", "TIM2", "TIM5", "LPUART1", "PWR")

# Where the crate makes one entry of several registers or fields: our name, its name and the index.
SERIES = {
    "RXF0S": ("rxfs", 0),
    "RXF0A": ("rxfa", 0),
    "F0FL": ("ffl", 0),
    "F0GI": ("fgi", 0),
    "RF0N": ("rfn", 0),
    "RF0L": ("rfl", 0),
    "RF0NE": ("rfne", 0),
    "RF0LE": ("rfle", 0),
    "AFRL": ("afr", 0),
    "AFRH": ("afr", 1),
    "CCR1": ("ccr", 0),
    "CC1IE": ("ccie", 0),
    "CC1IF": ("ccif", 0),
    "CC1G": ("ccg", 0),
    "IWDGRSTF": ("iwdgrstf", 0),
}

# Values of fields: our name, and the variant of the field's enumeration.
VALUES = {
    "RCC_CFGR_SW_PLL": "PLL1_R",
    "RCC_CFGR_HPRE_DIV1": "DIV1",
    "RCC_CFGR_HPRE_DIV2": "DIV2",
    "RCC_PLLCFGR_PLLSRC_HSE": "HSE",
    "RCC_PLLCFGR_PLLM_DIV6": "DIV6",
    "RCC_PLLCFGR_PLLN_MUL85": "MUL85",
    "RCC_PLLCFGR_PLLR_DIV2": "DIV2",
    "RCC_CCIPR_LPUART1SEL_HSI": "HSI",
    "RCC_CCIPR_FDCANSEL_HSE": "HSE",
    "GPIO_MODER_ALTERNATE": "ALTERNATE",
    "GPIO_OSPEEDR_HIGH": "HIGH_SPEED",
    "GPIO_PUPDR_UP": "PULL_UP",
    "IWDG_KEY_FEED": "RESET",
    "IWDG_KEY_UNLOCK": "ENABLE",
    "IWDG_KEY_START": "START",
}
VALUE_FIELDS = {
    "GPIO_MODER": ("moder", "moder"),
    "GPIO_OSPEEDR": ("ospeedr", "ospeedr"),
    "GPIO_PUPDR": ("pupdr", "pupdr"),
    "IWDG_KEY": ("kr", "key"),
}

# Not in the crate. The models of tests/unit have them from the reference manual, independently of the port.
NOT_THERE = re.compile(r"FLASH_KEY[12]|FDCAN_(ELEMENT[01]_|FILTER_|SFT_|SFEC_|REJECT).*")

_DEFINE = re.compile(r"^#define (\w+)[ \t]+(\S[^/\n]*)", re.MULTILINE)
_EXPRESSION = re.compile(r"[\w\s(),]+")


def constants(folder: Path) -> dict[str, int]:
    """Every constant of the headers reg_*.h."""
    names: dict[str, Any] = {
        "BIT": lambda position: 1 << position,
        "BITS": lambda position, count: ((1 << count) - 1) << position,
    }
    found = {}
    for header in sorted(folder.glob("reg_*.h")):
        for name, text in _DEFINE.findall(header.read_text(encoding="utf-8")):
            plain = re.sub(r"\b(0x[\dA-Fa-f]+|\d+)u\b", r"\1", text.strip())
            if not _EXPRESSION.fullmatch(plain):
                raise ValueError(f"{header}: {name} is not a plain constant")
            found[name] = int(eval(plain, {"__builtins__": {}}, names))
    return found


def memory_facts(facts: Facts) -> dict[str, int]:
    """Constants that describe memories."""
    bank = facts.memory["BANK_2"]
    ram = {i["name"]: i for i in facts.registers("FDCANRAM1")["block"]["items"]}
    length = {name: item["array"][1]["len"] * 4 for name, item in ram.items()}
    elements = 3
    return {
        "FLASH_BANK_2": bank["address"],
        "FLASH_BANK_BYTES": bank["size"],
        "FLASH_PAGE_BYTES": bank["settings"]["erase_size"],
        "FLASH_WRITE_BYTES": bank["settings"]["write_size"],
        "FDCANRAM_SIZE": ram["txbuf"]["byte_offset"] + length["txbuf"],
        "FDCAN_FILTERS": length["flssa"] // 4,
        "FDCAN_FIFO_ELEMENTS": elements,
        "FDCAN_ELEMENT_SIZE": length["rxfifo0"] // elements,
    }


def expected(facts: Facts, name: str) -> int | None:
    """The crate's value of a constant; None: it does not have it."""
    if (base := re.fullmatch(r"(\w+)_BASE", name)) is not None:
        address: int = facts.peripherals[base[1]]["address"]
        return address
    if name.startswith("IRQ_"):
        return facts.interrupts.get(name.removeprefix("IRQ_"))
    if (pin := re.fullmatch(r"PIN_(P[A-G]\d+)_(\w+)_([A-Z]+)", name)) is not None:
        return facts.pin_function(*pin.groups())
    if name in (memory := memory_facts(facts)):
        return memory[name]
    return _of_register(facts, name)


def _of_register(facts: Facts, name: str) -> int | None:
    prefix = next((p for p in PERIPHERALS if name.startswith(p + "_")), None)
    if prefix is None:
        return None
    tables = facts.registers(PERIPHERALS[prefix])
    if name in VALUES:
        return _value(tables, name)
    for item in tables["block"]["items"]:
        for own, offset in _members(item):
            if name == f"{prefix}_{own}":
                return offset
            if name.startswith(f"{prefix}_{own}_"):
                mask = _mask(tables, item, name.removeprefix(f"{prefix}_{own}_"))
                if mask is not None:
                    return mask
    return None


def _members(item: dict[str, Any]) -> Iterator[tuple[str, int]]:
    """Our names of a register or series of them, and their offsets."""
    yield item["name"].upper(), item["byte_offset"]
    for own, (name, index) in SERIES.items():
        if name == item["name"]:
            yield own, item["byte_offset"] + _step(item["array"], index)


def _step(array: tuple[str, dict[str, Any]] | None, index: int) -> int:
    if array is None or index == 0:
        return 0
    kind, steps = array
    return int(steps["offsets"][index] if kind == "Cursed" else steps["stride"] * index)


def _field(tables: dict[str, Any], item: dict[str, Any], name: str) -> dict[str, Any] | None:
    fieldset = item["inner"][1]["fieldset"]
    plain = (fieldset or "").replace("_", "").lower()
    fields = [
        field
        for entry in tables["fieldsets"]
        if entry["name"].replace("_", "").lower() == plain
        for field in entry["fields"]
        if field["name"] == name
    ]
    return fields[0] if fields else None


def _mask(tables: dict[str, Any], item: dict[str, Any], own: str) -> int | None:
    name, index = SERIES.get(own, (own.lower(), 0))
    field = _field(tables, item, name)
    if field is None or field["bit_offset"][0] != "Regular":
        return None
    position = field["bit_offset"][1]["offset"] + _step(field["array"], index)
    return int(((1 << field["bit_size"]) - 1) << position)


def _value(tables: dict[str, Any], name: str) -> int | None:
    prefix, _, _ = name.rpartition("_")
    register, field_name = VALUE_FIELDS.get(prefix) or prefix.lower().split("_")[1:]
    (item,) = (i for i in tables["block"]["items"] if i["name"] == register)
    field = _field(tables, item, field_name)
    kinds = [e for e in tables["enums"] if field and e["name"] == field["enumm"]]
    values = [v["value"] for e in kinds for v in e["variants"] if v["name"] == VALUES[name]]
    return values[0] if values else None


def compare(facts: Facts, ours: dict[str, int]) -> Iterator[str]:
    """One line for each constant that is wrong or unknown, and for each clock switch that is missing."""
    for name, value in ours.items():
        if NOT_THERE.fullmatch(name):
            continue
        fact = expected(facts, name)
        if fact is None:
            yield f"{name}: the crate does not know it (see NOT_THERE)"
        elif fact != value:
            yield f"{name} is {value:#x} here and {fact:#x} in the crate"
    for peripheral in USED:
        enable = facts.peripherals[peripheral]["rcc"]["enable"]
        if f"RCC_{enable['register']}_{enable['field']}" not in ours:
            yield f"{peripheral} is switched on by {enable['register']}.{enable['field']}"


def compare_script(facts: Facts, text: str) -> Iterator[str]:
    """The linker script's memories."""
    region = facts.memory
    ram = sorted(
        (region[name] for name in ("SRAM1", "SRAM2", "CCMRAM_DCODE")), key=lambda r: r["address"]
    )
    size = sum(r["size"] for r in ram)
    if ram[-1]["address"] + ram[-1]["size"] != ram[0]["address"] + size:
        yield "the chip's RAM is not in one piece"
    facts_of = {
        "CODE": (region["BANK_1"]["address"], region["BANK_1"]["size"]),
        "STORE": (region["BANK_2"]["address"], region["BANK_2"]["size"]),
        "RAM": (ram[0]["address"], size),
    }
    found = re.findall(r"^\s*(\w+) \(\w+\)\s*: ORIGIN = (\w+), LENGTH = (\d+)K", text, re.MULTILINE)
    ours = {name: (int(origin, 0), int(kilo) * 1024) for name, origin, kilo in found}
    for name, fact in facts_of.items():
        if ours.get(name) != fact:
            yield f"{SCRIPT.name}: {name} is {ours.get(name)} and should be {fact}"


def main(arguments: list[str]) -> int:
    """Exit status."""
    build = Path(arguments[0]) if arguments else ROOT / "build"
    try:
        facts = Facts(fetch(build / "metapac"))
    except FactsError as error:
        print(f"check_registers: {error}", file=sys.stderr)
        return 1
    ours = constants(ROOT / PORT)
    text = (ROOT / SCRIPT).read_text(encoding="utf-8")
    differences = [*compare(facts, ours), *compare_script(facts, text)]
    for line in differences:
        print(line)
    if not differences:
        named = sum(1 for name in ours if not NOT_THERE.fullmatch(name))
        print(
            f"registers: {named} constants agree with stm32-metapac, {len(ours) - named} not there"
        )
    return 1 if differences else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
