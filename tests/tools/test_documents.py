# SPDX-License-Identifier: MIT
"""Pages are whole: links lead to files that are there, and no merge has left its marks. Run by pytest; reads the pages,
and starts the generators of pages and `git`.
"""

from __future__ import annotations

import re
import subprocess
import sys
from argparse import _SubParsersAction
from itertools import pairwise
from pathlib import Path

import pytest

from hodograph import __version__
from hodograph.cli.parser import make_parser

ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), ROOT / "tools/README.md"])
COMMAND = re.compile(r"(?<![\w./-])(?<!import )hodograph ([a-z][a-z-]*)([^`\n#|&;<>]*)")
"""A command of the host tools, as a reader types it, and what follows it on the line."""
LINK = re.compile(r"\]\(([^)#\s]+)(?:#[^)]*)?\)")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_and_merges(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    links = [link for link in LINK.findall(text) if "://" not in link]
    assert [link for link in links if not (page.parent / link).exists()] == []
    marks = [line for line in text.splitlines() if re.match(r"(<{7}|>{7})( |$)|={7}$", line)]
    assert marks == []


@pytest.mark.parametrize("page", sorted(ROOT.glob("docs/**/*.md")), ids=lambda page: page.name)
def test_the_site_takes_the_page(page: Path) -> None:
    """`make site` ends at each of these: a heading two levels below the one before, a link to a page elsewhere."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    levels = [len(mark) for mark in re.findall(r"^(#+) ", text, re.MULTILINE)]
    assert levels[0] == 1
    assert all(below - above <= 1 for above, below in pairwise(levels))
    pages = [(page.parent / link).resolve() for link in LINK.findall(text) if link.endswith(".md")]
    assert [file for file in pages if not file.is_relative_to(ROOT / "docs")] == []


def code(page: Path) -> str:
    """Indented and fenced blocks and words in back quotes, without comments."""
    text = page.read_text(encoding="utf-8")
    fenced = re.findall(r"^```\w*\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    indented = re.findall(r"^    .*", text, re.MULTILINE)
    parts = [*fenced, *indented, *re.findall(r"`([^`]+)`", text)]
    return re.sub(r"\s# .*", "", "\n".join(parts))


def test_commands_of_the_pages_have_their_options() -> None:
    """Each command that a page says to type is there, and knows the options that the page gives it."""
    parser = make_parser()
    (commands,) = (a.choices for a in parser._actions if isinstance(a, _SubParsersAction))
    found = [(page.name, *match) for page in PAGES for match in COMMAND.findall(code(page))]
    assert len(found) > 100
    wrong = []
    for page, name, rest in found:
        options = set(re.findall(r"(?<!\S)\[?(--?[a-z][a-z-]*)", rest))
        known = commands[name]._option_string_actions.keys() if name in commands else set()
        if name not in commands or options - known:
            wrong.append((page, name, sorted(options - known)))
    assert wrong == []


@pytest.mark.parametrize("tool", ["draw_figures.py", "list_api.py", "list_options.py"])
def test_generated_pages_are_current(tool: str) -> None:
    """`make figures` and `make options` would write the same again."""
    command = [sys.executable, str(ROOT / "tools" / tool), "--check"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_every_page_has_the_version_of_the_package() -> None:
    """It is in hodograph/__init__.py; the changelog begins with its release, and citations name it."""
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    releases = re.findall(
        r"^## (\S+) \((?:\d{4}-\d\d-\d\d|not released yet)\)$", changes, re.MULTILINE
    )
    assert releases == re.findall(r"^## (\S+)", changes, re.MULTILINE)
    assert releases[0] == __version__
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert re.findall(r"^version: (.*)$", citation, re.MULTILINE) == [__version__]
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    assert f"version {__version__}." in readme.partition("## How to cite")[2]


def test_each_tool_has_a_row() -> None:
    """In tools/README.md: scripts by their names, folders with a slash."""
    text = (ROOT / "tools/README.md").read_text(encoding="utf-8")
    listed = subprocess.run(
        ["git", "ls-files", "tools"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout.splitlines()
    parts = [Path(name).relative_to("tools").parts for name in listed]
    names = {own[0] + ("/" if len(own) > 1 else "") for own in parts} - {"README.md"}
    assert sorted(name for name in names if f"`{name}`" not in text) == []
    rows = [
        cell for line in text.splitlines() if (cell := line.partition("|")[2].partition("|")[0])
    ]
    named = {name for row in rows for name in re.findall(r"`([^`]+)`", row)}
    assert sorted(named - names) == []


def test_there_are_pages_with_links() -> None:
    assert len(PAGES) > 15
    assert sum(len(LINK.findall(page.read_text(encoding="utf-8"))) for page in PAGES) > 50
