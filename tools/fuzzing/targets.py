# SPDX-License-Identifier: MIT
"""The kinds of input that the Python side reads, with what may and may not come of a mutated one. Used by
fuzzing/child. Writes to the folder that it is given; to make a recording it starts a local bus and the simulated
machine.

Each target makes its cases from a random generator alone, so a case is found again by target, seed and number. A
`Finding` is raised where a rule is broken:

- every command ends with a status of docs/reference/cli.md other than 1, one line of error at most, no
  traceback, no warning;
- a document gives the same result in any spelling, and an unknown key or a value that is no number is refused;
- a recording gives the same result as candump log and as ASC;
- of an image the check in Python and the controller's own in C give the same verdict, but for the rounding of bounds.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import tomllib
import warnings
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING, Any

from fuzzing.toml_text import Tree, mutate, places, plain, spelled

if TYPE_CHECKING:
    from hodograph.program import Program

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = ROOT / "examples"
STATUSES = (0, 2, 3, 4, 5, 6, 7)
"""Exit statuses that a command may have: all but that of an internal error."""
_WALL_TIME = ("planning_s",)
_ROUNDED_US = 20.0
"""The controller's bounds of stops may be above those in Python by this (hodograph.program.check_stops)."""
_LONG_US = 1 << 31
"""Longer than any stop."""


class Finding(Exception):
    """A rule is broken."""


@dataclass(frozen=True)
class Outcome:
    """What a command did."""

    status: int
    out: str
    errors: str


def command(*words: str | Path) -> Outcome:
    """Runs a command of `hodograph` in this process. Raises Finding."""
    from hodograph.cli.main import main

    out, errors = io.StringIO(), io.StringIO()
    with (
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(errors),
        _warnings() as reported,
    ):
        try:
            status = main(list(map(str, words)))
        except SystemExit as ended:  # of argparse
            status = int(ended.code or 0)
    _judge(" ".join(map(str, words)), status, errors.getvalue(), reported)
    return Outcome(status, out.getvalue(), errors.getvalue())


@contextlib.contextmanager
def _warnings() -> Iterator[list[str]]:
    reported: list[str] = []
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        yield reported
    reported += [f"{w.category.__name__}: {w.message} ({w.filename}:{w.lineno})" for w in caught]


def _judge(what: str, status: int, errors: str, reported: list[str]) -> None:
    if status not in STATUSES or "Traceback" in errors:
        raise Finding(f"{what}: status {status}: {errors[-2000:]}")
    if reported:
        raise Finding(f"{what}: {reported[0]}")
    lines = [line for line in errors.splitlines() if line.startswith("hodograph: error")]
    if status != 0 and not errors.strip():
        raise Finding(f"{what}: status {status} without a word")
    if len(lines) > 1:
        raise Finding(f"{what}: more than one line of error: {errors[-2000:]}")


def loaded(load: Callable[[Path], object], file: Path) -> Outcome:
    """Runs a function of the package on a file: what `main` would make of it. Raises Finding."""
    from hodograph.errors import HodographError

    with _warnings() as reported:
        try:
            outcome = Outcome(0, repr(load(file)), "")
        except HodographError as error:
            outcome = Outcome(error.exit_status, "", str(error))
        except Exception as error:
            raise Finding(f"{type(error).__name__}: {error}") from error
    _judge(str(file), outcome.status, outcome.errors, reported)
    return outcome


# --- TOML ---


