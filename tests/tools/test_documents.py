# SPDX-License-Identifier: MIT
"""Pages are whole: links lead to files that are there, and no merge has left its marks."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")])
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_merges(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    links = [link for link in LINK.findall(text) if "://" not in link]
    assert [link for link in links if not (page.parent / link).exists()] == []
    marks = [line for line in text.splitlines() if re.match(r"(<{7}|>{7})( |$)|={7}$", line)]
    assert marks == []


def test_there_are_pages_with_links() -> None:
    assert len(PAGES) > 15
    assert sum(len(LINK.findall(page.read_text(encoding="utf-8"))) for page in PAGES) > 50
