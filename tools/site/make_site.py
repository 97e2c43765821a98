# SPDX-License-Identifier: MIT
"""`make site`: the pages of docs/ and a page for each public C header as a static site with search.

    make_site.py OUTPUT

Run by `make site`. Starts Sphinx; writes OUTPUT and a copy of the pages beside it, OUTPUT-source.

The navigation is the tables of docs/index.md, in their order. Warnings of Sphinx, a broken link among them, are errors.
OUTPUT/index.html opens from the disk; nothing is fetched from outside.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADER_FOLDERS = {
    "core": "Interpolator: what an application that reads programs calls",
    "canopen": "CANopen: object dictionary, SDO, PDO, NMT, CiA 402",
    "port": "What a port to a board implements",
}
"""Folders of firmware/ with public headers, and what each is for."""
C_API = "reference/c"

_SECTION = re.compile(r"^## (?P<title>.+)$")
_ROW = re.compile(r"^\| \[[^\]]+\]\((?P<file>[^)]+)\.md\)")
_HEADER_LINK = re.compile(r"\]\((?:\.\./)+firmware/(?P<header>[\w/]+)\.h\)")


def main() -> int:
    """Writes the site; the exit status is that of Sphinx."""
    output = Path(sys.argv[1])
    source = output.with_name(output.name + "-source")
    for folder in (source, output):
        shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "docs", source)
    for page in source.rglob("*.md"):
        _link_headers(page, source)
    _write_headers(source)
    _add_navigation(source / "index.md")
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet"]
    return subprocess.call([*command, "-c", str(Path(__file__).parent), str(source), str(output)])


def _headers(folder: str) -> list[Path]:
    """Headers of a folder, relative to firmware/."""
    firmware = ROOT / "firmware"
    return [file.relative_to(firmware) for file in sorted((firmware / folder).rglob("*.h"))]


def _link_headers(page: Path, source: Path) -> None:
    """Links to headers of the tree become links to their pages."""
    up = "../" * (len(page.relative_to(source).parts) - 1)
    text = page.read_text(encoding="utf-8")
    page.write_text(_HEADER_LINK.sub(rf"]({up}{C_API}/\g<header>.md)", text), encoding="utf-8")


def _write_headers(source: Path) -> None:
    for folder in HEADER_FOLDERS:
        for header in _headers(folder):
            page = (source / C_API / header).with_suffix(".md")
            page.parent.mkdir(parents=True, exist_ok=True)
            text = f"# {header.as_posix()}\n\n```c\n{_code(header)}```\n"
            page.write_text(text, encoding="utf-8")
    (source / C_API / "index.md").write_text(_overview(), encoding="utf-8")


def _code(header: Path) -> str:
    """Without the line of the licence."""
    text = (ROOT / "firmware" / header).read_text(encoding="utf-8")
    return text.split("\n", 1)[1] if text.startswith("/* SPDX") else text


def _summary(header: Path) -> str:
    """The first sentence of the header's comment."""
    comment = _code(header).split("*/", 1)[0]
    words = re.sub(r"^\s*/?\*+", " ", comment, flags=re.MULTILINE).split()
    sentence = re.split(r"(?<=[.:])\s", " ".join(words), maxsplit=1)[0]
    return sentence.rstrip(".:").replace("|", "\\|")


def _overview() -> str:
    lines = ["# C headers", "", "The header is the manual of its module.", ""]
    pages = []
    for folder, purpose in HEADER_FOLDERS.items():
        lines += [f"## {folder}", "", f"{purpose}.", "", "| header | is for |", "| --- | --- |"]
        for header in _headers(folder):
            page = header.with_suffix("").as_posix()
            lines.append(f"| [{header.as_posix()}]({page}.md) | {_summary(header)} |")
            pages.append(page)
        lines.append("")
    return "\n".join([*lines, *_toctree(None, pages)])


def _add_navigation(index: Path) -> None:
    text = index.read_text(encoding="utf-8")
    trees = [line for title, pages in _sections(text) for line in _toctree(title, pages)]
    index.write_text("\n".join([text, *trees]), encoding="utf-8")


def _sections(index: str) -> Iterator[tuple[str, list[str]]]:
    """Titles of docs/index.md and the pages in their tables."""
    sections: dict[str, list[str]] = {}
    for line in index.splitlines():
        if section := _SECTION.match(line):
            title = section["title"]
        elif row := _ROW.match(line):
            sections.setdefault(title, []).append(row["file"])
    sections["Reference"].append(f"{C_API}/index")
    sections["Reference"].append("glossary")
    yield from sections.items()


def _toctree(title: str | None, pages: list[str]) -> list[str]:
    caption = [] if title is None else [f":caption: {title}"]
    return ["", "```{toctree}", ":hidden:", ":maxdepth: 1", *caption, "", *pages, "```", ""]


if __name__ == "__main__":
    sys.exit(main())
