# SPDX-License-Identifier: MIT
"""`hodograph monitor` on a bus in virtual time, in a browser.

The time of the bus advances only while a test allows it, so the page may take any time. Run by pytest; starts a
browser, `hodograph` and a machine on a local bus, and writes to build/monitor and temporary folders.
"""

from __future__ import annotations

import contextlib
import json
import re
import signal
import socket
import subprocess
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from browser import Browser, Page
from commands import Command, running
from hodograph.bus.address import BusAddress
from hodograph.bus.clock import VirtualClock
from hodograph.bus.hub import HUB, LocalHub
from hodograph.bus.processes import find_program, virtual_clock
from hodograph.bus.sdo.controller import connect
from hodograph.cli.main import main
from traffic import alpha

ROOT = Path(__file__).resolve().parents[2]
MACHINE = str(ROOT / "examples/machines/paper_alpha.toml")
LOOK_S = 0.05
"""Of virtual time, between two readings of the page."""
TOKEN = "a-token-of-this-test"

STATE = "document.querySelector('#state').textContent"
POINTS = "Number(document.querySelector('#plane-canvas').dataset.points ?? 0)"


@dataclass(frozen=True)
class Live:
    """A monitor on a bus, and a browser that shows its page."""

    bus: BusAddress
    clock: VirtualClock
    monitor: Command
    page: Page
    url: str


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def monitored(
    bus: BusAddress, clock: VirtualClock, browser: Browser, machine: str = MACHINE
) -> Iterator[Live]:
    port = free_port()
    words = ("monitor", "--machine", machine, "--bus", str(bus), "--port", str(port))
    with running(clock, *words, "--token", TOKEN, name="monitor") as monitor:
        url = f"http://127.0.0.1:{port}/#token={TOKEN}"
        assert url in monitor.err
        page = browser.open(url)
        page.meanwhile = partial(clock.sleep, LOOK_S)
        yield Live(bus, clock, monitor, page, url)


@pytest.fixture
def live(hub: LocalHub, clock: VirtualClock, browser: Browser) -> Iterator[Live]:
    """Ended as a user ends it."""
    with monitored(hub.address, clock, browser) as live:
        yield live
        live.monitor.signal(signal.SIGTERM)
        assert live.monitor.wait() == 0
        assert live.monitor.err.count("\n") == 1, "its address, and nothing else"


@contextlib.contextmanager
def rig(live: Live, machine: str = MACHINE) -> Iterator[None]:
    with running(live.clock, "rig", machine, "--bus", str(live.bus), name="rig") as process:
        process.await_text("Ctrl-C ends them")
        yield
        process.signal(signal.SIGINT)
        assert process.wait() == 0


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


