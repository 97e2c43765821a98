# SPDX-License-Identifier: MIT
"""The view in the report of a toolpath, in a browser: it draws, and names the source line under the cursor. Run by
pytest; starts a browser, and writes to temporary folders.
"""

from __future__ import annotations

from pathlib import Path

import pytest

from browser import Browser, Page
from hodograph.config import load_machine
from hodograph.job import load_job
from hodograph.job_simulation import simulate_job
from hodograph.report import write_toolpath_report

pytestmark = pytest.mark.long

ROOT = Path(__file__).resolve().parents[2]
MILL = ROOT / "examples" / "machines" / "mill.toml"


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report")
    (folder / "part.ngc").write_text("G0 X10\nF1200\nG1 X20\nY10 Z2\nM2\n")
    run = simulate_job(load_job(folder / "part.ngc", load_machine(MILL)))
    return write_toolpath_report(run, folder / "report")


def drawn(page: Page) -> int:
    """Pixels of the view that are not empty."""
    return int(
        page.js(
            "canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data"
            ".filter((value, i) => i % 4 === 3 && value > 0).length"
        )
    )


def point_at(page: Page, index: str) -> str:
    """What the page says with the mouse over point number `index` (an expression)."""
    x, y = page.js(
        f"(i => {{ const r = canvas.getBoundingClientRect();"
        f" return [r.x + left + scale * u[i], r.y + top_ - scale * v[i]]; }})({index})"
    )
    page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
    page.wait("place.textContent !== ''")
    return page.text("#place")


def test_the_view(report: Path, tmp_path: Path) -> None:
    with Browser(tmp_path) as browser:
        page = browser.open(report.as_uri())
        page.js("canvas.scrollIntoView()")
        assert drawn(page) > 300
        assert point_at(page, "2").startswith("line 1: G0 X10")
        assert point_at(page, "data.l.indexOf(4) + 20").startswith("line 4: Y10 Z2")
        for side in ("xz", "yz", "iso"):
            page.js(f"side.value = '{side}'; side.dispatchEvent(new Event('change'))")
            assert drawn(page) > 150
            assert point_at(page, "n - 1").startswith("line 4")
        narrow = browser.open(report.as_uri(), width=390, height=844)
        assert narrow.js("document.documentElement.scrollWidth") <= 390
        assert page.complaints == narrow.complaints == []