@dataclass(frozen=True)
class Toml:
    """Documents of one kind: examples of it, and what is done with one."""

    files: tuple[Path, ...]
    use: Callable[[Path], list[Outcome]]
    name: str
    """Of the file, in a folder that has all that it may refer to."""

    def run(self, random: Random, folder: Path) -> None:
        """One case. Raises Finding."""
        trees = [tomllib.loads(file.read_text(encoding="utf-8")) for file in self.files]
        words = [(str(k), t[k]) for tree in trees for t, k in places(tree) if isinstance(t, dict)]
        document = mutate(random.choice(trees), words, random)
        if random.random() < 0.1:
            self._bytes(document.data, random, folder)
            return
        results = []
        for number, text in enumerate((plain(document.data), spelled(document.data, random))):
            _require_same(document.data, text)
            file = _place(folder / str(number), self.name)
            file.write_text(text, encoding="utf-8", newline="")
            results.append([_without_names(each, file) for each in self.use(file)])
        if document.must_refuse and all(each.status == 0 for each in results[0]):
            raise Finding(f"accepted, though {document.must_refuse}")
        for one, two in zip(*results, strict=True):
            if one.status != two.status or (one.status == 0 and one.out != two.out):
                raise Finding(f"another spelling gives another result: {difference(one, two)}")

    def _bytes(self, data: Tree, random: Random, folder: Path) -> None:
        file = _place(folder / "0", self.name)
        file.write_bytes(spoiled(spelled(data, random).encode(), random))
        self.use(file)


def difference(one: Outcome, two: Outcome) -> str:
    """Where two outcomes begin to differ."""
    a, b = (f"{each.status} {each.out or each.errors}" for each in (one, two))
    at = next(
        (i for i, (x, y) in enumerate(zip(a, b, strict=False)) if x != y), min(len(a), len(b))
    )
    start = max(0, at - 60)
    return f"...{a[start : at + 150]!r} and ...{b[start : at + 150]!r}"


def spoiled(content: bytes, random: Random) -> bytes:
    """Some bytes are others, are lost or come twice."""
    changed = bytearray(content)
    for _ in range(random.choice((1, 1, 2, 4, 16))):
        at, count = random.randrange(len(changed) + 1), random.choice((1, 1, 2, 8, 64))
        kind = random.randrange(4)
        if kind == 0:
            changed[at : at + count] = random.randbytes(count)
        elif kind == 1:
            del changed[at : at + count]
        elif kind == 2:
            changed[at:at] = changed[at : at + count]
        elif at < len(changed):
            changed[at] ^= 1 << random.randrange(8)
    return bytes(changed)


def _require_same(data: Tree, text: str) -> None:
    """The text says what was meant: else the mistake is in this tool."""
    if repr(_sorted(tomllib.loads(text))) != repr(_sorted(data)):
        raise AssertionError(f"toml_text writes another document: {data!r}")


def _sorted(data: Any) -> Any:
    if isinstance(data, dict):
        return [(k, _sorted(data[k])) for k in sorted(data)]
    return [_sorted(v) for v in data] if isinstance(data, list) else data


def _place(folder: Path, name: str) -> Path:
    """A file in a copy of the examples."""
    if not folder.exists():
        folder.mkdir(parents=True)
        for kind in ("machines", "drives", "faults", "campaigns"):
            (folder / kind).mkdir()
        for file in EXAMPLES.rglob("*.toml"):
            target = folder / file.relative_to(EXAMPLES)
            target.write_bytes(file.read_bytes())
        (folder / "fuzz.toml").write_text(_SHORT.format(machine="machines/paper_alpha.toml"))
        (folder / "drive.toml").write_text(_SHORT.format(machine="machines/fuzz.toml"))
        machine = (EXAMPLES / "machines/paper_alpha.toml").read_text(encoding="utf-8")
        (folder / "machines/fuzz.toml").write_text(machine.replace("alpha_x", "fuzz"))
    return folder / name


_SHORT = """[path]
closed = false
control_points = [[0, 0], [1, 0.5], [2, 0], [3, 1]]
[feed]
profile = "quintic"
nominal_mm_s = 50
ramp_time_s = 0.05
[limits]
acceleration_mm_s2 = 2000
jerk_mm_s3 = 50000
policy = "respect"
[machine]
file = "{machine}"
"""


