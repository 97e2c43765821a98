# SPDX-License-Identifier: MIT
"""`hodograph monitor --replay` in a browser; the command's own errors. Run by pytest; starts `hodograph` and a browser,
and writes to temporary folders.
"""

from __future__ import annotations

import contextlib
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from browser import Browser, Page
from hodograph.bus.capture.recordings import write_recording
from traffic import alpha, recorded

ROOT = Path(__file__).resolve().parents[2]
HODOGRAPH = str(ROOT / ".venv/bin/hodograph")
HANGS_S = 600.0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@contextlib.contextmanager
def monitor(*words: str) -> Iterator[str]:
    """A running monitor; its address."""
    with running(*words) as (url, _):
        yield url


@contextlib.contextmanager
def running(*words: str) -> Iterator[tuple[str, subprocess.Popen[str]]]:
    """A running monitor: its address, and its process."""
    with subprocess.Popen(
        [HODOGRAPH, "monitor", *words, "--port", str(free_port())],
        stdin=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        assert process.stderr is not None
        try:
            words_said = process.stderr.readline()
            assert "monitor: http" in words_said, words_said
            yield words_said.partition("monitor: ")[2].strip(), process
        finally:
            process.send_signal(signal.SIGTERM)
            assert process.wait(HANGS_S) == 0
            assert process.stderr.read() == ""


@pytest.fixture(scope="module")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser(tmp_path_factory.mktemp("browser")) as browser:
        yield browser


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recording")
    image, frames = alpha()
    (folder / "alpha.hdgp").write_bytes(image)
    for ending in (".log", ".asc", ".blf"):
        write_recording(folder / f"alpha{ending}", recorded(frames))
    return folder


def replayed(page: Page) -> dict[str, float]:
    page.wait("document.querySelector('#replay-state').textContent === 'at its end'")
    page.wait("document.querySelector('#progress').value > 0.999")
    peaks = page.js(
        "[...document.querySelectorAll('.chart canvas')].map(c => Number(c.dataset.peak))"
    )
    names = ("feed", "acceleration", "jerk", "contour", "following")
    return dict(zip(names, peaks, strict=True))


@pytest.mark.parametrize("ending", [".log", ".asc", ".blf"])
def test_a_recording_shows_the_run(browser: Browser, files: Path, ending: str) -> None:
    replay = ("--replay", str(files / f"alpha{ending}"), "--program", str(files / "alpha.hdgp"))
    with monitor(*replay, "--speed", "2") as url:
        page = browser.open(url)
        peaks = replayed(page)
        assert peaks["feed"] == pytest.approx(100, abs=0.1)
        assert peaks["contour"] == pytest.approx(21.353, abs=0.001)
        assert peaks["following"] == pytest.approx(175.66, abs=0.01)
        assert page.js("document.querySelector('#controls').hidden")
        assert page.text("#drive-rows").count("operation enabled") == 2
        _the_path_is_drawn(page)
        assert "from the beginning" not in page.text("#event-rows")
        page.click("#again")
        page.wait(
            "document.querySelector('#event-rows').textContent.includes('from the beginning')"
        )
        replayed(page)
        assert page.complaints == []


def _the_path_is_drawn(page: Page) -> None:
    """Pixels of the actual position lie along the alpha, those of the background beside it."""
    colours = page.js(
        """(() => {
        const canvas = document.querySelector('#plane-canvas'), box = canvas.getContext('2d');
        const data = box.getImageData(0, 0, canvas.width, canvas.height).data;
        let blue = 0, grey = 0;
        for (let i = 0; i < data.length; i += 4) {
            const [r, g, b, a] = data.slice(i, i + 4);
            if (a > 200 && b > 140 && r < 80) blue += 1;
            if (a > 200 && Math.abs(r - 0xc9) < 12 && Math.abs(b - 0xd9) < 12) grey += 1;
        }
        return [blue, grey, canvas.width * canvas.height];
    })()"""
    )
    blue, grey, whole = colours
    assert 1000 < blue < whole / 10
    assert 1000 < grey < whole / 10


def test_the_keyboard_reaches_everything(browser: Browser, files: Path) -> None:
    with monitor("--replay", str(files / "alpha.log")) as url:
        page = browser.open(url)
        page.wait("document.querySelector('#drive-rows').rows.length === 2")
        reached = []
        for _ in range(9):
            page.press("Tab")
            reached.append(page.js("document.activeElement.id"))
        assert {
            "theme",
            "again",
            "magnify",
            "follow",
            "fit",
            "plane-canvas",
            "window",
            "pause",
        } <= set(reached)
        page.js("document.querySelector('#theme').focus()")
        page.press("Enter", text="\r")
        page.press("Enter", text="\r")
        assert page.js("document.documentElement.dataset.theme") == "dark"
        assert page.complaints == []


def test_a_monitor_that_sends_nothing_is_not_shown_as_connected(
    browser: Browser, files: Path
) -> None:
    """As after a pulled cable, where the browser keeps the connection."""
    with running("--replay", str(files / "alpha.log")) as (url, process):
        page = browser.open(url)
        page.wait("document.querySelector('#drive-rows').rows.length === 2")
        process.send_signal(signal.SIGSTOP)
        try:
            page.wait("document.querySelector('#state').textContent === 'not connected'")
            assert "does not answer" in page.text("#banner")
        finally:
            process.send_signal(signal.SIGCONT)
        page.wait("document.querySelector('#state').textContent === 'replay'")
        assert "does not answer" not in page.text("#banner")


def test_a_reconnected_page_has_no_marks_of_before(browser: Browser, files: Path) -> None:
    with monitor("--replay", str(files / "alpha.log")) as url:
        page = browser.open(url)
        kept = page.js(
            """import('/store.js').then(({ Store }) => {
            const store = new Store();
            store.add({ t: [], marks: [[1, 'coolant on']] });
            store.setAxes(2);
            return store.marks.length;
        })"""
        )
        assert kept == 0


def test_without_a_program_the_plots_are_there_all_the_same(browser: Browser, files: Path) -> None:
    with monitor("--replay", str(files / "alpha.log"), "--speed", "3") as url:
        page = browser.open(url)
        page.wait("document.querySelector('#replay-state').textContent === 'at its end'")
        page.wait("Number(document.querySelector('.chart canvas').dataset.peak) > 99")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--replay", "nothing.log"], "nothing.log"),
        ([], "--machine"),
        (["--replay", "EMPTY"], "no SYNCs"),
        (["--replay", "ALPHA", "--speed", "0"], "--speed"),
        (["--replay", "ALPHA", "--token", "short"], "--token"),
        (["--replay", "ALPHA", "--host", "192.0.2.1"], "cannot be served"),
        (["--replay", "ALPHA", "--port", "99999"], "port"),
    ],
)
def test_wrong_input_is_one_line_and_status_2(files: Path, words: list[str], said: str) -> None:
    empty = files / "empty.log"
    empty.write_text("(1.0) vcan0 701#05\n")
    names = {"EMPTY": str(empty), "ALPHA": str(files / "alpha.log")}
    done = subprocess.run(
        [HODOGRAPH, "monitor", *(names.get(word, word) for word in words)],
        capture_output=True,
        text=True,
        timeout=HANGS_S,
        check=False,
    )
    assert done.returncode == 2
    assert said in done.stderr
    assert done.stderr.count("\n") == 1


def test_a_toolpath_is_drawn_with_its_source_lines(browser: Browser, tmp_path: Path) -> None:
    part = tmp_path / "part.ngc"
    part.write_text("F1200\nG1 X20\nY10 (the side)\nM2\n")
    mill = str(ROOT / "examples" / "machines" / "mill.toml")
    nowhere = f"local:{tmp_path / 'bus'}"
    with monitor("--machine", mill, "--program", str(part), "--bus", nowhere) as url:
        page = browser.open(url)
        page.wait("!document.querySelector('#place').hidden")
        assert page.text("#speeds-most") == "20.0 mm/s"
        assert page.js("document.querySelector('#side').value") == "xy"
        left, top = page.js(
            "(r => [r.x + r.width / 2 + 0.42 * r.width, r.y + r.height / 2])"
            "(document.querySelector('#plane-canvas').getBoundingClientRect())"
        )
        page.call("Input.dispatchMouseEvent", type="mouseMoved", x=left, y=top)
        page.wait("document.querySelector('#place').textContent !== ''")
        assert page.text("#place").startswith("line 3: Y10 (the side)")
        assert page.complaints == []
