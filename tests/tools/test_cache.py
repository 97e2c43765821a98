# SPDX-License-Identifier: MIT
"""Stamps: what is damaged, made for something else or refused is absent, and never a finding. Run by pytest; writes to
temporary folders.
"""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from testing.cache import ABSENT, Stamps, content, digest, folder, newest, tree

KEY = digest(["key"])
FACT = {"passed": 3}


@pytest.fixture
def stamps(tmp_path: Path) -> Stamps:
    stamps = Stamps("part", base=tmp_path / "cache")
    stamps.write(KEY, FACT)
    return stamps


def stored(tmp_path: Path) -> Path:
    (file,) = (tmp_path / "cache/part").glob("*/*")
    return file


def test_a_stamp_is_found_under_its_key_only(stamps: Stamps) -> None:
    assert stamps.read(KEY) == FACT
    assert stamps.read(digest(["another key"])) is None


def test_stamps_that_are_not_used_are_absent_and_yet_written(tmp_path: Path) -> None:
    base = tmp_path / "cache"
    off = Stamps("part", used=False, base=base)
    off.write(KEY, FACT)
    assert off.read(KEY) is None
    assert Stamps("part", base=base).read(KEY) == FACT


def test_parts_do_not_share_stamps(stamps: Stamps, tmp_path: Path) -> None:
    file = stored(tmp_path)
    other = tmp_path / "cache/other" / file.parent.name / file.name
    other.parent.mkdir(parents=True)
    file.rename(other)
    assert Stamps("other", base=tmp_path / "cache").read(KEY) is None


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "null",
        "[]",
        "7",
        "{}",
        json.dumps({"fact": FACT}),
        json.dumps({"fact": FACT, "sum": None}),
        json.dumps({"fact": None, "sum": digest([])}),
        "[" * 100_000,
        "\ufffd\x00",
    ],
)
def test_a_stamp_of_other_text_is_absent(stamps: Stamps, tmp_path: Path, text: str) -> None:
    stored(tmp_path).write_text(text, encoding="utf-8")
    assert stamps.read(KEY) is None


def test_a_stamp_with_any_byte_changed_or_lost_is_absent(stamps: Stamps, tmp_path: Path) -> None:
    file = stored(tmp_path)
    whole = file.read_bytes()
    for i in range(len(whole)):
        file.write_bytes(whole[:i] + bytes([whole[i] ^ 1]) + whole[i + 1 :])
        assert stamps.read(KEY) is None, i
        file.write_bytes(whole[:i])
        assert stamps.read(KEY) is None, i
    file.write_bytes(whole)
    assert stamps.read(KEY) == FACT


def test_a_stamp_under_the_name_of_another_is_absent(stamps: Stamps, tmp_path: Path) -> None:
    other = digest(["another key"])
    file = stored(tmp_path)
    place = tmp_path / "cache/part" / other[:2] / f"{other}.json"
    place.parent.mkdir(parents=True, exist_ok=True)
    file.rename(place)
    assert stamps.read(other) is None


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(tmp_path: Path) -> None:
    (tmp_path / "cache").write_text("a file where the folder should be")
    stamps = Stamps("part", base=tmp_path / "cache")
    stamps.write(KEY, FACT)
    assert stamps.read(KEY) is None


def test_old_stamps_go_and_those_in_use_stay(stamps: Stamps, tmp_path: Path) -> None:
    file = stored(tmp_path)
    os.utime(file, (0, 0))
    assert stamps.read(KEY) == FACT  # and that is a use
    stamps.prune()
    assert stamps.read(KEY) == FACT
    os.utime(file, (0, 0))
    stamps.prune()
    assert stamps.read(KEY) is None


def test_the_folder_is_that_of_the_desktop_standard(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert folder() == tmp_path / "hodograph"
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    for nothing in ("", "relative/path"):
        monkeypatch.setenv("XDG_CACHE_HOME", nothing)
        assert folder() == tmp_path / "home/.cache/hodograph"


def test_digests_tell_lists_of_texts_apart() -> None:
    lists = [[], [""], ["", ""], ["ab"], ["a", "b"], ["1:a"], ["a", "1:b"], ["b", "a"]]
    assert len({digest(parts) for parts in lists}) == len(lists)


def test_content_of_files_and_folders(tmp_path: Path) -> None:
    assert content(tmp_path / "none") == ABSENT
    empty = content(tmp_path)
    (tmp_path / "file").write_text("a")
    named = content(tmp_path)
    assert named != empty
    first = content(tmp_path / "file")
    (tmp_path / "file").write_text("b")
    assert content(tmp_path / "file") != first
    assert content(tmp_path) == named  # names only


def test_a_tree_is_all_files_below_and_their_names(tmp_path: Path) -> None:
    (tmp_path / "a/b").mkdir(parents=True)
    seen = {tree(tmp_path)}
    file = tmp_path / "a/b/file"
    file.write_text("one")
    seen.add(tree(tmp_path))
    file.write_text("two")
    seen.add(tree(tmp_path))
    file.rename(file.with_name("other"))
    last = tree(tmp_path)
    seen.add(last)
    assert len(seen) == 4
    (tmp_path / "a/__pycache__").mkdir()
    (tmp_path / "a/__pycache__/x.pyc").write_text("")
    assert tree(tmp_path) == last


def test_newest_is_the_last_write_below(tmp_path: Path) -> None:
    (tmp_path / "a").mkdir()
    for name, when in (("one", 100), ("a/two", 300), ("three", 200)):
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (when, when))
    assert newest(tmp_path) == 300
