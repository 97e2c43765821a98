# SPDX-License-Identifier: MIT
"""The checker of EDS files: passes ours, and finds each fault that is put into one. Run by pytest; writes to temporary
folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from eds import check as check_eds

ROOT = Path(__file__).resolve().parents[2]
CONTROLLER = ROOT / "firmware" / "app" / "controller.eds"
DRIVE = ROOT / "sim" / "node" / "drive.eds"


@pytest.mark.parametrize("path", [CONTROLLER, DRIVE], ids=lambda path: path.stem)
def test_ours_pass(path: Path) -> None:
    assert check_eds.check(path) == []


def broken(folder: Path, old: str, new: str) -> list[str]:
    """Faults of the drive's EDS with the first `old` replaced by `new`."""
    text = DRIVE.read_text()
    assert old in text
    path = folder / "drive.eds"
    path.write_text(text.replace(old, new, 1))
    return check_eds.check(path)


STATUSWORD = "[6041]\nParameterName=Statusword\nObjectType=0x7\nDataType=0x0006\n"
CYCLE = "[1006]\nParameterName=Communication cycle period\n"

FAULTS = [
    ("EDSVersion=4.0", "EDSVersion=5.1", "EDSVersion=5.1"),
    ("CreationDate=11-21-2026", "CreationDate=2026-11-21", "CreationDate"),
    ("FileName=drive.eds", "FileName=other.eds", "FileName"),
    ("BaudRate_500=0\n", "", "has no BaudRate_500"),
    ("LSS_Supported=0", "LSS_Supported=0\nColour=red", "Colour is no key"),
    ("NrOfTXPDO=", "NrOfTXPDO=1", "NrOfTXPDO"),
    ("ProductNumber=2", "ProductNumber=3", "ProductNumber=3 is not what 0x1018"),
    ("Dummy0003=0\n", "", "has no Dummy0003"),
    ("[Comments]\nLines=", "[Comments]\nLines=1", "Lines counts"),
    ("[MandatoryObjects]\nSupportedObjects=3", "[MandatoryObjects]\nSupportedObjects=2", "1 to 2"),
    ("3=0x1018\n", "3=0x1005\n", "0x1005 belongs in OptionalObjects"),
    ("[2100]\n", "[21ZZ]\n", "[21ZZ] is no section"),
    ("[2100]\n", "[2107]\n", "[2100] is listed but missing"),
    ("[1001]\n", "[1002]\n", "is listed but missing"),
    (CYCLE, "[1006]\nParameterName=Device type\n", "that of another object"),
    ("ParameterName=Vendor-ID", "ParameterName=Product code", "two sub-indices 'Product code'"),
    (STATUSWORD, STATUSWORD + "DataTyp=1\n", "DataTyp is no key"),
    (STATUSWORD, STATUSWORD.replace("0x0006", "0x0005"), "the standard has 0x0006"),
    (STATUSWORD, STATUSWORD.replace("0x0006", "6"), "not of the form 0x0000"),
    (STATUSWORD, STATUSWORD.replace("0x0006", "0x0008"), "DataType=0x0008 is not supported"),
    (STATUSWORD + "AccessType=ro", STATUSWORD + "AccessType=r", "AccessType=r is none of"),
    (STATUSWORD + "AccessType=ro", STATUSWORD + "AccessType=RO", "AccessType=RO is none of"),
    (STATUSWORD + "AccessType=ro\nDefaultValue=0\nPDOMapping=1",
     STATUSWORD + "AccessType=ro\nDefaultValue=0\nPDOMapping=0", "0x6041 sub 0, which is not mappable"),
    ("DefaultValue=0x60410010", "DefaultValue=0x60410020", "maps 32 bits of 0x6041"),
    ("DefaultValue=0x60410010", "DefaultValue=0x61410010", "0x6141 sub 0, which does not exist"),
    ("DefaultValue=0x60410010", "DefaultValue=0x60410040", "maps 96 bits"),
    ("DefaultValue=$NODEID+0x180", "DefaultValue=$NODEID+0x580", "CiA 301 reserves"),
    ("DefaultValue=$NODEID+0x180", "DefaultValue=$NODEID+0x280", "COB-ID of"),
    ("DefaultValue=$NODEID+0x180", "DefaultValue=0x180+$NODE", "is not an integer"),
    ("DefaultValue=$NODEID+0x180", "DefaultValue=0x180 + $NODEID", "is not of the form $NODEID"),
    ("DefaultValue=$NODEID+0x180", "DefaultValue=$NODEID+0x20000180", "29-bit"),
    ("DefaultValue=$NODEID+0x80", "DefaultValue=0x80", "[1014] DefaultValue is not $NODEID+0x80"),
    ("DefaultValue=0x60410010\n", "", "[1A00sub1] has no DefaultValue"),
    ("DefaultValue=$NODEID+0x180", "DefaultValue=$nodeid+0x180", "is not of the form $NODEID"),
    ("HighLimit=240", "HighLimit=239", "above HighLimit"),
    ("LowLimit=0\nHighLimit=240", "LowLimit=241\nHighLimit=240", "LowLimit is above"),
    ("[1018]\nParameterName=Identity object\nObjectType=0x9\nSubNumber=5",
     "[1018]\nParameterName=Identity object\nObjectType=0x9\nSubNumber=4", "SubNumber=4, but"),
    ("[1018]\nParameterName=Identity object\nObjectType=0x9",
     "[1018]\nParameterName=Identity object\nObjectType=0x8", "is a ARRAY, the standard has a RECORD"),
    ("[1018sub0]\nParameterName=Highest sub-index\nObjectType=0x7\nDataType=0x0005\nAccessType=const\nDefaultValue=4",
     "[1018sub0]\nParameterName=Highest sub-index\nObjectType=0x7\nDataType=0x0005\nAccessType=const\nDefaultValue=5",
     "the highest sub-index is 4"),
    ("[6502]", "[6501]", "[6501] is in no list"),
    ("[1006]\n", "[1006]\n[1006]\n", "already exists"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "part"), FAULTS)
def test_a_fault_is_found(tmp_path: Path, old: str, new: str, part: str) -> None:
    found = broken(tmp_path, old, new)
    assert any(part in fault for fault in found), found


def test_transmission_types_that_are_reserved(tmp_path: Path) -> None:
    text = DRIVE.read_text()
    start = text.index("[1800sub2]")
    path = tmp_path / "drive.eds"
    for kind, good in (
        (0, True),
        (240, True),
        (241, False),
        (251, False),
        (252, True),
        (255, True),
    ):
        head, tail = text[:start], text[start:]
        path.write_text(head + tail.replace("DefaultValue=1\n", f"DefaultValue={kind}\n", 1))
        found = check_eds.check(path)
        assert bool(found) is not good, (kind, found)


def test_status_and_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert check_eds.main([str(CONTROLLER), str(DRIVE)]) == 0
    assert capsys.readouterr().out == ""
    path = tmp_path / "drive.eds"
    path.write_text(DRIVE.read_text().replace("EDSVersion=4.0", "EDSVersion=1"))
    assert check_eds.main([str(path)]) == 1
    assert capsys.readouterr().out.startswith(f"{path}: [FileInfo] EDSVersion=1")
    assert check_eds.main([str(tmp_path / "none.eds")]) == 2
    assert "cannot be read" in capsys.readouterr().err
    assert check_eds.main([]) == 2
