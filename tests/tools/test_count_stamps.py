# SPDX-License-Identifier: MIT
"""A core is not counted again as long as its images, the programs and the tools are the same. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pytest

from analysis import campaign
from analysis.campaign import Campaign
from analysis.emulator import TARGETS, Target
from testing.cache import Stamps

FIGURES = {"motion": {"plain": {"whole": [1, 2, 3]}}}


@pytest.fixture
def build(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Images, and a tree of tools."""
    for target in ("an386", "an385"):
        for image in ("setpoints", "isr"):
            write(tmp_path / f"firmware/{target}/{image}.elf")
    write(tmp_path / "target/count_plugin.so")
    write(tmp_path / "tools/analysis/parts.py")
    monkeypatch.setattr(campaign, "ROOT", tmp_path)
    monkeypatch.setattr(Campaign, "checksums", lambda _: {"alpha": "1"})
    monkeypatch.setattr(campaign, "_first_line", lambda command: f"{command[0]} 1.0")
    return tmp_path


def write(path: Path, text: str = "1") -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def count(
    build: Path,
    targets: Sequence[Target] = (TARGETS["an386"],),
    kernel: str = "float",
    *,
    used: bool = True,
) -> bool:
    """Whether it was counted."""
    counting = Campaign(build, Stamps("counts", used=used, base=build / "cache"))
    assert counting.stamped(kernel, targets, ("setpoints", "isr"), lambda: FIGURES) == FIGURES
    assert counting.counted + counting.taken == 1
    return counting.counted == 1


def test_the_second_time_nothing_is_counted(build: Path) -> None:
    assert [count(build) for _ in range(3)] == [True, False, False]


@pytest.mark.parametrize(
    ("file", "again"),
    [
        ("firmware/an386/setpoints.elf", True),
        ("firmware/an386/isr.elf", True),
        ("firmware/an385/isr.elf", False),
        ("target/count_plugin.so", True),
        ("tools/analysis/parts.py", True),
    ],
)
def test_what_is_counted_with_counts(build: Path, file: str, again: bool) -> None:
    count(build)
    write(build / file, "2")
    assert count(build) is again


def test_other_programs_and_tools(build: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    count(build)
    monkeypatch.setattr(Campaign, "checksums", lambda _: {"alpha": "2"})
    assert count(build)
    monkeypatch.setattr(campaign, "_first_line", lambda command: f"{command[0]} 2.0")
    assert count(build)


def test_each_core_and_kernel_is_another(build: Path) -> None:
    count(build)
    assert count(build, kernel="fixed")
    assert count(build, [TARGETS["an385"]])


def test_all_is_counted_where_stamps_are_off(build: Path) -> None:
    count(build)
    assert count(build, used=False)
    assert Campaign(build).stamped("float", [], (), lambda: FIGURES) == FIGURES


def test_damaged_figures_are_counted_again(build: Path) -> None:
    count(build)
    (stamp,) = (build / "cache/counts").glob("*/*")
    stamp.write_text(stamp.read_text().replace("[1, 2, 3]", "[1, 2, 4]"))
    assert count(build)
