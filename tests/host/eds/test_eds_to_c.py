# SPDX-License-Identifier: MIT
"""The generator of the C tables: its output, and its messages about a faulty EDS. Run by pytest; starts processes, and
writes to temporary folders.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "tools")}
TOOL = [sys.executable, "-m", "eds.to_c"]
EDS_FILES = {
    "controller": ROOT / "firmware" / "app" / "controller.eds",
    "drive": ROOT / "sim" / "node" / "drive.eds",
}

GOOD = """\
[MandatoryObjects]
SupportedObjects=1
1=0x1000

[OptionalObjects]
SupportedObjects=1
1=0x1014

[ManufacturerObjects]
SupportedObjects=3
1=0x2000
2=0x2001
3=0x2002

[1000]
ParameterName=Device type
ObjectType=0x7
DataType=0x0007
AccessType=const
DefaultValue=0x00020192
PDOMapping=0

[1014]
ParameterName=COB-ID EMCY
DataType=0x0007
AccessType=ro
DefaultValue=$NODEID+0x80

[2000]
ParameterName=Small number
ObjectType=0x7
DataType=0x0003
AccessType=rw
DefaultValue=-5
LowLimit=0xFFF6
HighLimit=10
PDOMapping=1

[2001]
ParameterName=Things
ObjectType=0x8
SubNumber=3

[2001sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=const
DefaultValue=2

[2001sub1]
ParameterName=First
DataType=0x0015
AccessType=rw
DefaultValue=-9223372036854775808

[2001sub2]
ParameterName=Second
DataType=0x0015
AccessType=rw
DefaultValue=7

[2002]
ParameterName=Mixed
ObjectType=0x9
SubNumber=3

[2002sub0]
ParameterName=Highest sub-index
DataType=0x0005
AccessType=const
DefaultValue=0xA

[2002sub1]
ParameterName=default
DataType=0x0009
AccessType=const
DefaultValue=abc

[2002subA]
ParameterName=Stream
DataType=0x000F
AccessType=rw
"""


def run(eds: Path, name: str, out: Path) -> subprocess.CompletedProcess[str]:
    return tool(str(eds), name, str(out))


def tool(*arguments: str) -> subprocess.CompletedProcess[str]:
    command = [*TOOL, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=ENVIRONMENT)


def generate(text: str, folder: Path) -> tuple[str, str]:
    eds = folder / "small.eds"
    eds.write_text(text)
    result = run(eds, "small", folder)
    assert result.returncode == 0, result.stderr
    return (folder / "od_small.h").read_text(), (folder / "od_small.c").read_text()


def complaint(text: str, folder: Path) -> str:
    eds = folder / "bad.eds"
    eds.write_text(text)
    result = run(eds, "bad", folder / "out")
    assert result.returncode == 2
    assert result.stdout == ""
    assert not (folder / "out").exists()
    lines = result.stderr.splitlines()
    assert len(lines) == 1, result.stderr
    return lines[0]


def test_fields_defaults_and_macros(tmp_path: Path) -> None:
    header, source = generate(GOOD, tmp_path)
    assert "    int16_t small_number;" in header
    assert "    int64_t things[2];" in header
    assert "        char default_[4];" in header
    assert "stream" not in header.replace("MIXED_STREAM", "")
    assert "#define OD_SMALL_MIXED_STREAM 10u" in header
    assert ".things[0] = (INT64_C(-9223372036854775807) - 1)," in source
    assert "{INT64_C(-10), INT64_C(10), 0x2000, 0x00}," in source
    assert "values->cob_id_emcy = UINT32_C(128) + node;" in source
    assert "0x2002, 0, 0x0A, OD_DOMAIN, OD_READ | OD_WRITE}" in source


def test_order_of_sections_does_not_matter(tmp_path: Path) -> None:
    head, *sections = GOOD.split("\n[")
    shuffled = head + "".join("\n[" + section.rstrip("\n") + "\n" for section in reversed(sections))
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert generate(GOOD, tmp_path / "a") == generate(shuffled, tmp_path / "b")


FAULTS = {
    "not an INI file": (GOOD, "no section at all", "no section"),
    "section twice": ("[1000]\n", "[1000]\nParameterName=x\n[1000]\n", "already exists"),
    "no name": ("ParameterName=Device type\n", "", "[1000] has no ParameterName"),
    "no type": ("DataType=0x0003\n", "", "[2000] has no DataType"),
    "unknown type": ("DataType=0x0003", "DataType=0x0018", "[2000] DataType=0x0018 is not"),
    "bad access": ("AccessType=rw\nDefaultValue=-5", "AccessType=rx\nDefaultValue=-5", "rx"),
    "default too wide": ("DefaultValue=-5", "DefaultValue=-32769", "does not fit INTEGER16"),
    "default no number": ("DefaultValue=-5", "DefaultValue=five", "is not an integer"),
    "default above limit": ("DefaultValue=-5", "DefaultValue=11", "above HighLimit"),
    "default below limit": ("DefaultValue=-5", "DefaultValue=-11", "below LowLimit"),
    "limits crossed": ("HighLimit=10", "HighLimit=-20", "LowLimit is above HighLimit"),
    "listed but missing": ("3=0x2002", "3=0x2003", "[2002] is in no list"),
    "count of subs": ("SubNumber=3\n\n[2001", "SubNumber=4\n\n[2001", "SubNumber=4, but"),
    "gap in an array": ("[2001sub2]", "[2001sub3]", "gaps"),
    "array of two types": (
        "ParameterName=Second\nDataType=0x0015",
        "ParameterName=Second\nDataType=0x0004",
        "several data types",
    ),
    "orphan": ("[2001sub2]", "[2009sub2]", "[2009sub2] belongs to no object"),
    "same name twice": ("ParameterName=Things", "ParameterName=Small number", "is taken"),
    "object type": ("ObjectType=0x9", "ObjectType=0x6", "ObjectType=0x6 is not supported"),
}


@pytest.mark.parametrize("fault", sorted(FAULTS))
def test_faults_get_one_clear_line(fault: str, tmp_path: Path) -> None:
    old, new, expected = FAULTS[fault]
    assert GOOD.count(old) >= 1
    text = GOOD.replace(old, new, 1)
    assert expected in complaint(text, tmp_path)


def test_missing_file(tmp_path: Path) -> None:
    result = run(tmp_path / "none.eds", "none", tmp_path)
    assert result.returncode == 2
    assert "none.eds" in result.stderr


def test_usage(tmp_path: Path) -> None:
    result = tool()
    assert result.returncode == 2
    assert "usage" in result.stderr


@pytest.mark.parametrize("name", sorted(EDS_FILES))
def test_same_input_same_output(name: str, tmp_path: Path) -> None:
    texts = []
    for folder in (tmp_path / "a", tmp_path / "b"):
        result = run(EDS_FILES[name], name, folder)
        assert result.returncode == 0, result.stderr
        texts.append([(folder / f"od_{name}.{end}").read_bytes() for end in "hc"])
    assert texts[0] == texts[1]
    assert str(tmp_path).encode() not in texts[0][0]
