# SPDX-License-Identifier: MIT
"""The counter of instructions agrees with the clock of the core that is counted; the counts are the committed ones. Run
by pytest; starts emulators, and writes to temporary folders.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from hodograph.pipeline import load_pipeline
from hodograph.program import decode

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools"))

import count  # noqa: E402
from analysis import worst_case  # noqa: E402
from analysis.campaign import EXAMPLES, KINDS, SECTIONS, Campaign, compilers  # noqa: E402
from analysis.counting import Counter  # noqa: E402
from analysis.emulator import TARGETS, Target  # noqa: E402

BUILD = ROOT / "build"
INSTRUCTION_NS = 128  # -icount shift=7
ICOUNT = ("-icount", "shift=7,sleep=off")
MOST_OF_THE_CALL = 10  # instructions between two readings of the clock that are not the tick's


@pytest.mark.parametrize("image", ["setpoints", "isr"])
@pytest.mark.parametrize(
    ("target", "kernel"),
    [(target, kernel) for target in TARGETS.values() for kernel in target.kernels],
    ids=lambda which: which if isinstance(which, str) else which.name,
)
def test_the_clock_of_the_core_counts_the_same(
    target: Target, kernel: str, image: str, tmp_path: Path
) -> None:
    """The motion part (setpoints) and the whole interrupt, with both kernels."""
    programs = b"".join(worst_case.image(a) for a in worst_case.ADVERSARIES[:3])
    given = (kernel, programs, worst_case.restless(), ICOUNT)
    file = tmp_path / "times"
    if image == "setpoints":
        counts = Counter(BUILD, target).count(*given, times=file)
    else:
        counts = Counter(BUILD, target, image, image).count(*given, setpoints=file)
    times = np.fromfile(file, "<u4") * 1000.0 / target.clock_mhz / INSTRUCTION_NS
    assert len(times) == len(counts) > 100
    beside = times - counts.sum(axis=1)
    # a reading of the clock rounds to a cycle, which is less than half an instruction
    assert len(np.unique(np.round(beside))) == 1
    assert 0 < np.round(beside[0]) <= MOST_OF_THE_CALL


def test_the_counts_of_a_run_are_those_of_the_next() -> None:
    counter = Counter(BUILD, TARGETS["an386"])
    program = worst_case.image(worst_case.ADVERSARIES[2])
    first, second = (counter.count("float", program, worst_case.jitter()) for _ in range(2))
    assert np.array_equal(first, second)


def test_a_tick_does_one_thing_with_the_override() -> None:
    """docs/validation/wcet.md: a *begins* tick has no step of a ramp or of a search."""
    counter = Counter(BUILD, TARGETS["an386"], functions=True)
    programs = b"".join(worst_case.image(a) for a in worst_case.ADVERSARIES)
    counts = counter.count("float", programs, worst_case.restless())
    columns = [counter.names.index(KINDS[kind]) for kind in ("moves", "looks", "begins")]
    moves, looks, begins = (counts[:, columns] > 0).T
    assert all(kind.any() for kind in (moves, looks, begins))
    assert not (begins & (moves | looks)).any()


def test_interrupts_inside_do_not_count(tmp_path: Path) -> None:
    def counted(*interrupts: str) -> set[int]:
        counter = Counter(BUILD, TARGETS["an386"], "interrupted", interrupts=interrupts)
        counts = counter.count_words([str(tmp_path / "interrupts")], b"", ICOUNT)
        assert np.fromfile(tmp_path / "interrupts", "<u4")[0] > 50
        assert len(counts) == 100
        return set(counts.sum(axis=1).tolist())

    assert len(counted()) > 1
    assert len(counted("startup_systick")) == 1


def test_the_counts_of_one_core_are_the_committed_ones() -> None:
    """The others: the next test."""
    committed = json.loads(count.COMMITTED.read_text(encoding="utf-8"))
    reason = count.incomparable({"compilers": compilers()}, committed)
    if reason is not None:
        pytest.skip(reason)
    counted = Campaign(BUILD).pair(TARGETS["an386"], "float")
    assert counted == {section: committed[section]["an386 float"] for section in SECTIONS}


@pytest.mark.long
def test_the_counts_are_the_committed_ones() -> None:
    """Changed on purpose: `make count UPDATE=1`, and commit what it writes."""
    counted = count.everything(BUILD)
    committed = json.loads(count.COMMITTED.read_text(encoding="utf-8"))
    reason = count.incomparable(counted, committed)
    if reason is not None:
        pytest.skip(reason)
    assert count.differences(counted, committed) == []


def test_the_document_shows_the_committed_counts() -> None:
    committed = json.loads(count.COMMITTED.read_text(encoding="utf-8"))
    text = count.DOCUMENT.read_text(encoding="utf-8")
    assert count.document(committed, text) == text


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_images_that_are_counted_are_those_of_the_examples(name: str) -> None:
    compiled = load_pipeline(ROOT / f"examples/{name}.toml").program
    counted = decode(EXAMPLES[name].read_bytes())
    assert counted.ticks == compiled.ticks
    assert counted.segment_count == compiled.segment_count
    assert counted.piece_count == compiled.piece_count
    assert np.abs(counted.point_q40 - compiled.point_q40).max() < 2**10
