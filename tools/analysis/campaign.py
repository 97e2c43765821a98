# SPDX-License-Identifier: MIT
"""The campaign of `make count`: counts each kernel on each core, over the example programs and worst-case programs.
Used by tools/count, analysis/tables, analysis/taylor and benchmarks/counts. Reads the images that `make counter` makes,
starts the emulator and (for their versions) the compilers, keeps counts in the cache folder.
"""

from __future__ import annotations

import collections
import hashlib
import subprocess
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from analysis import worst_case
from analysis.counting import Command, Counter, Counts
from analysis.emulator import TARGETS, Target
from analysis.parts import PARTS
from testing.cache import Stamps, content, digest, tree

ROOT = Path(__file__).resolve().parents[2]
# Images of examples/NAME.toml, made once: planning may differ in the last bit from machine to machine.
EXAMPLES = {
    "alpha": ROOT / "tests/data/counts/alpha.hdgp",
    "heart": ROOT / "tests/data/counts/heart.hdgp",
    "star": ROOT / "tests/data/counts/star.hdgp",
    "alpha_optimal": ROOT / "tests/data/counts/alpha_optimal.hdgp",
    "heart_optimal": ROOT / "tests/data/counts/heart_optimal.hdgp",
}

# (target, kernel): most instructions of the motion part in a plain tick; docs/validation/counts.md says
# where it is from.
GOALS = {("an386", "float"): 600, ("an385", "fixed"): 1500, ("microbit", "fixed"): 4000}
OVERRIDE_GOAL = 1.5  # times that with the override active
INTERRUPT_GOAL = 2  # times either for the whole interrupt
SPREAD_GOAL = 1.5  # worst over median
FLOOR = 26  # 25 multiply-adds and a division


@dataclass(frozen=True)
class Scenario:
    """Programs, and the commands that they are run with (each list is one run)."""

    name: str
    programs: str
    commands: tuple[str | None, ...]


SCENARIOS = (
    Scenario("plain", "examples", (None,)),
    Scenario("plain, adversary", "adversary", (None,)),
    Scenario("override", "examples", ("steady", "restless")),
    Scenario("override, adversary", "adversary", ("steady", "restless", "jitter")),
)


# Of the whole interrupt only, with the adversaries: drives that leave every third SYNC unanswered (tests/target/isr.c).
SILENT = {"plain, silent": SCENARIOS[1], "override, silent": SCENARIOS[3]}
# Ticks that find both drives in a fault and begin to brake along the path: one in each program and run, at about these.
FAULTY = {"fault": (None, (60, 61, 64)), "fault, override": ("steady", (40, 41, 44))}

SECTIONS = ("motion", "isr", "receive", "kinds")


# What a tick does with the override, and the function of the core that such a tick calls; the first that fits.
KINDS = {
    "moves": "override_ramp_slope",
    "looks": "override_plan_search",
    "begins": "override_step_of",
    "chooses": "override_plan_change",
    "steady": "override_plan_tick",
}
_FEED, _SUPERVISION = PARTS.index("feed"), PARTS.index("supervision")


def kinds_of(names: Sequence[str], called: npt.NDArray[np.bool_]) -> npt.NDArray[np.int64]:
    """For each tick the position of its kind; `called` says which functions (columns) it called."""
    marks = [called[:, names.index(function)] for function in KINDS.values()]
    kind: npt.NDArray[np.int64] = np.column_stack(marks).argmax(axis=1)
    return kind


def _rising(counts: Counts) -> npt.NDArray[np.bool_]:
    """The first tick of each row of those whose supervision evaluates everything."""
    thorough = counts[:, _SUPERVISION] > np.median(counts[:, _SUPERVISION])
    return thorough & ~np.roll(thorough, 1)