def _without_names(outcome: Outcome, file: Path) -> Outcome:
    """Without what differs between two runs of the same: the folder, wall time."""
    out = outcome.out.replace(str(file.parent), "")
    with contextlib.suppress(ValueError):
        found = json.loads(out)
        if isinstance(found, dict):
            out = json.dumps({k: v for k, v in found.items() if k not in _WALL_TIME})
    out = re.sub(r"PosixPath\('[^']*/fuzz/[^']*?/([01])/", "PosixPath('", out)
    return Outcome(outcome.status, out, outcome.errors)


def _use_path(file: Path) -> list[Outcome]:
    image = file.parent / "fuzz.hdgp"
    return [
        command("spline", file, "--json"),
        command("feed", file, "--json"),
        command("compile", file, "-o", image, "--json"),
    ]


def _use_machine(file: Path) -> list[Outcome]:
    path = file.parent.parent / "drive.toml"
    return [
        command("compile", path, "-o", file.parent / "fuzz.hdgp", "--json"),
        command("simulate", path, "--json"),
        command("dbc", file, "-o", file.parent / "fuzz.dbc"),
    ]


def _use_drive(file: Path) -> list[Outcome]:
    path = file.parent.parent / "drive.toml"
    return [
        command("compile", path, "-o", file.parent / "fuzz.hdgp", "--json"),
        command("simulate", path, "--json"),
    ]


def _use_scenario(file: Path) -> list[Outcome]:
    from hodograph.faults.scenario import draw, load_scenario

    def cases(file: Path) -> object:
        scenario = load_scenario(file)
        drawn = [draw(scenario, seed) for seed in range(3)]
        return [(c.rules, c.at, c.last_tick, c.longest_ms, c.scenario.expect) for c in drawn]

    return [loaded(cases, file)]


def _use_campaign(file: Path) -> list[Outcome]:
    from hodograph.campaign.definition import load_campaign

    return [loaded(lambda f: load_campaign(f).design, file)]


# --- Recordings ---


class Recording:
    """Recordings of a short run, as candump log and as ASC."""

    def __init__(self) -> None:
        self._frames: Any = None

    def run(self, random: Random, folder: Path) -> None:
        """One case. Raises Finding."""
        from hodograph.bus.capture.recordings import write_recording

        path = _place(folder / "0", "fuzz.toml")
        if self._frames is None:
            self._frames = _recorded(path, folder)
        names = [folder / "bus.log", folder / "bus.asc"]
        frames = _changed_frames(self._frames, random)
        for name in names:
            write_recording(name, frames)
        if random.random() < 0.4:
            name = random.choice(names)
            name.write_bytes(spoiled(name.read_bytes(), random))
            command("replay", name, path, "--json")
            return
        one, two = (command("replay", name, path, "--json") for name in names)
        results = [json.loads(each.out) for each in (one, two) if each.status == 0]
        for result in results:
            for key in ("bus", "pace"):  # the file's name; ASC has times of its own
                result.pop(key, None)
        if one.status != two.status or (results and results[0] != results[1]):
            raise Finding(f"log and ASC give different results: {difference(one, two)}")


def _recorded(path: Path, folder: Path) -> Any:
    from hodograph.bus.address import BUS_VARIABLE
    from hodograph.bus.capture.recordings import read_recording
    from hodograph.bus.hub import LocalHub

    file = folder / "base.log"
    with LocalHub() as hub:
        os.environ[BUS_VARIABLE] = str(hub.address)
        outcome = command("run", path, "--record", file, "--json")
        del os.environ[BUS_VARIABLE]
    if outcome.status != 0:
        raise AssertionError(f"the run to record failed: {outcome}")
    return read_recording(file)


