# SPDX-License-Identifier: MIT
"""A run of a prover is taken from its stamp while nothing has changed that it depends on, and only if it was good. Run
by pytest; starts compilers, and writes to temporary folders.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from analysis import prove
from analysis.prove import Proof, Prover, Run, Verdict
from testing.cache import Stamps

FILES = {
    "firmware/core/used.h": "#define A 1\n",
    "firmware/core/used.c": "int used(void) { return A; }\n",
    "firmware/core/of_cbmc.h": "\n",
    "firmware/core/unused.c": "int unused;\n",
    "firmware/core/mutated.c": "int m = 1;\n",
    "proofs/a.c": '#include "core/used.c"\n#ifndef __FRAMAC__\n#include "core/of_cbmc.h"\n#endif\n',
}
CHANGE = ("core/mutated.c", "m = 1", "m = 2")
Check = Callable[..., dict[str, object]]


@pytest.fixture
def runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the runs of a prover, which finds what a mutant plants and nothing else."""
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    done: list[str] = []

    def run(proof: Proof, firmware: Path, _bin: Path, _work: Path, bits: int) -> Verdict:
        done.append(f"{proof.name} {bits}")
        is_mutant = "m = 2" in (firmware / "core/mutated.c").read_text()
        return Verdict(proven=not is_mutant, doubt=is_mutant, why="", seconds=1.0)

    monkeypatch.setattr(prove, "ROOT", tmp_path)
    monkeypatch.setattr(prove, "PROOFS", tmp_path / "proofs")
    monkeypatch.setattr(prove, "run", run)
    return done


def check(root: Path, run: Run | None = None, provers: str = "1", *, used: bool = True) -> bool:
    """Whether it was taken from a stamp; it has to be good."""
    stamps = Stamps("proofs", used=used, base=root / "cache")
    entry = Prover(root / "build", stamps, provers).check(run or Run(proof(), 64))
    assert entry["good"]
    return bool(entry["stamp"])


def proof(**more: object) -> Proof:
    return Proof("a", "eva", mutants=[CHANGE], **more)  # type: ignore[arg-type]


def test_the_second_time_it_is_taken_from_the_stamp(runs: list[str], tmp_path: Path) -> None:
    assert [check(tmp_path) for _ in range(3)] == [False, True, True]
    assert runs == ["a 64"]


@pytest.mark.parametrize(
    ("file", "again"),
    [
        ("proofs/a.c", True),
        ("firmware/core/used.c", True),
        ("firmware/core/used.h", False),  # not included
        ("firmware/core/of_cbmc.h", True),
        ("firmware/core/unused.c", False),
    ],
)
def test_what_it_includes_counts(runs: list[str], tmp_path: Path, file: str, again: bool) -> None:
    check(tmp_path)
    before = (tmp_path / file).read_text()
    (tmp_path / file).write_text(before + "/* more */\n")
    assert check(tmp_path) is not again
    (tmp_path / file).write_text(before)
    assert check(tmp_path) is True


@pytest.mark.parametrize(
    "other",
    [
        Run(proof(), 32),
        Run(proof(options=["-x"]), 64),
        Run(proof(assumes=["f"]), 64),
        Run(proof(replaces=["f:g"]), 64),
        Run(proof(instead=[("core/used.c", "A", "2")]), 64),
        Run(proof(), 64, mutant=0),
    ],
    ids=["bits", "options", "assumes", "replaces", "instead", "mutant"],
)
def test_another_run_is_another(runs: list[str], tmp_path: Path, other: Run) -> None:
    check(tmp_path)
    assert check(tmp_path, other) is False
    assert check(tmp_path, other) is True


def test_a_mutant_depends_on_what_it_changes(runs: list[str], tmp_path: Path) -> None:
    mutant = Run(proof(), 64, mutant=0)
    check(tmp_path, mutant)
    file = tmp_path / "firmware/core/mutated.c"
    file.write_text(file.read_text() + "int more;\n")
    assert check(tmp_path, mutant) is False


def test_other_provers_prove_again(runs: list[str], tmp_path: Path) -> None:
    check(tmp_path)
    assert check(tmp_path, provers="2") is False


def test_stamps_that_are_off(runs: list[str], tmp_path: Path) -> None:
    check(tmp_path)
    assert check(tmp_path, used=False) is False
    assert runs == ["a 64", "a 64"]


def test_what_is_not_as_it_should_be_is_never_kept(
    runs: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(prove, "run", lambda *_: Verdict(False, False, "gave up", 1.0))
    for run in (Run(proof(), 64), Run(proof(), 64, mutant=0)):
        for _ in range(2):
            entry = Prover(
                tmp_path / "build", Stamps("proofs", base=tmp_path / "cache"), "1"
            ).check(run)
            assert not entry["good"]
            assert not entry["stamp"]


def test_a_damaged_stamp_is_proved_again(runs: list[str], tmp_path: Path) -> None:
    check(tmp_path)
    (stamp,) = (tmp_path / "cache/proofs").glob("*/*")
    stamp.write_text(stamp.read_text().replace('"proof": "a"', '"proof": "b"'))
    assert check(tmp_path) is False


def test_the_provers_digest_sees_each_file(tmp_path: Path) -> None:
    root = tmp_path / "provers/root"
    root.mkdir(parents=True)
    seen = {prove.provers_digest(tmp_path)}
    for name in ("cbmc", "libm.so", "libc.so.6", "share.h"):
        (root / name).write_text("1")
        seen.add(prove.provers_digest(tmp_path))
        (root / name).write_text("2")
        seen.add(prove.provers_digest(tmp_path))
    assert len(seen) == 9


def test_every_change_of_a_proof_is_found_in_its_file() -> None:
    proofs = [prove.read_proof(path) for path in sorted(prove.PROOFS.glob("*.c"))]

    stale = [
        line for proof in proofs for line in prove.stale_changes(proof, prove.ROOT / "firmware")
    ]

    assert len(proofs) > 20
    assert stale == []


def test_a_change_whose_text_is_gone_is_named(tmp_path: Path) -> None:
    (tmp_path / "core").mkdir()
    (tmp_path / "core/a.c").write_text("int a = 1;\n")
    proof = Proof(
        "p",
        mutants=[
            ("core/a.c", "a = 1", "a = 2"),
            ("core/a.c", "b = 1", ""),
            ("core/no.c", "x", "y"),
        ],
    )

    assert prove.stale_changes(proof, tmp_path) == [
        "p: core/a.c has no `b = 1` to change",
        "p: core/no.c has no `x` to change",
    ]