class Campaign:
    """Images of the programs, each made once, and their counting.

    With `stamps`, earlier counts of the same image by the same emulator and tools are used.
    """

    def __init__(self, build: Path, stamps: Stamps | None = None) -> None:
        self.build = build
        self.stamps = stamps
        self.counted = 0  # kernels on cores, now
        self.taken = 0  # from stamps

    @cached_property
    def images(self) -> dict[str, dict[str, bytes]]:
        """Name of a group, name of a program, image."""
        return {
            "examples": {name: file.read_bytes() for name, file in EXAMPLES.items()},
            "adversary": {a.name: worst_case.image(a) for a in worst_case.ADVERSARIES},
        }

    def checksums(self) -> dict[str, str]:
        """First 16 digits of SHA-256 of each image: counts can be compared where these are equal."""
        return {
            name: hashlib.sha256(image).hexdigest()[:16]
            for group in self.images.values()
            for name, image in group.items()
        }

    def scenario(
        self, counter: Counter, kernel: str, scenario: Scenario, file: Path | None = None
    ) -> Counts:
        """All ticks of a scenario. `file` goes to the image as its second word."""
        programs = b"".join(self.images[scenario.programs].values())
        runs = [
            counter.count(kernel, programs, _commands(name), setpoints=file)
            for name in scenario.commands
        ]
        return np.concatenate(runs)

    def interrupts(self, counter: Counter, kernel: str) -> dict[str, Any]:
        """Figures of the interrupts that give setpoints of a program, and of those in which it settles at its end."""
        counts = {s.name: self.scenario(counter, kernel, s) for s in SCENARIOS}
        for name, scenario in SILENT.items():
            counts[name] = self.scenario(counter, kernel, scenario, Path("silent"))
        for name, (commands, ticks) in FAULTY.items():
            runs = [self.trouble(counter, kernel, commands, f"error:{k}") for k in ticks]
            counts[name] = np.concatenate([run[_rising(run)] for run in runs])
        moving = {
            name: figures(c if name in FAULTY else c[c[:, _FEED] > 0])  # a brake reads no feed
            for name, c in counts.items()
        }
        plain = counts[SCENARIOS[0].name]
        runs = [self.trouble(counter, kernel, None, f"lost:{k}") for k in FAULTY["fault"][1]]
        lost = np.concatenate(runs)
        return moving | {
            "drive lost": figures(lost[lost[:, _FEED] == 0]),
            "settling": figures(plain[plain[:, _FEED] == 0]),
        }

    def trouble(self, counter: Counter, kernel: str, commands: str | None, what: str) -> Counts:
        """The adversaries with drives that misbehave (tests/target/isr.c)."""
        programs = b"".join(self.images["adversary"].values())
        return counter.count(kernel, programs, _commands(commands), setpoints=Path(what))

    def kinds(self, motion: Counter, kernel: str) -> dict[str, Any]:
        """Instructions of the feed override, by what a tick does with it, over all scenarios."""
        by_name = Counter(self.build, motion.target, functions=True)
        rate, called = [], []
        for scenario in SCENARIOS:
            rate.append(self.scenario(motion, kernel, scenario)[:, PARTS.index("rate")])
            called.append(self.scenario(by_name, kernel, scenario) > 0)
        kind = kinds_of(by_name.names, np.concatenate(called))
        column = np.concatenate(rate)[:, np.newaxis]
        return {name: figures(column[kind == i]) for i, name in enumerate(KINDS)}

    def pair(self, target: Target, kernel: str) -> dict[str, Any]:
        """The figures of one kernel on one core: of the motion part, of the whole interrupts."""
        motion, tick = Counter(self.build, target), Counter(self.build, target, "isr", "isr")
        receive = Counter(self.build, target, "isr", "receive")
        return {
            "motion": {s.name: figures(self.scenario(motion, kernel, s)) for s in SCENARIOS},
            "isr": self.interrupts(tick, kernel),
            "receive": {"plain": figures(self.scenario(receive, kernel, SCENARIOS[0]))},
            "kinds": self.kinds(motion, kernel),
        }

    def pair_stamped(self, target: Target, kernel: str) -> Any:
        """The result of `pair`, or that of a stamp."""
        images = ("setpoints", "isr")
        return self.stamped(kernel, [target], images, lambda: self.pair(target, kernel))

    def stamped(
        self, name: str, targets: Sequence[Target], images: Sequence[str], count: Callable[[], Any]
    ) -> Any:
        """What `count` gives, by these images of these targets; from a stamp where there is one."""
        if self.stamps is None:
            self.counted += 1
            return count()
        files = [
            self.build / "firmware" / t.name / f"{image}.elf" for t in targets for image in images
        ]
        words = [name, self._tools, *map(content, files), *(" ".join(t.qemu) for t in targets)]
        key = digest([*words, *sorted(f"{n} {c}" for n, c in self.checksums().items())])
        kept = self.stamps.read(key)
        if kept is not None:
            self.taken += 1
            return kept["figures"]
        self.counted += 1
        figures_ = count()
        self.stamps.write(key, {"figures": figures_})
        return figures_

    @cached_property
    def _tools(self) -> str:
        """Hash of all that counts: emulators, binary utilities, the plugin, these modules."""
        programs = ["qemu-system-arm", "qemu-system-riscv32"]
        programs += [f"{t.cross}{tool}" for t in TARGETS.values() for tool in ("gcc", "objdump")]
        versions = [_first_line([program, "--version"]) for program in programs]
        plugin = content(self.build / "target/count_plugin.so")
        return digest([plugin, tree(ROOT / "tools/analysis"), *versions])

    def run(self) -> dict[str, Any]:
        """Everything."""
        pairs = [(t, k) for t in TARGETS.values() for k in t.kernels]
        checksums = self.checksums()
        with ThreadPoolExecutor(2) as pool:
            done = list(pool.map(lambda pair: self.pair_stamped(*pair), pairs))
        sections = {
            section: {f"{t.name} {k}": d[section] for (t, k), d in zip(pairs, done, strict=True)}
            for section in SECTIONS
        }
        return {"compilers": compilers(), "programs": checksums} | sections


def _commands(name: str | None) -> Sequence[Command]:
    return worst_case.COMMANDS[name]() if name else ()


def compilers() -> dict[str, str]:
    """Version of the compiler for each family of cores: counts are those of one compiler."""
    crosses = sorted({t.cross for t in TARGETS.values()})
    return {cross + "gcc": _first_line([f"{cross}gcc", "--version"]) for cross in crosses}


def _first_line(command: list[str]) -> str:
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[0].split(") ", 1)[-1]


def figures(counts: Counts) -> dict[str, Any]:
    """Least, median and most of the whole and of the parts that there are, and their histograms."""
    columns = {"whole": counts.sum(axis=1)}
    if counts.shape[1] == len(PARTS):
        columns |= {p: counts[:, i] for i, p in enumerate(PARTS) if counts[:, i].any()}
    out: dict[str, Any] = {"ticks": len(counts)}
    out |= {name: _three(column) for name, column in columns.items()}
    return out | {"histogram": {name: _bins(column) for name, column in columns.items()}}


def _bins(column: Counts) -> dict[str, int]:
    bins = collections.Counter(_two_digits(int(n)) for n in column)
    return {str(low): bins[low] for low in sorted(bins)}


def _two_digits(count: int) -> int:
    """Rounded down to two digits: the bins of the histogram."""
    step: int = 10 ** max(len(str(count)) - 2, 0)
    return count // step * step


def _three(column: Counts) -> list[int]:
    middle = np.sort(column)[(len(column) - 1) // 2]
    return [int(column.min()), int(middle), int(column.max())]