def _changed_frames(frames: Any, random: Random) -> Any:
    """Frames are lost, come twice, change places, have other bytes, lengths, identifiers, times."""
    import numpy as np

    changed = frames.copy()
    for _ in range(random.choice((0, 1, 1, 2, 8))):
        at = random.randrange(changed.size)
        kind = random.randrange(8)
        if kind == 0:
            changed = np.delete(changed, slice(at, at + random.choice((1, 1, 2, 100))))
        elif kind == 1:
            changed = np.insert(changed, at, changed[at])
        elif kind == 2:
            changed[["id", "length", "data"]][at] = changed[["id", "length", "data"]][at - 1]
        elif kind == 3:
            changed["data"][at, random.randrange(8)] = random.randrange(256)
        elif kind == 4:
            changed["length"][at] = random.randrange(9)
            changed["data"][at, changed["length"][at] :] = 0
        elif kind == 5:
            changed["id"][at] = random.choice((0, 0x80, 0x181, 0x182, 0x202, 0x203, 0x7FF))
        elif kind == 6:
            changed["time_us"][at:] += random.choice((1, 1000, 10**6, 10**10))
        else:
            changed = changed[: at + 1]
        if changed.size == 0:
            return frames
    for i in range(changed.size):  # bytes after the length are in no file
        changed["data"][i, changed["length"][i] :] = 0
    return changed


# --- Images, EDS ---


class Image:
    """Program images with the right CRC."""

    def run(self, random: Random, folder: Path) -> None:
        """One case. Raises Finding."""
        from hodograph.program.image import with_crc

        programs = sorted((ROOT / "tests/data/programs").glob("[al-s]*.hdgp"))
        image = bytearray(random.choice(programs).read_bytes()[:40000])
        for _ in range(random.choice((1, 1, 2, 4))):
            _change_image(image, random)
        sealed = with_crc(bytes(image)) if random.random() < 0.9 else bytes(image)
        folder.mkdir(parents=True, exist_ok=True)
        file = folder / "fuzz.hdgp"
        file.write_bytes(sealed)
        shown = command("inspect", file, "--json")
        command("inspect", file, "--full")
        if shown.status == 0:
            _finite(json.loads(shown.out))
        _compare_checks(sealed)


def _change_image(image: bytearray, random: Random) -> None:
    at = random.randrange(len(image) + 1)
    field = at & ~7
    kind = random.randrange(6)
    if kind == 0 and at < len(image):
        image[at] = random.randrange(256)
    elif kind == 1 and at < len(image):
        image[at] ^= 1 << random.randrange(8)
    elif kind == 2:
        value = random.choice((0, 2**64 - 1, 2**63, 2**63 - 1, 2**62, 1 << random.randrange(64)))
        image[field : field + 8] = value.to_bytes(8, "little")[: len(image) - field]
    elif kind == 3:
        value = int.from_bytes(image[field : field + 8], "little") + random.randrange(-3, 4)
        image[field : field + 8] = (value % 2**64).to_bytes(8, "little")[: len(image) - field]
    elif kind == 4:
        image[field : field + 8] = image[field + 8 : field + 16]
    else:
        del image[at:]


def _finite(found: object) -> None:
    text = json.dumps(found)
    if "NaN" in text or "Infinity" in text:
        raise Finding(f"inspect shows what is no number: {text[:500]}")


def _refused_stop(program: Program, piece: int) -> int | None:
    """HOLD or FAULT: whose bound of this piece the controller refuses, found by a larger one. None: neither alone."""
    from hodograph.native.program import NativeProgram
    from hodograph.program import encode
    from hodograph.program.codes import ProgramError
    from hodograph.program.stops import FAULT, HOLD

    for kind in (HOLD, FAULT):
        bound_us = program.stops.bound_us.copy()
        bound_us[piece, kind] = max(int(bound_us[piece, kind]), _LONG_US)
        hold_us, fault_us = bound_us.max(axis=0).tolist()
        stops = replace(program.stops, bound_us=bound_us, worst_us=(hold_us, fault_us))
        fault = NativeProgram(encode(replace(program, stops=stops))).check()
        if fault is None or (fault.code, fault.index) != (ProgramError.STOP_BOUND, piece):
            return kind
    return None


