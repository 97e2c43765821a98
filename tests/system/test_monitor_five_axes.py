# SPDX-License-Identifier: MIT
"""The live page of a job of five axes with outputs, also one that is opened in mid-run. Run by pytest; starts a browser
and a machine on a local bus, and writes to temporary folders.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from test_monitor_live import STATE, Live, arc_length_mm, monitored, picture, rig, status

from bench import EXAMPLES
from browser import Browser, Page
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import LocalHub
from hodograph.cli.main import main

MODULE = """
[outputs]
node = 16

[outputs.channel]
spindle = { digital = 0 }
coolant = { digital = 1 }
power = { analogue = 0, scale = 100, unit = "%" }

"""
SWITCHED = """
[[output]]
name = "spindle"
at_mm = 0.0
on = true

[[output]]
name = "coolant"
at_mm = 20.0
on = true

[[output]]
name = "power"
at_mm = 40.0
per_mm_s = 0.5

[[output]]
name = "coolant"
at_mm = 80.0
on = false
"""
MARKS = "spindle on; coolant on; power 0.5 by mm/s; coolant off"
AXES = "[...document.querySelectorAll('canvas')].filter(c => c.dataset.planned)"
LABELS = """(() => {
  const canvas = document.querySelector('#plane-canvas'), own = CanvasRenderingContext2D.prototype.fillText;
  window.labels = {};
  CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
    const width = this.measureText(text).width, right = this.textAlign === 'right' ? x : x + width;
    if (this.canvas === canvas) window.labels[text] = [right - width, right, canvas.clientWidth];
    return own.call(this, text, x, y);
  };
})()"""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture
def job(tmp_path: Path) -> tuple[str, str]:
    """Machine file and path file."""
    machine, path = tmp_path / "machine.toml", tmp_path / "path.toml"
    text = (EXAMPLES / "machines" / "mill_five_axes.toml").read_text()
    head, first, axes = text.replace("../drives", str(EXAMPLES / "drives")).partition("[[axis]]")
    machine.write_text(head + MODULE + first + axes)
    text = (EXAMPLES / "five_axes.toml").read_text()
    path.write_text(text.replace("machines/mill_five_axes.toml", str(machine)) + SWITCHED)
    return str(machine), str(path)


def test_a_job_of_five_axes_and_a_page_that_joins_in_mid_run(
    hub: LocalHub,
    clock: VirtualClock,
    browser: Browser,
    job: tuple[str, str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    machine, path = job
    with monitored(hub.address, clock, browser, machine) as live, rig(live, machine):
        page = live.page
        page.wait(f"{STATE} === 'off'")
        page.js(LABELS)
        assert main(["goto", path]) == 0
        assert main(["override", "20"]) == 0
        page.wait(f"document.querySelector('#plane-canvas').dataset.marks === {MARKS!r}")
        page.click("[data-command=start]")
        page.wait(f"{STATE} === 'running'")
        page.wait(f"{AXES}.every(c => Number(c.dataset.points) > 200)")
        _held_and_resumed(live, capsys)
        _joins_in_mid_run(live, browser)
        page.wait(f"{STATE} === 'ready'")
        _labels_are_inside(page)
        # those of the move to the start are drawn on the path, but have no arc length on it
        drawn = page.js("Number(document.querySelector('#plane-canvas').dataset.points)")
        assert page.js(f"{AXES}.every(c => Number(c.dataset.points) < {drawn} - 100)")
        assert page.complaints == []
        picture(page, "five_axes")


def _held_and_resumed(live: Live, capsys: pytest.CaptureFixture[str]) -> None:
    page = live.page
    page.click("[data-command=hold]")
    page.wait(f"{STATE} === 'held'")
    capsys.readouterr()
    held = status(live, capsys)
    assert arc_length_mm(page) == pytest.approx(held["motion"]["arc_length_mm"], abs=0.01)
    page.wait(f"{_shown('a', held)} && {_shown('c', held)}")
    page.click("[data-command=resume]")
    page.wait(f"{STATE} === 'running'")


def _shown(name: str, status: dict[str, Any]) -> str:
    """Whether the page shows where a rotary axis stands."""
    at = status["axes"][("x", "y", "z", "a", "c").index(name)]["actual_mm"]
    title = re.escape(f"Axis {name} over arc length")
    return f"Math.abs(Number((document.body.innerText.match(/{title}\\s+(-?[0-9.]+) deg/) ?? [])[1]) - {at}) < 0.002"


def _labels_are_inside(page: Page) -> None:
    page.wait(f"{MARKS!r}.split('; ').every(text => text in window.labels)")
    for text, (left, right, width) in page.js("window.labels").items():
        assert 0 <= left < right <= width, text


def _joins_in_mid_run(live: Live, browser: Browser) -> None:
    """A page that is opened now has the whole path, and draws what it has seen."""
    page = browser.open(live.url)
    page.meanwhile = live.page.meanwhile
    page.wait(f"{STATE} === 'running'")
    page.wait(f"document.querySelector('#plane-canvas').dataset.marks === {MARKS!r}")
    page.wait(f"{AXES}.every(c => Number(c.dataset.planned) > 1000)")
    page.click("[data-command=hold]")
    page.wait(f"{STATE} === 'held'")
    drawn = page.js("Number(document.querySelector('#plane-canvas').dataset.points)")
    assert page.js(f"{AXES}.every(c => Number(c.dataset.points) < {drawn} - 100)")
    page.click("[data-command=resume]")
    page.wait(f"{STATE} === 'ready'")
    assert page.complaints == []
