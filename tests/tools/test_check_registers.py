# SPDX-License-Identifier: MIT
"""The register constants of the NUCLEO-G474RE port are those of crate stm32-metapac, and any other would be found. Run
by pytest; starts `cargo` if its crate is not in the cache, and writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import check_registers
import register_facts

ROOT = Path(__file__).resolve().parents[2]
CACHE = ROOT / "build" / "metapac"
OURS = check_registers.constants(ROOT / check_registers.PORT)
SCRIPT = (ROOT / check_registers.SCRIPT).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def facts() -> register_facts.Facts:
    return register_facts.Facts(register_facts.fetch(CACHE))


def test_ours_agree(capsys: pytest.CaptureFixture[str]) -> None:
    assert check_registers.main([]) == 0
    assert "constants agree" in capsys.readouterr().out


def test_every_wrong_constant_is_found(facts: register_facts.Facts) -> None:
    known = {name: v for name, v in OURS.items() if not check_registers.NOT_THERE.fullmatch(name)}
    assert len(known) > 150
    wrong = {name: value + 1 for name, value in known.items()}
    assert {line.split(" ")[0] for line in check_registers.compare(facts, wrong)} == set(known)


def test_what_the_crate_does_not_know_is_named(facts: register_facts.Facts) -> None:
    lines = list(check_registers.compare(facts, {**OURS, "FDCAN_CCCR_STOP": 1, "RCC_XYZ": 2}))
    assert [line.split(":")[0] for line in lines] == ["FDCAN_CCCR_STOP", "RCC_XYZ"]


def test_a_clock_switch_that_is_missing_is_named(facts: register_facts.Facts) -> None:
    ours = {name: value for name, value in OURS.items() if name != "RCC_APB1ENR1_FDCANEN"}
    assert list(check_registers.compare(facts, ours)) == [
        "FDCAN1 is switched on by APB1ENR1.FDCANEN"
    ]


@pytest.mark.parametrize("part", ["0x08000000", "0x08040000", "0x20000000", "= 128K"])
def test_a_wrong_memory_is_found(facts: register_facts.Facts, part: str) -> None:
    assert list(check_registers.compare_script(facts, SCRIPT)) == []
    wrong = SCRIPT.replace(part, "0x10000000" if "x" in part else "= 96K")
    assert len(list(check_registers.compare_script(facts, wrong))) == 1


def test_an_altered_crate_is_refused(tmp_path: Path) -> None:
    (tmp_path / f"{register_facts.NAME}.crate").write_bytes(b"something else")
    with pytest.raises(register_facts.FactsError, match=r"SHA-256 .* remove it"):
        register_facts.fetch(tmp_path)


def test_without_a_network_it_says_what_to_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cargo = tmp_path / "bin" / "cargo"
    cargo.parent.mkdir()
    cargo.write_text("#!/bin/sh\necho 'error: no network' >&2\nexit 101\n")
    cargo.chmod(0o755)
    monkeypatch.setenv("PATH", str(cargo.parent))
    with pytest.raises(
        register_facts.FactsError, match=r"cannot fetch .*: error: no network; with"
    ):
        register_facts.fetch(tmp_path)


def test_without_cargo_it_says_what_to_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(register_facts.FactsError, match=r"cannot fetch .*'cargo'; with cargo and"):
        register_facts.fetch(tmp_path)


def test_a_crate_that_cargo_does_not_keep(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cargo = tmp_path / "bin" / "cargo"
    cargo.parent.mkdir()
    cargo.write_text("#!/bin/sh\n")
    cargo.chmod(0o755)
    monkeypatch.setenv("PATH", str(cargo.parent))
    monkeypatch.setenv("CARGO_HOME", str(tmp_path / "home"))
    with pytest.raises(register_facts.FactsError, match=r"no such file in .*registry/cache"):
        register_facts.fetch(tmp_path)