def is_rounding(image: bytes, code: int, piece: int) -> bool:
    """Whether the controller refuses the bound of a stop only for what its integers round up."""
    from hodograph.program import decode
    from hodograph.program.check_stops import bounds
    from hodograph.program.codes import ProgramError

    if code != ProgramError.STOP_BOUND:
        return False
    program = decode(image)
    kind = _refused_stop(program, piece)
    if kind is None:
        return False
    room_us = float(program.stops.bound_us[piece, kind] - bounds(program, kind)[0][piece])
    return 0.0 <= room_us <= _ROUNDED_US


def _compare_checks(image: bytes) -> None:
    from hodograph.errors import HodographError
    from hodograph.native.program import NativeProgram
    from hodograph.program.check import check_image

    native = None
    try:
        native = NativeProgram(image).check()
        native_code = native.code if native else 0
    except HodographError:
        native_code = -1
    try:
        python = check_image(image)
        python_code = int(python.code) if python else 0
    except HodographError:
        python_code = -1
    except (ArithmeticError, ValueError) as error:
        raise Finding(f"check_image: {type(error).__name__}: {error}") from error
    if (native_code == 0) != (python_code == 0) and not (
        native is not None and python_code == 0 and is_rounding(image, native.code, native.index)
    ):
        raise Finding(f"the check in C says {native_code}, that in Python {python_code}")


class Eds:
    """EDS files, as `dbc --eds` reads them."""

    def run(self, random: Random, folder: Path) -> None:
        """One case. Raises Finding."""
        machine = _place(folder / "0", "machines/paper_alpha.toml")
        lines = (ROOT / "sim/node/drive.eds").read_text(encoding="utf-8").splitlines()
        for _ in range(random.choice((1, 1, 2, 4))):
            _change_lines(lines, random)
        file = folder / "fuzz.eds"
        content = "\n".join(lines).encode("utf-8", "replace")
        file.write_bytes(spoiled(content, random) if random.random() < 0.2 else content)
        command("dbc", machine, "--eds", file, "-o", folder / "fuzz.dbc")


def _change_lines(lines: list[str], random: Random) -> None:
    if not lines:
        return
    at = random.randrange(len(lines))
    key = lines[at].partition("=")[0]
    kind = random.randrange(6)
    if kind == 0:
        del lines[at : at + random.choice((1, 1, 5, 50))]
    elif kind == 1:
        lines.insert(at, random.choice(lines))
    elif kind == 2 and "=" in lines[at]:
        values = ("", "0", "-1", "0x", "0xFFFFFFFFFFFF", "9" * 400, "x", "$NODEID+1", "%", "1.5")
        lines[at] = f"{key}={random.choice(values)}"
    elif kind == 3:
        names = (
            "[]",
            "[1A00]",
            "[1A00sub1]",
            "[607A]",
            "[zz]",
            "[1A00subZ]",
            "[FFFFF]",
            "[DEFAULT]",
        )
        lines[at] = random.choice(names)
    elif kind == 4 and "=" in lines[at]:
        lines[at] = f"{key}={random.choice(lines).partition('=')[2]}"
    else:
        other = random.randrange(len(lines))
        lines[at], lines[other] = lines[other], lines[at]


def _examples(*patterns: str) -> tuple[Path, ...]:
    return tuple(sorted(file for pattern in patterns for file in EXAMPLES.glob(pattern)))


_SCENARIO_FILES = tuple(
    file for file in _examples("faults/*.toml") if file.stem not in ("machine", "path", "other")
)

TARGETS: Mapping[str, Any] = {
    "path": Toml(_examples("[ahs]*.toml"), _use_path, "fuzz.toml"),
    "machine": Toml(_examples("machines/*.toml"), _use_machine, "machines/fuzz.toml"),
    "drive": Toml(_examples("drives/*.toml"), _use_drive, "drives/fuzz.toml"),
    "scenario": Toml(_SCENARIO_FILES, _use_scenario, "faults/fuzz.toml"),
    "campaign": Toml(_examples("campaigns/*.toml"), _use_campaign, "campaigns/fuzz.toml"),
    "recording": Recording(),
    "image": Image(),
    "eds": Eds(),
}