def status(live: Live, capsys: pytest.CaptureFixture[str]) -> Any:
    assert main(["status", "--bus", str(live.bus), "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def arc_length_mm(page: Page) -> float:
    found = re.search(r"arc length\s+([\d.]+) mm", page.text("#facts"))
    assert found is not None, page.text("#facts")
    return float(found[1])


def picture(page: Page, name: str) -> None:
    folder = ROOT / "build/monitor"
    folder.mkdir(parents=True, exist_ok=True)
    page.picture(folder / f"{name}.png")


def test_without_a_controller_the_page_says_so_and_waits(live: Live, browser: Browser) -> None:
    live.page.wait(f"{STATE} === 'no controller'")
    assert "waiting for a controller" in live.page.text("#banner")
    assert live.page.js("document.querySelector('[data-command=start]').disabled")
    _a_wrong_token_is_refused(browser, live.url)


def _a_wrong_token_is_refused(browser: Browser, url: str) -> None:
    page = browser.open(url.partition("#")[0] + "#token=0123456789abcdef0123")
    page.wait("document.querySelector('#token-dialog').open")
    assert page.js(STATE) == "not connected"
    assert page.js("document.querySelectorAll('[data-command]:enabled').length") == 0


def test_a_controller_that_comes_is_found_and_used(
    live: Live, capsys: pytest.CaptureFixture[str]
) -> None:
    page = live.page
    with rig(live):
        page.wait(f"{STATE} === 'off'")
        assert page.js("document.querySelector('#banner').hidden")
        _the_drives_are_shown(page)
        with connect(live.bus, 1, 1_000_000) as controller:
            controller.upload(alpha()[0])
        page.click("[data-command=enable]")
        page.wait(f"{STATE} === 'ready'")
        page.wait("document.querySelector('#facts').innerText.includes('alpha')")
        _the_slider_changes_the_override(page)
        _the_buttons_move_and_stop_the_machine(live, capsys)
        _another_browser_sees_the_same(page)
        page.click("[data-command=disable]")
        page.wait(f"{STATE} === 'off'")
        assert status(live, capsys)["state"] == "off"
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
    for _ in range(3):
        page.press("ArrowRight")
    page.wait("document.querySelector('#override-value').textContent === '3 %'")
    page.wait("document.querySelector('#override').value === '3'")


def _the_buttons_move_and_stop_the_machine(live: Live, capsys: pytest.CaptureFixture[str]) -> None:
    """At 3 % the alpha takes 40 s: there is time for all of this on the way, however late the page is."""
    page = live.page
    before = page.js(POINTS)
    page.click("[data-command=start]")
    page.wait(f"{STATE} === 'running'")
    page.wait(f"{POINTS} > {before + 100}")
    _the_alpha_is_drawn(page)
    page.click("[data-command=hold]")
    page.wait(f"{STATE} === 'held'")
    held = status(live, capsys)
    assert held["state"] == "held"
    assert held["override"]["wanted_percent"] == 3
    assert held["motion"]["feed_mm_s"] == 0
    assert 0 < held["motion"]["arc_length_mm"] < 99
    assert arc_length_mm(page) == pytest.approx(held["motion"]["arc_length_mm"], abs=0.01)
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
    other.wait(f"{POINTS} > 100")
    assert other.complaints == []


def _the_alpha_is_drawn(page: Page) -> None:
    page.wait("Number(document.querySelector('.chart canvas').dataset.peak) > 2.99")
    feed, acceleration, _, contour, following = (
        float(peak)
        for peak in page.js(
            "[...document.querySelectorAll('.chart canvas')].map(c => c.dataset.peak)"
        )
    )
    assert feed == pytest.approx(3.0, abs=0.02)
    assert 1 < acceleration < 3
    assert 0 < contour < 0.1
    assert following == pytest.approx(4.34, abs=0.1)
    picture(page, "live")


def test_a_controller_that_comes_back_is_found_again(live: Live) -> None:
    page = live.page
    before = page.js(POINTS)
    with rig(live):
        page.wait(f"{STATE} === 'off'")
        page.wait(f"{POINTS} !== {before}")
    page.wait(f"{STATE} === 'no controller'")
    with rig(live):
        page.wait(f"{STATE} === 'off'")
        _a_fault_says_what_to_do(live)
    assert page.complaints == []


def _a_fault_says_what_to_do(live: Live) -> None:
    page = live.page
    page.click("[data-command=enable]")
    page.wait(f"{STATE} === 'ready'")
    live.clock.suspend("drives")
    page.wait(f"{STATE} === 'fault'")
    page.wait("document.querySelector('#banner').innerText.includes('What to do:')")
    banner = page.text("#banner")
    assert re.search(r"Fault: .+ \(0x8250, node 2, 2 positions missed in a row\)", banner)
    picture(page, "fault")
    live.clock.resume("drives")


@contextlib.contextmanager
def serving(path: Path) -> Iterator[subprocess.Popen[bytes]]:
    """A hub at this path."""
    with subprocess.Popen([str(find_program(HUB)), "--time", "virtual", str(path)]) as hub:
        while not path.is_socket():
            assert hub.poll() is None
        try:
            yield hub
        finally:
            hub.terminate()


def test_a_bus_that_comes_back_is_found_again(
    one_core: None, tmp_path: Path, browser: Browser
) -> None:
    path = tmp_path / "bus"
    bus = BusAddress("local", str(path))
    with contextlib.ExitStack() as stack:
        with serving(path) as hub:
            clock = virtual_clock(bus)
            assert clock is not None
            live = stack.enter_context(monitored(bus, clock, browser))
            live.page.wait(f"{STATE} === 'no controller'")
            hub.terminate()
            hub.wait()
            clock.release()
        page = live.page
        page.meanwhile = lambda: None
        page.wait("document.querySelector('#banner').innerText.includes('hodograph-hub')")
        stack.enter_context(serving(path))
        page.wait(
            "document.querySelector('#banner').innerText.includes('waiting for a controller')"
        )
        clock = virtual_clock(bus)
        assert clock is not None
        page.meanwhile = partial(clock.sleep, LOOK_S)
        back = Live(bus, clock, live.monitor, page, live.url)
        with rig(back):
            page.wait(f"{STATE} === 'off'")
            page.wait("document.querySelector('#drive-rows').rows.length === 2")
        live.monitor.child.terminate()
        clock.release()
        assert live.monitor.child.wait(600) == 0
