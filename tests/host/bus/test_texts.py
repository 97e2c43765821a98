# SPDX-License-Identifier: MIT
"""Diagnostics texts: the numbers are those of the firmware's headers, and each has a text. Run by pytest; starts and
writes nothing.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from hodograph.bus.diagnostics.boot_texts import boot_trouble
from hodograph.bus.diagnostics.drive_states import (
    DRIVE_STATES,
    inputs_on,
    state_of_number,
    state_of_statusword,
)
from hodograph.bus.diagnostics.fault_texts import detail_text, fault_words, known_code
from hodograph.bus.diagnostics.texts import REFUSALS, STATES

ROOT = Path(__file__).resolve().parents[3]
FIRMWARE = ROOT / "firmware"


def header(name: str) -> str:
    return (FIRMWARE / name).read_text()


def codes() -> dict[str, int]:
    found = {
        name: int(value, 16)
        for name, value in re.findall(
            r"#define (EMCY_[A-Z0-9_]+) +(0x[0-9A-F]{4})u", header("canopen/emcy.h")
        )
    }
    base = found["EMCY_MANUFACTURER"]
    for name, value in re.findall(
        r"#define (FAULT_[A-Z0-9_]+)[ \\\n]+\(EMCY_MANUFACTURER \| (0x[0-9A-F]+)u\)",
        header("app/machine/fault.h"),
    ):
        found[name] = base | int(value, 16)
    del found["EMCY_NO_ERROR"]
    return found


def test_the_headers_were_read() -> None:
    found = codes()
    assert len(found) > 20
    assert found["EMCY_HEARTBEAT"] == 0x8130
    assert found["FAULT_REBOOTED"] == 0xFF03


@pytest.mark.parametrize(("name", "code"), codes().items())
def test_every_code_has_text_and_remedy(name: str, code: int) -> None:
    assert known_code(code), f"{name} has no words in fault_texts.py"
    words = fault_words(code)
    for part in (words.text, words.remedy):
        assert len(part) > 5
        assert not part.endswith(".")
        assert part.isascii()


def test_the_page_about_faults_has_every_code() -> None:
    """The table of docs/guides/faults.md: codes in rising order, with the texts that `hodograph status` prints."""
    page = (ROOT / "docs" / "guides" / "faults.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| 0x([0-9A-F]{4}) \| (.*) \| (.*) \|$", page, re.MULTILINE)
    known = [code for code in range(0x10000) if known_code(code)]
    assert len(known) > 40
    words = [(f"{code:04X}", fault_words(code).text, fault_words(code).remedy) for code in known]
    assert rows == words


def test_codes_in_the_drives_have_words() -> None:
    """Codes that the simulated drives give by number."""
    texts = [file.read_text() for file in (ROOT / "sim" / "node").glob("*.c")]
    numbers = {int(n, 16) for text in texts for n in re.findall(r"0x([23478][0-9A-F]{3})u", text)}
    objects = {int(n, 16) for text in texts for n in re.findall(r"0x(2[0-9A-F]{3})", text)}
    for code in numbers - objects:
        assert "unknown" not in fault_words(code).text, f"0x{code:04X}"


def test_every_class_of_the_standard_has_words() -> None:
    for high in [*range(0x10, 0xA0), 0xF0, 0xFF]:
        words = fault_words(high << 8 | 0x7E)
        assert words.text
        assert words.remedy
        assert "unknown" not in words.text
    assert fault_words(0xABCD).text == "unknown error 0xABCD"


def test_states_are_those_of_the_firmware() -> None:
    found = {
        int(value): name.lower().replace("_", " ")
        for name, value in re.findall(
            r"^    MACHINE_(\w+) = (\d+),", header("app/machine/machine.h"), re.M
        )
        if name not in reasons()
    }
    assert found == STATES


def reasons() -> dict[str, int]:
    block = re.search(r"MACHINE_ACCEPTED = 0,(.*?)\};", header("app/machine/machine.h"), re.S)
    assert block is not None
    return {"ACCEPTED": 0} | {
        name: int(value) for name, value in re.findall(r"MACHINE_(\w+) = (\d+),", block[1])
    }


def test_every_refusal_has_words() -> None:
    assert set(REFUSALS) == set(reasons().values()) - {0}


def test_drive_states_are_those_of_the_firmware() -> None:
    block = re.search(r"enum cia402_state \{(.*?)\}", header("canopen/cia402.h"), re.S)
    assert block is not None
    names = [n.lower().replace("_", " ") for n in re.findall(r"CIA402_(\w+)", block[1])]
    assert len(names) == len(DRIVE_STATES)
    for name, state in zip(names, DRIVE_STATES, strict=True):
        assert state.startswith(name)
    assert state_of_number(0) == "not there"
    assert [state_of_number(i + 1) for i in range(8)] == list(DRIVE_STATES)
    assert state_of_number(99) == "unknown (99)"


@pytest.mark.parametrize(
    ("statusword", "state"),
    [
        (0x0000, "not ready to switch on"),
        (0x0250, "switch on disabled"),
        (0x0231, "ready to switch on"),
        (0x0233, "switched on"),
        (0x1237, "operation enabled"),
        (0x0217, "quick stop active"),
        (0x021F, "fault reaction active"),
        (0x0218, "fault"),
        (0x0020, "not ready to switch on"),
        (0x0026, "unknown (0x0026)"),
    ],
)
def test_statuswords(statusword: int, state: str) -> None:
    assert state_of_statusword(statusword) == state


def test_inputs_by_name() -> None:
    assert inputs_on(0) == ()
    assert inputs_on(5) == ("negative limit", "home switch")
    assert inputs_on(1 << 17 | 2) == ("positive limit", "input 1")


def test_details() -> None:
    assert detail_text(0xFF02, 0x0218) == "statusword 0x0218, fault"
    assert detail_text(0x8250, 3) == "3 positions missed in a row"
    assert detail_text(0x8250, 0) == "the drive received no setpoints for setpoint_timeout_ms"
    assert detail_text(0x6100, 7) == "detail 0x7"
    assert detail_text(0x8130, 0) == ""
    assert detail_text(0x8130, 4) == "it sends heartbeats, but its NMT state is stopped"
    assert detail_text(0x8130, 0x0218) == "statusword 0x0218, fault"


def test_boot_trouble_in_words() -> None:
    assert boot_trouble(0, 0, 0, 0) is None
    silent = boot_trouble(3, 0x100000, 0x05040000, 0)
    assert silent is not None
    assert silent.text.startswith("the drive at node 3 does not answer (requested: object 0x1000")
    assert "is it powered and connected, is its node number 3" in silent.remedy
    refused = boot_trouble(2, 0x60C201, 0x06090031, 0)
    assert refused is not None
    assert "node 2 refused object 0x60C2 sub 1 (interpolation period)" in refused.text
    assert "value of parameter written too high (0x06090031)" in refused.text
    assert "period" in refused.remedy
    wrong = boot_trouble(2, 0x100000, 0, 0x191)
    assert wrong is not None
    assert "has 0x191 in object 0x1000 sub 0 (device type)" in wrong.text
    mapping = boot_trouble(2, 0x160003, 0x06040041, 0)
    assert mapping is not None
    assert "mapping of the setpoint PDO 1" in mapping.text
    assert "switch feedforward off" in mapping.remedy


def test_every_object_that_boot_touches_has_words() -> None:
    rows = (FIRMWARE / "app" / "drives" / "drive_configuration.c").read_text()
    objects = {int(n, 16) for n in re.findall(r"ROW_\w+, 0x([0-9A-F]{4}),", rows)}
    assert len(objects) > 20
    for index in objects:
        found = boot_trouble(2, index << 8, 0x06020000, 0)
        assert found is not None
        assert "no name here" not in found.text, f"0x{index:04X}"


def test_every_abort_code_has_words() -> None:
    values = re.findall(r"UINT32_C\((0x[0-9A-F]{8})\)", header("canopen/sdo_abort.h"))
    assert len(values) > 20
    for value in values:
        found = boot_trouble(2, 0x607D01, int(value, 16), 0)
        assert found is not None
        assert "unknown" not in found.text.replace("unknown SDO command", "")
