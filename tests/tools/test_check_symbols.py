# SPDX-License-Identifier: MIT
"""Names that two libraries define are found; those of the hardware contract may be. Run by pytest; starts `gcc` and
`ar`, and writes to temporary folders.
"""

from __future__ import annotations

import subprocess
from pathlib import Path

import pytest

import check_symbols


def archive(folder: Path, name: str, *texts: str) -> Path:
    """An archive with an object of each text."""
    objects = []
    for k, text in enumerate(texts):
        source = folder / f"{name}_{k}.c"
        source.write_text(text)
        objects.append(str(source.with_suffix(".o")))
        subprocess.run(["gcc", "-c", "-o", objects[-1], str(source)], check=True)
    made = folder / f"lib{name}.a"
    subprocess.run(["ar", "rcs", str(made), *objects], check=True)
    return made


def test_each_name_is_named_with_its_places(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    one = archive(tmp_path, "one", "int limit; int only_here(void) { return limit; }")
    two = archive(tmp_path, "two", "int limit;", "int other(void) { return 1; }")
    assert check_symbols.main([str(one), str(two)]) == 1
    out = capsys.readouterr().out
    assert out == "limit: defined in libone.a(one_0.o) and libtwo.a(two_0.o)\n"


def test_twice_in_one_archive_counts_too(tmp_path: Path) -> None:
    one = archive(tmp_path, "one", "int limit;", "int limit;")
    assert len(check_symbols.breaches([one], frozenset())) == 1


def test_what_is_not_global_or_only_declared_or_weak_is_none(tmp_path: Path) -> None:
    text = "static int own; extern int shared; __attribute__((weak)) int spare; int *f(void) { return &own + shared; }"
    one = archive(tmp_path, "one", text)
    two = archive(tmp_path, "two", text.replace("*f(", "*g("))
    assert check_symbols.breaches([one, two], frozenset()) == []


def test_a_port_may_define_what_its_contract_declares(tmp_path: Path) -> None:
    text = "void port_lock(void) {}"
    one, two = archive(tmp_path, "one", text), archive(tmp_path, "two", text)
    assert len(check_symbols.breaches([one, two], frozenset())) == 1
    assert "port_lock" in check_symbols.contract()
    assert "machine_tick" not in check_symbols.contract()
    assert check_symbols.main([str(one), str(two)]) == 0


def test_no_archives() -> None:
    assert check_symbols.main([]) == 2
