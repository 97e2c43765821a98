# SPDX-License-Identifier: MIT
"""hodograph init and schema: initial files that work without changes, and schemas for editors. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path

import pytest
from jsonschema import Draft7Validator

from commands import result
from hodograph.cli.main import main
from hodograph.config import load_drive, load_machine
from hodograph.data import TEMPLATE
from hodograph.schemas import NAMES, schema

FILES = ("drive", "machine", "path")


def uncommented(text: str) -> str:
    """A template with every key that is commented out."""
    return re.sub(r"^# (?=\w+ = |\[)", "", text, flags=re.MULTILINE)


def test_what_init_writes_runs(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["init", "new"]) == 0
    reported = capsys.readouterr().out.splitlines()
    written = sorted(str(file.relative_to(tmp_path)) for file in tmp_path.rglob("*.*"))
    assert reported == [*written, "next: hodograph simulate new/path.toml"]
    assert len(written) == 6
    motion = result(capsys, "simulate", "new/path.toml", "--json")
    assert motion["max_contour_error_um"] < 1
    assert result(capsys, "verify", "new/path.toml", "--json")["kept"]


def test_init_replaces_nothing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "drive.toml").write_text("mine")
    assert main(["init", str(tmp_path)]) == 2
    assert "there already, and nothing was written" in capsys.readouterr().err
    assert [file.name for file in tmp_path.iterdir()] == ["drive.toml"]
    assert (tmp_path / "drive.toml").read_text() == "mine"
    (tmp_path / "drive.toml").unlink()
    (tmp_path / "path.toml").symlink_to("nowhere")
    assert main(["init", str(tmp_path)]) == 2
    assert [file.name for file in tmp_path.iterdir()] == ["path.toml"]


def test_init_says_that_a_folder_cannot_be_made(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").touch()
    assert main(["init", str(tmp_path / "file")]) == 2
    assert "cannot be made" in capsys.readouterr().err


@pytest.mark.parametrize("name", FILES)
def test_files_name_their_schema(name: str, tmp_path: Path) -> None:
    assert main(["init", str(tmp_path)]) == 0
    text = (tmp_path / f"{name}.toml").read_text(encoding="utf-8")
    head = re.match(r"#:schema (\S+)\n", text)
    assert head is not None
    found = json.loads((tmp_path / head[1]).read_text(encoding="utf-8"))
    assert found == schema(name)
    assert Draft7Validator(found).is_valid(tomllib.loads(text))


def test_commented_keys_are_right(tmp_path: Path) -> None:
    for name in FILES:
        text = uncommented((TEMPLATE / f"{name}.toml").read_text(encoding="utf-8"))
        (tmp_path / f"{name}.toml").write_text(text, encoding="utf-8")
    load_drive(tmp_path / "drive.toml")
    machine = load_machine(tmp_path / "machine.toml")
    assert machine.axes[0].homing.method == 17
    assert machine.axes[0].identity.vendor == 0x29C
    path = tomllib.loads(
        re.sub(r"control_points.*", "", (tmp_path / "path.toml").read_text(encoding="utf-8"))
    )
    assert [error.message for error in Draft7Validator(schema("path")).iter_errors(path)] == []
    assert {"centripetal_mm_s2", "volts", "cap"} <= path["limits"].keys()


@pytest.mark.parametrize("key", ["bitrate", "node", "kernel", "reserve", "stop_time_ms"])
def test_commented_values_of_the_machine_are_the_defaults(key: str) -> None:
    text = uncommented((TEMPLATE / "machine.toml").read_text(encoding="utf-8"))
    table = tomllib.loads(text)["bus" if key == "bitrate" else "controller"]
    part = schema("machine")["properties"]["bus" if key == "bitrate" else "controller"]
    assert table[key] == part["properties"][key]["default"]


@pytest.mark.parametrize("name", NAMES)
def test_schemas_are_printed(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert result(capsys, "schema", name) == schema(name)


def test_schemas_are_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--output", str(tmp_path / "all")]) == 0
    assert {file.name for file in (tmp_path / "all").iterdir()} == {
        f"{name}.schema.json" for name in NAMES
    }
    assert main(["schema", "drive", "--output", str(tmp_path / "one")]) == 0
    assert [file.name for file in (tmp_path / "one").iterdir()] == ["drive.schema.json"]


@pytest.mark.parametrize("words", [["schema"], ["schema", "drives"]])
def test_unknown_schemas(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(words) == 2
    assert "path, machine, drive, campaign, scenario" in capsys.readouterr().err
