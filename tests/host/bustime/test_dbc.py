# SPDX-License-Identifier: MIT
"""The DBC of the examples, as cantools reads it. Run by pytest; writes to temporary folders."""

from __future__ import annotations

import re
import struct
from pathlib import Path

import cantools
import pytest

from hodograph.cli.main import main
from hodograph.config import load_machine
from hodograph.data import DRIVE_EDS
from hodograph.dbc import dbc_text
from hodograph.errors import InputError

MACHINES = Path(__file__).resolve().parents[3] / "examples" / "machines"
MACHINE = MACHINES / "paper_alpha.toml"


def database(machine: Path = MACHINE) -> cantools.database.Database:
    return cantools.database.load_string(dbc_text(load_machine(machine)), "dbc", strict=True)


def test_frames_and_their_sizes() -> None:
    sizes = {message.frame_id: message.length for message in database().messages}
    expected = {0x000: 2, 0x080: 1, 0x701: 1, 0x081: 8}
    for node in (2, 3):
        expected |= {0x80 + node: 8, 0x180 + node: 6, 0x200 + node: 6}
        expected |= {0x280 + node: 2, 0x380 + node: 4, 0x700 + node: 1}
    assert sizes == expected


def test_real_drives_with_feedforward() -> None:
    found = database(MACHINES / "real_drives.toml")
    sizes = {message.frame_id: message.length for message in found.messages}
    assert [sizes[0x200 + n] for n in (2, 3, 4)] == [8, 8, 8]
    assert [sizes[0x300 + n] for n in (2, 3, 4)] == [4, 4, 4]
    assert 0x282 not in sizes
    setpoint = found.decode_message(0x202, struct.pack("<Hih", 0x0F, 2_500_000, -125))
    assert setpoint["Drive2_TargetPosition"] == pytest.approx(2.5)
    assert setpoint["Drive2_TorqueOffset"] == pytest.approx(-12.5)
    velocity = found.decode_message(0x303, struct.pack("<i", 100_000_000))
    assert velocity == {"Drive3_VelocityOffset": pytest.approx(100.0)}
    assert found.get_message_by_name("Drive2_RPDO2").cycle_time == 2


def test_inputs_by_name() -> None:
    inputs = database().decode_message(0x382, struct.pack("<I", 0b101 | 1 << 31))
    assert inputs == {
        "Drive2_NegativeLimit": 1,
        "Drive2_PositiveLimit": 0,
        "Drive2_HomeSwitch": 1,
        "Drive2_OtherInputs": 1 << 28,
    }
    assert database().get_message_by_name("Drive2_TPDO3").cycle_time is None


def test_values_and_units() -> None:
    found = database().decode_message(0x183, struct.pack("<Hi", 0x1237, -1_234_567))
    assert found["Drive3_Statusword"] == 0x1237
    assert found["Drive3_PositionActualValue"] == pytest.approx(-1.234567)
    assert database().decode_message(0x282, struct.pack("<h", -2500)) == {
        "Drive2_MotorVoltage": pytest.approx(-2.5)
    }
    assert str(database().decode_message(0x702, b"\x05")["Drive2_NMT_State"]) == "operational"
    assert database().get_message_by_name("SYNC").cycle_time == 1


def test_command(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "alpha.dbc"
    assert main(["dbc", str(MACHINE), "-o", str(output)]) == 0
    assert "16 frames" in capsys.readouterr().out
    assert output.read_bytes().decode() == dbc_text(load_machine(MACHINE))


def test_something_else_than_an_eds(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    eds = tmp_path / "not.eds"
    eds.write_text("hello")
    assert main(["dbc", str(MACHINE), "-o", str(tmp_path / "x"), "--eds", str(eds)]) == 2
    assert "not an EDS" in capsys.readouterr().err


def drive_with(folder: Path, old: str, new: str) -> Path:
    text = DRIVE_EDS.read_text(encoding="utf-8")
    assert old in text
    eds = folder / "drive.eds"
    eds.write_text(text.replace(old, new), encoding="utf-8")
    return eds


def test_two_objects_of_one_name_are_refused(tmp_path: Path) -> None:
    eds = drive_with(tmp_path, "ParameterName=Target position", "ParameterName=Controlword")
    with pytest.raises(InputError, match=r"drive\.eds: its PDOs give no DBC: .*Drive2_Controlword"):
        dbc_text(load_machine(MACHINE), eds)


def test_a_name_longer_than_a_dbc_has_room_for(tmp_path: Path) -> None:
    name = "Target position in the coordinates of the machine"
    eds = drive_with(tmp_path, "ParameterName=Target position", f"ParameterName={name}")
    text = dbc_text(load_machine(MACHINE), eds)
    assert max(map(len, re.findall(r"^ SG_ (\w+) :", text, re.MULTILINE))) == 32
    found = cantools.database.load_string(text, "dbc", strict=True).get_message_by_name(
        "Drive2_RPDO1"
    )
    assert found.signals[1].name == "Drive2_TargetPositionInTheCoordinatesOfTheMachine"
