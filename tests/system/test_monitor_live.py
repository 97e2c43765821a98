# SPDX-License-Identifier: MIT
"""`hodograph monitor` as it is used: the bus inside user-mode Linux, the browser outside."""

from __future__ import annotations

import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from browser import Browser, Page
from traffic import alpha

pytestmark = pytest.mark.serial  # takes a bus, a browser and their time

ROOT = Path(__file__).resolve().parents[2]
WITH_VCAN, HODOGRAPH = str(ROOT / "tools/with-vcan"), str(ROOT / ".venv/bin/hodograph")
MACHINE = "examples/machines/paper_alpha.toml"
LIMIT_S = 300.0
UPLOAD = """
import sys
from pathlib import Path
from hodograph.bus.address import parse_address
from hodograph.bus.sdo.controller import connect
with connect(parse_address("socketcan:vcan0"), 1, 1000000) as controller:
    controller.require(60)
    controller.upload(Path(sys.argv[1]).read_bytes())
"""
"""`hodograph upload` without its planning, which user-mode Linux on a busy machine takes a minute to load."""

STATE = "document.querySelector('#state').textContent"


class Bus:
    """A bus inside user-mode Linux, and commands on it."""

    def __init__(self, name: str) -> None:
        self._join = [WITH_VCAN, "--join", "--bus", name]
        self.holder = start(
            [WITH_VCAN, "--user-mode", "--name", name, "sh", "-c", "echo up; exec sleep 3600"]
        )
        assert line_of(self.holder, "up")

    def start(self, *words: str, options: tuple[str, ...] = ()) -> subprocess.Popen[str]:
        return start([*self._join, *options, HODOGRAPH, *words])

    def run(self, *command: str) -> str:
        done = subprocess.run(
            [*self._join, *command],
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=LIMIT_S,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    def status(self) -> Any:
        return json.loads(self.run(HODOGRAPH, "status", "--wait", "60", "--json"))


def start(command: list[str]) -> subprocess.Popen[str]:
    return subprocess.Popen(
        command,
        cwd=ROOT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def line_of(process: subprocess.Popen[str], pattern: str) -> re.Match[str]:
    assert process.stdout is not None
    said = []
    for line in process.stdout:
        said.append(line)
        if found := re.search(pattern, line):
            return found
    raise AssertionError(f"no {pattern!r} in: {''.join(said)}")


def end(process: subprocess.Popen[str]) -> None:
    process.send_signal(signal.SIGTERM)
    with process:
        process.wait(LIMIT_S)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def ending(process: subprocess.Popen[str]) -> Iterator[subprocess.Popen[str]]:
    try:
        yield process
    finally:
        end(process)


@contextlib.contextmanager
def rig(bus: Bus) -> Iterator[None]:
    with ending(bus.start("rig", MACHINE)) as process:
        line_of(process, "Ctrl-C ends them")
        yield


@pytest.fixture(scope="module")
def bus() -> Iterator[Bus]:
    bus = Bus(f"monitor-{os.getpid()}")
    with ending(bus.holder):
        yield bus


@pytest.fixture(scope="module")
def url(bus: Bus) -> Iterator[str]:
    port = free_port()
    forward = ("--forward", f"{port}:8402")
    with ending(bus.start("monitor", "--machine", MACHINE, options=forward)) as process:
        token = line_of(process, r"#token=(\S+)")[1]
        yield f"http://127.0.0.1:{port}/#token={token}"


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture(scope="module")
def page(browser: Browser, url: str) -> Page:
    return browser.open(url)


def points(page: Page) -> int:
    return int(page.js("document.querySelector('#plane-canvas').dataset.points ?? 0"))


def arc_length_mm(page: Page) -> float:
    found = re.search(r"arc length\s+([\d.]+) mm", page.text("#facts"))
    assert found is not None, page.text("#facts")
    return float(found[1])


def picture(page: Page, name: str) -> None:
    folder = ROOT / "build/monitor"
    folder.mkdir(parents=True, exist_ok=True)
    page.picture(folder / f"{name}.png")


def test_without_a_controller_the_page_says_so_and_waits(page: Page) -> None:
    page.wait(f"{STATE} === 'no controller'")
    assert "waiting for a controller" in page.text("#banner")
    assert page.js("document.querySelector('[data-command=start]').disabled")


def test_a_controller_that_comes_is_found_and_used(bus: Bus, page: Page, tmp_path: Path) -> None:
    image = tmp_path / "alpha.hdgp"
    image.write_bytes(alpha()[0])
    with rig(bus):
        page.wait(f"{STATE} === 'off'")
        assert page.js("document.querySelector('#banner').hidden")
        _the_drives_are_shown(page)
        bus.run(sys.executable, "-c", UPLOAD, str(image))
        page.click("[data-command=enable]")
        page.wait(f"{STATE} === 'ready'")
        page.wait("document.querySelector('#facts').innerText.includes('alpha')")
        _the_slider_changes_the_override(page)
        _the_buttons_move_and_stop_the_machine(bus, page)
        _another_browser_sees_the_same(page)
        _the_alpha_is_drawn(page)
        _switched_off(bus, page)
    page.wait(f"{STATE} === 'no controller'")
    assert page.complaints == []


def _the_drives_are_shown(page: Page) -> None:
    page.wait("document.querySelector('#drive-rows').rows.length === 2")
    words = page.text("#drive-rows")
    assert re.search(r"x\s+2\s", words)
    assert re.search(r"y\s+3\s", words)


def _the_slider_changes_the_override(page: Page) -> None:
    page.js("document.querySelector('#override').focus()")
    page.press("Home")
    for _ in range(12):
        page.press("ArrowRight")
    page.wait("document.querySelector('#override-value').textContent === '12 %'")
    page.wait("document.querySelector('#override').value === '12'")


def _the_buttons_move_and_stop_the_machine(bus: Bus, page: Page) -> None:
    before = points(page)
    page.click("[data-command=start]")
    page.wait(f"{STATE} === 'running'")
    page.wait(f"Number(document.querySelector('#plane-canvas').dataset.points) > {before + 100}")
    page.click("[data-command=hold]")
    page.wait(f"{STATE} === 'held'")
    held = bus.status()
    assert held["state"] == "held"
    assert held["override"]["wanted_percent"] == 12
    assert 0 < held["motion"]["arc_length_mm"] < 99
    picture(page, "held")
    page.click("[data-command=resume]")
    page.wait(f"{STATE} === 'running'")
    page.click("[data-command=stop]")
    page.wait(f"{STATE} === 'ready'")
    assert held["motion"]["arc_length_mm"] < arc_length_mm(page) < 99.9


def _another_browser_sees_the_same(page: Page) -> None:
    other = page.again()
    other.wait(f"{STATE} === 'ready'")
    assert other.js("document.querySelector('[data-command=start]').disabled"), "has no token"
    assert "without the token" in other.text("#banner")
    other.wait("Number(document.querySelector('#plane-canvas').dataset.points) > 100")
    assert other.complaints == []


def _the_alpha_is_drawn(page: Page) -> None:
    peaks = [
        float(peak)
        for peak in page.js(
            "[...document.querySelectorAll('.chart canvas')].map(c => c.dataset.peak)"
        )
    ]
    feed, acceleration, _, contour, following = peaks
    assert 5 < feed < 13
    assert acceleration > 1
    assert 0 < contour < 30
    assert 1 < following < 200
    picture(page, "live")


def _switched_off(bus: Bus, page: Page) -> None:
    page.click("[data-command=disable]")
    page.wait(f"{STATE} === 'off'")
    assert bus.status()["state"] == "off"


def test_a_controller_that_comes_back_is_found_again(bus: Bus, page: Page) -> None:
    with rig(bus):
        page.wait(f"{STATE} === 'off'")
        before = points(page)
        page.wait(f"Number(document.querySelector('#plane-canvas').dataset.points) !== {before}")
        _a_fault_says_what_to_do(bus, page)
    assert page.complaints == []


def _a_fault_says_what_to_do(bus: Bus, page: Page) -> None:
    page.click("[data-command=enable]")
    page.wait(f"{STATE} === 'ready'")
    bus.run("sh", "-c", "kill -STOP $(pidof hodograph-drive)")
    page.wait(f"{STATE} === 'fault'")
    page.wait("document.querySelector('#banner').innerText.includes('What to do:')")
    assert re.search(r"Fault: .+ \(0x[0-9A-F]{4}, node [23]", page.text("#banner"))
    picture(page, "fault")


def test_a_wrong_token_is_refused(browser: Browser, url: str) -> None:
    page = browser.open(url.partition("#")[0] + "#token=0123456789abcdef0123")
    page.wait("document.querySelector('#token-dialog').open")
    assert page.js(STATE) == "not connected"
    assert page.js("document.querySelectorAll('[data-command]:enabled').length") == 0
