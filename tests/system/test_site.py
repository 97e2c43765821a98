# SPDX-License-Identifier: MIT
"""`make site`: every page is there, nothing is fetched from outside, and it works in a browser from the disk. Run by
pytest; starts `make`, which writes build/site, and a browser; writes to temporary folders.
"""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from browser import Browser

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
SITE = ROOT / "build" / "site"
PHONE, DESKTOP = (390, 844), (1440, 1000)


@pytest.fixture(scope="module")
def site() -> Path:
    subprocess.run(["make", "--no-print-directory", "site"], cwd=ROOT, check=True, timeout=1800)
    return SITE


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


class References(HTMLParser):
    """What a page loads by itself, and what it links to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.linked: list[str] = []
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Collects addresses."""
        for name, value in attrs:
            if value is None or name not in ("src", "href"):
                continue
            (self.linked if tag == "a" else self.loaded).append(value)


def test_every_page_is_there(site: Path) -> None:
    pages = [file.relative_to(ROOT / "docs") for file in (ROOT / "docs").rglob("*.md")]
    assert pages
    for page in pages:
        assert (site / page).with_suffix(".html").is_file()
    assert (site / "reference/c/core/hodograph.html").is_file()


def test_nothing_comes_from_outside_and_every_link_ends_in_the_site(site: Path) -> None:
    pages = sorted(site.rglob("*.html"))
    assert len(pages) > 30
    for page in pages:
        found = References(page)
        assert [one for one in found.loaded if urlsplit(one).netloc] == []
        for link in (*found.loaded, *found.linked):
            parts = urlsplit(link)
            if not parts.netloc and parts.path and parts.scheme != "data":
                assert (page.parent / parts.path).exists(), f"{page}: {link}"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", [PHONE, DESKTOP], ids=["phone", "desktop"])
def test_pages_fit_the_screen(
    site: Path, browser: Browser, size: tuple[int, int], scheme: str
) -> None:
    page = browser.open((site / "index.html").as_uri(), *size)
    media = [{"name": "prefers-color-scheme", "value": scheme}]
    page.call("Emulation.setEmulatedMedia", features=media)
    for name in ("index", "theory/numerics", "reference/options", "reference/c/core/hodograph"):
        page.go((site / f"{name}.html").as_uri())
        page.wait("document.querySelector('h1') !== null")
        assert page.js("document.documentElement.scrollWidth") <= size[0]
        brightness = page.js(
            "getComputedStyle(document.body).backgroundColor.match(/\\d+/g).slice(0, 3)"
            ".reduce((sum, one) => sum + Number(one), 0) / 3"
        )
        assert (brightness > 200) == (scheme == "light")
    assert page.complaints == []


def test_search_finds_without_a_server(site: Path, browser: Browser) -> None:
    page = browser.open((site / "search.html").as_uri() + "?q=jerk", *DESKTOP)
    page.wait("document.querySelectorAll('#search-results li a').length > 3")
    links = page.js("[...document.querySelectorAll('#search-results li a')].map(a => a.href)")
    assert any("theory/numerics.html" in link for link in links)
    assert page.complaints == []
